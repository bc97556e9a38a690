"""A run that begins with what another has found, with the real simulator in a process of its own."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.conformance.cells import cell
from tests.harness.helpers import Killer, numbers
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.harness.worker_pool import run_all
from zoobench.inputs import run_name
from zoobench.spec import Budget, RunSpec

FIRST = replace(cell(Budget("iterations", 2), method="random[batch=2]"), seed=4)


def _warm(method: str, first: RunSpec = FIRST) -> RunSpec:
    return cell(Budget("iterations", 2), method=f"{method[:-1]},start={run_name(first.key())}]")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["diffphysics[restarts=3]", "cmaes[sigma=1e-9,population=4]"])
def test_it_begins_where_the_other_ended(tmp_path: Path, method: str) -> None:
    """Its first score is the other's last, whatever the runs' numbers are; and it says in its log what it took."""
    path = tmp_path / "runs.db"
    spec = _warm(method)
    with Store(path) as store:
        ids = store.enqueue([FIRST, spec]).new
    first, warm = run_all(path, ids, jobs=1)
    assert (first.state, warm.state) == (RunState.DONE, RunState.DONE), warm.reason
    with Store(path) as store:
        scores = [point.value for point in store.metrics(warm.id, "score")]
        assert scores[0] == pytest.approx(first.score, rel=1e-5)
        assert any("parameters are those of the start" in line.text for line in store.logs(warm.id))
        finals = {final.name: final.value for final in store.finals(warm.id)}
    assert finals["episodes"] == (2 if "diffphysics" in method else 8)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["diffphysics[restarts=1]", "cmaes[population=4]"])
def test_a_killed_one_ends_as_an_undisturbed_one(tmp_path: Path, method: str) -> None:
    """It goes on from its checkpoint and begins nowhere else."""
    warm = replace(_warm(method), budget=Budget("iterations", 100))
    killer, found = Killer(method), []
    for name, watch in (("battered", killer), ("calm", None)):
        path = tmp_path / f"{name}.db"
        with Store(path) as store:
            first, second = store.enqueue([FIRST, warm]).new
        run_all(path, [first])
        (row,) = run_all(path, [second], on_update=watch)
        found.append((row.state, numbers(path, second)))
    assert killer.done, "the run ended before it could be killed"
    assert found[0] == found[1]


@pytest.mark.slow
def test_without_its_start_a_run_fails_and_says_why(tmp_path: Path) -> None:
    """It begins nowhere else instead."""
    with Store(tmp_path / "runs.db") as store:
        ids = store.enqueue([_warm("diffphysics[restarts=1]")]).new
    (row,) = run_all(tmp_path / "runs.db", ids)
    assert row.state is RunState.FAILED
    assert row.reason is not None
    assert "Do that run first" in row.reason
