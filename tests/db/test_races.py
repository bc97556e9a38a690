"""Many processes at one database: no run is claimed twice, none is left, nobody is turned away."""

import subprocess
import sys

from tests.harness.helpers import spec
from zoobench.db.rows import RunState
from zoobench.db.store import Store

_WORKER = """
import sys
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, FinalRow, RunState
from zoobench.db.store import Store
store = Store(sys.argv[1])
while (claim := store.claim(Owner.current(), provenance={})) is not None:
    store.commit(claim, Batch(metrics={("loss", 0): 1.0}))
    store.finish(claim, Ending(RunState.DONE, finals=(FinalRow("score", 1.0),)), Batch())
    print(claim.run_id)
"""

_PLANNER = """
import sys
from tests.harness.helpers import spec
from zoobench.db.store import Store
seeds = sorted(range(100), reverse=int(sys.argv[2]) % 2 == 1)
print(len(Store(sys.argv[1]).enqueue(spec(seed) for seed in seeds).new))
"""


def _crowd(location: str, code: str, size: int) -> list[str]:
    command = [sys.executable, "-c", code, location]
    processes = [subprocess.Popen([*command, str(number)], stdout=subprocess.PIPE, text=True) for number in range(size)]
    outputs = [process.communicate(timeout=120)[0] for process in processes]
    assert [process.returncode for process in processes] == [0] * size
    return [line for output in outputs for line in output.splitlines()]


def test_no_run_is_claimed_twice(location: str) -> None:
    """Three processes that empty one queue at the same time share it without overlap."""
    with Store(location) as store:
        ids = store.enqueue(spec(seed) for seed in range(60)).new
        claimed = _crowd(location, _WORKER, 3)
        assert sorted(map(int, claimed)) == list(ids)
        assert store.counts() == {RunState.DONE: 60}
        assert all(run.attempt == 1 for run in store.runs())
        assert store.check() == []


def test_many_can_make_the_database_at_once(location: str) -> None:
    """The one that comes first makes the tables, the others find them."""
    code = "import sys; from zoobench.db.store import Store; print(len(Store(sys.argv[1]).runs()))"
    assert _crowd(location, code, 4) == ["0"] * 4


def test_one_grid_is_queued_once_in_whatever_order(location: str) -> None:
    """Several who ask for the same runs at once, first to last and last to first, do not stand in each other's way."""
    assert sum(map(int, _crowd(location, _PLANNER, 2))) == 100
    with Store(location) as store:
        assert [run.id for run in store.runs()] == list(range(1, 101))
