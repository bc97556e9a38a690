"""The probe: the same controllers in every simulation, with the requested records."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from tests.methods.toy import Context, still
from zoobench import registry
from zoobench.cell.episode import Episode, Evaluation, Record
from zoobench.cell.problem import Problem
from zoobench.errors import UnknownNameError
from zoobench.harness.child import ChildContext
from zoobench.harness.grid import parse_selector
from zoobench.methods.probe import EVERY, path_and_spread
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec


def _curves(spec: RunSpec) -> dict[str, list[float]]:
    context = Context()
    registry.create(Kind.METHOD, spec.method).run(Problem(spec), context)
    curves: dict[str, list[float]] = {}
    for _, readings in context.curve:
        for name, value in readings.items():
            curves.setdefault(name, []).append(value)
    return curves


def test_a_draw_is_scored_by_every_task_that_was_asked_for() -> None:
    """Scores are those of runs of each task; trajectories, moments and gradients are complete."""
    budget = Budget("episodes", 3)
    both = _curves(cell(budget, frames=10, method="probe[gradients=2,also=turning]"))
    turning = _curves(cell(budget, frames=10, method="probe", task="turning"))
    assert both["score_turning"] == turning["score_current"]
    assert len(both["score_current"]) == 3
    assert len(both["path_x_1"]) == 10 // EVERY + 1
    assert len(both["slope_0"]) == Problem(cell()).parameter_count
    assert "path_x_2" not in both
    assert "path_x_0" not in turning


def test_the_controllers_depend_neither_on_fidelity_nor_on_environment() -> None:
    """Another seed gives others."""

    def draw(spec: RunSpec) -> np.ndarray:
        return ChildContext(spec, None, None, None).rng.normal(size=4)  # type: ignore[arg-type]

    base = draw(cell(method="probe"))
    for other in (
        cell(method="probe[gradients=2]", fidelity="draft[precision=64]"),
        cell(method="probe", environment="ocean[bulk_modulus=4e5]"),
    ):
        np.testing.assert_array_equal(draw(other), base)
    assert (draw(cell(method="probe", seed=1)) != base).all()
    assert (draw(cell(method="random")) != draw(cell(method="random", environment="ice"))).all()


def test_path_and_spread_of_a_moving_bar() -> None:
    """Two masses 0.2 m apart along x, moved along z: the displacement, and (0.1 m)^2 along x only."""
    frames = 2 * EVERY + 1
    places = torch.zeros((frames, 1, 2, 3), dtype=torch.float64)
    places[:, 0, :, 0] = torch.tensor([-0.1, 0.1])
    places[:, 0, :, 2] = torch.linspace(1.0, 1.5, frames, dtype=torch.float64)[:, None]
    motion = replace(still(), positions=places, masses=torch.ones((1, 2), dtype=torch.float64))
    record = Record(motion, np.zeros((0, 0)), body=None, scene=None)  # type: ignore[arg-type]
    path, spread = path_and_spread(Episode(Evaluation(0.0, {}, np.zeros(0)), np.zeros(0), record))
    np.testing.assert_allclose(path, [[0, 0, 0], [0, 0, 0.25], [0, 0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(spread, np.tile([0.01, 0, 0, 0, 0, 0], (3, 1)), atol=1e-12)


def test_patterns_pass_the_probe_over() -> None:
    """Only its exact name selects it."""
    assert "probe" not in {ref.name for ref in parse_selector("*", Kind.METHOD)}
    assert parse_selector("probe", Kind.METHOD) == [Ref("probe")]


def test_an_unknown_further_task_is_refused() -> None:
    """Before anything runs, with suggestions."""
    with pytest.raises(UnknownNameError, match="turnign"):
        registry.create(Kind.METHOD, Ref.parse("probe[also=turnign]"))
    assert math.isfinite(sum(_curves(cell(Budget("episodes", 1), method="probe"))["score_current"]))
