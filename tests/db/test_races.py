"""Many processes at one database: no run is claimed twice, none is left, nobody is turned away."""

import itertools
import json
import subprocess
import sys
from collections.abc import Callable
from multiprocessing import get_context
from typing import Any

from tests.harness.helpers import spec
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, FinalRow, RunState
from zoobench.db.store import Store


def work(location: str, number: int) -> list[int]:
    """Empty the queue; the ids of the runs that were claimed."""
    claimed = []
    store = Store(location)
    while (claim := store.claim(Owner.current(), provenance={})) is not None:
        store.commit(claim, Batch(metrics={("loss", 0): 1.0}))
        store.finish(claim, Ending(RunState.DONE, finals=(FinalRow("score", 1.0),)), Batch())
        claimed.append(claim.run_id)
    return claimed


def make(location: str, number: int) -> int:
    """Make the database, or find it."""
    return len(Store(location).runs())


def plan(location: str, number: int) -> int:
    """Queue a hundred runs, every second time from the last to the first; how many were new."""
    return len(Store(location).enqueue(spec(seed) for seed in sorted(range(100), reverse=number % 2 == 1)).new)


def crowd(name: str, location: str, size: int) -> None:
    """Print what each of so many processes at once, forked from this one, makes of it."""
    with get_context("fork").Pool(size) as pool:
        print(json.dumps(pool.starmap(globals()[name], [(location, number) for number in range(size)], chunksize=1)))


def _crowd(location: str, done: Callable[[str, int], object], size: int) -> list[Any]:
    code = f"from tests.db.test_races import crowd; crowd({done.__name__!r}, {location!r}, {size})"
    ended = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True, timeout=120)
    answers: list[Any] = json.loads(ended.stdout)
    return answers


def test_no_run_is_claimed_twice(location: str) -> None:
    """Three processes that empty one queue at the same time share it without overlap."""
    with Store(location) as store:
        ids = store.enqueue(spec(seed) for seed in range(60)).new
        claimed = _crowd(location, work, 3)
        assert sorted(itertools.chain(*claimed)) == list(ids)
        assert store.counts() == {RunState.DONE: 60}
        assert all(run.attempt == 1 for run in store.runs())
        assert store.check() == []


def test_many_can_make_the_database_at_once(location: str) -> None:
    """The one that comes first makes the tables, the others find them."""
    assert _crowd(location, make, 4) == [0] * 4


def test_one_grid_is_queued_once_in_whatever_order(location: str) -> None:
    """Several who ask for the same runs at once, first to last and last to first, do not stand in each other's way."""
    assert sum(_crowd(location, plan, 2)) == 100
    with Store(location) as store:
        assert [run.id for run in store.runs()] == list(range(1, 101))
