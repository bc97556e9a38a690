"""The child process with the real simulator in it: what it reports, and that a killed run comes to the same end."""

from pathlib import Path

import numpy as np
import pytest

from tests.harness.helpers import KillOnce, numbers
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.harness import presets
from zoobench.harness.grid import expand
from zoobench.harness.launch import launch
from zoobench.problem import Problem
from zoobench.spec import Budget, Ref, RunSpec

_ITERATIONS = 150


def _queue(path: Path, method: str) -> tuple[int, ...]:
    smoke = presets.get("smoke")
    methods, budget = [Ref.parse(method)], Budget("iterations", _ITERATIONS)
    grid = smoke.grid([Ref("ground")], [Ref("movement-speed")], methods=methods, budget=budget)
    with Store(path) as store:
        return store.enqueue(run for run in expand(grid) if isinstance(run, RunSpec)).open


@pytest.mark.parametrize("method", ["diffphysics[restarts=1]", "random[batch=1]"])
def test_a_killed_run_ends_as_an_undisturbed_one(tmp_path: Path, method: str) -> None:
    """The two runs of one spec agree bit for bit in every stored number, though one was killed in the middle."""
    battered, calm = tmp_path / "battered.db", tmp_path / "calm.db"
    killer = KillOnce()
    (row,) = launch(battered, _queue(battered, method), on_update=killer)
    (other,) = launch(calm, _queue(calm, method))
    assert killer.done, "the run ended before it could be killed"
    assert (row.state, row.attempt, other.attempt) == (RunState.DONE, 2, 1)
    assert numbers(battered, row.id) == numbers(calm, other.id)
    with Store(calm) as store:
        finals = {final.name: final.value for final in store.finals(other.id)}
        assert finals["iterations"] == _ITERATIONS
        assert finals["forward_substeps"] > 0.0
        assert {"idle_score", "random_score"} <= set(finals)
        assert finals["score"] == max(point.value for point in store.metrics(other.id, "score_current"))
        assert other.score == finals["score"]
        params = store.solution(other.id)
    assert params is not None
    assert Problem(other.spec).evaluate(np.array(params)).score == finals["score"]
    with Store(battered) as store:
        assert store.solution(row.id) == params
