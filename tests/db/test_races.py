"""Many processes at one database: no run is claimed twice, none is left, nobody is turned away."""

import subprocess
import sys
from pathlib import Path

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


def _crowd(path: Path, code: str, size: int) -> list[str]:
    processes = [
        subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True)
        for _ in range(size)
    ]
    outputs = [process.communicate(timeout=120)[0] for process in processes]
    assert [process.returncode for process in processes] == [0] * size
    return [line for output in outputs for line in output.splitlines()]


def test_no_run_is_claimed_twice(tmp_path: Path) -> None:
    """Four processes that empty one queue at the same time share it without overlap."""
    path = tmp_path / "zoo.db"
    with Store(path) as store:
        ids = store.enqueue(spec(seed) for seed in range(60)).new
        claimed = _crowd(path, _WORKER, 4)
        assert sorted(map(int, claimed)) == list(ids)
        assert store.counts() == {RunState.DONE: 60}
        assert all(run.attempt == 1 for run in store.runs())
        assert store.check() == []


def test_many_can_make_the_database_at_once(tmp_path: Path) -> None:
    """The one that comes first makes the tables, the others find them."""
    code = "import sys; from zoobench.db.store import Store; print(len(Store(sys.argv[1]).runs()))"
    assert _crowd(tmp_path / "zoo.db", code, 6) == ["0"] * 6
