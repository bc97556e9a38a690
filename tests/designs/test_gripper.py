"""The gripper."""

import numpy as np
import pytest

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.designs.gripper import Gripper
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import FRAME_SECONDS
from zoobench.testing import small_cell


@pytest.mark.parametrize("fingers", [2, 3, 4])
def test_its_fingers_leave_the_opening_free(fingers: int) -> None:
    """No matter below the base is nearer to the axis than half the opening, and every finger has four muscles."""
    body = Gripper(fingers=fingers).body(Fidelity(1 / 64))
    assert body.anchored is not None
    free = body.positions[~body.anchored]
    assert np.hypot(free[:, 0], free[:, 2]).min() > 0.035 - body.edge / 2
    assert body.muscle_count == 4 * fingers
    assert body.muscle_membership[body.anchored].sum(axis=1).max() < 0.5
    volumes = (body.volumes @ body.muscle_membership).reshape(fingers, 4)
    np.testing.assert_allclose(volumes.sum(axis=1), volumes.sum() / fingers, rtol=0.05)


def _with_ball(task: str, frames: int) -> tuple[Problem, Array]:
    """Two fingers about a ball on a base that moves, and an activity by which it moves ahead and up."""
    problem = Problem(
        small_cell(
            environment="ground[object=ball,object_place=below,object_size=0.05]",
            task=task,
            design="gripper[base_speed=0.2,opening=0.055]",
            fidelity="draft[precision=64]",
            frames=frames,
        )
    )
    parameters = np.zeros(problem.parameter_count)
    parameters[-3:] = 1.0, 0.5, 0.0
    return problem, parameters


@pytest.mark.slow
def test_a_base_moves_as_its_channels_say() -> None:
    """Whatever its fingers push against: speed times activity, in every frame."""
    problem, parameters = _with_ball("lift", 10)
    seen: list[Array] = []
    problem.episode(parameters, watch=lambda positions, *_: seen.append(np.array(positions).reshape(-1, 3)))
    held = np.flatnonzero(problem.body.anchored)
    moved = (seen[-1] - seen[0])[held]
    expected = 0.2 * np.tanh([1.0, 0.5, 0.0]) * 10 * FRAME_SECONDS
    np.testing.assert_allclose(moved, np.broadcast_to(expected, moved.shape), atol=1e-12)


def test_the_gradient_by_the_channels_of_a_base_is_that_of_differences() -> None:
    """Of a ball that it pushes along."""
    problem, parameters = _with_ball("push", 16)
    _, gradient = problem.loss_and_grad(parameters)
    for place, width in ((-3, 1e-5), (-2, 1e-4)):
        step = np.zeros(len(parameters))
        step[place] = width
        ahead, behind = (problem.evaluate(parameters + sign * step).score for sign in (1.0, -1.0))
        assert -gradient[place] == pytest.approx((ahead - behind) / (2.0 * width), rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("environment", "direction", "what"),
    [
        ("ground", -2, "through the ground"),
        ("ground[obstacle=ceiling,obstacle_distance=0.02,obstacle_opening=0.2]", -3, "base in what is held"),
    ],
)
def test_a_base_that_goes_where_nothing_can_be_has_no_score(environment: str, direction: int, what: str) -> None:
    """Down into the ground, or ahead into an obstacle: the failure says so, and what to do."""
    problem = Problem(
        small_cell(environment=environment, task="reach", design="arm[base_speed=1]", fidelity="smoke", frames=40)
    )
    parameters = np.zeros(problem.parameter_count)
    parameters[direction] = -9.0 if direction == -2 else 9.0
    found = problem.evaluate(parameters)
    assert what in str(found.failure)
    assert "lower base_speed" in str(found.failure)


@pytest.mark.parametrize(
    "given", [{"fingers": 5}, {"opening": 0.0}, {"fingers": 4, "opening": 0.02}, {"base_speed": -0.1}]
)
def test_impossible_grippers_are_refused(given: dict[str, float]) -> None:
    """Before any body is made."""
    with pytest.raises(UsageError):
        Gripper(**given)  # type: ignore[arg-type]
