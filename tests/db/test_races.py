"""Many processes at one database: no run is claimed twice, none is left, nobody is turned away."""

import itertools
import json
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from typing import Any

import pytest

from tests.harness.helpers import spec
from tests.new_databases import unsynced_files
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


def serve() -> None:
    """For each line that asks for it, what each of so many processes at once, forked from this one, makes of it."""
    for line in sys.stdin:
        name, location, size = json.loads(line)
        with unsynced_files(), get_context("fork").Pool(size) as pool:
            answers = pool.starmap_async(globals()[name], [(location, number) for number in range(size)], chunksize=1)
            try:
                found = answers.get(timeout=120.0)
            except Exception:  # of this crowd alone
                traceback.print_exc()
                found = None
        print(json.dumps(found), flush=True)


Crowd = Callable[[str, Callable[[str, int], object], int], list[Any]]


@pytest.fixture(scope="module")
def crowd() -> Iterator[Crowd]:
    """Have so many processes at once do something with a database; their answers."""
    code = "from tests.db.test_races import serve; serve()"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        assert process.stdin
        assert process.stdout
        asked, told = process.stdin, process.stdout

        def ask(location: str, done: Callable[[str, int], object], size: int) -> list[Any]:
            print(json.dumps([done.__name__, location, size]), file=asked)
            answers: list[Any] | None = json.loads(told.readline())
            assert answers is not None, "a process of the crowd has failed"
            return answers

        yield ask
        asked.close()


def test_no_run_is_claimed_twice(location: str, crowd: Crowd) -> None:
    """Three processes that empty one queue at the same time share it without overlap."""
    with Store(location) as store:
        ids = store.enqueue(spec(seed) for seed in range(60)).new
        claimed = crowd(location, work, 3)
        assert sorted(itertools.chain(*claimed)) == list(ids)
        assert store.counts() == {RunState.DONE: 60}
        assert all(run.attempt == 1 for run in store.runs())
        assert store.check() == []


def test_many_can_make_the_database_at_once(location: str, crowd: Crowd) -> None:
    """The one that comes first makes the tables, the others find them."""
    assert crowd(location, make, 4) == [0] * 4


@pytest.mark.slow
def test_one_grid_is_queued_once_in_whatever_order(location: str, crowd: Crowd) -> None:
    """Several who ask for the same runs at once, first to last and last to first, do not stand in each other's way."""
    assert sum(crowd(location, plan, 2)) == 100
    with Store(location) as store:
        assert [run.id for run in store.runs()] == list(range(1, 101))
