"""How near a robot comes to the sides of its arena."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conformance.cells import SEA, cell
from tests.sim import scenes
from tests.tasks.motions import carried
from zoobench.cell.problem import Problem
from zoobench.cell.wall_gap import gaps_of, told, wall_gaps
from zoobench.errors import Divergence
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.surface_water import SurfaceWater

LOWER, UPPER, SPACING = (0.0, 0.0, 0.0), (2.0, 0.5, 1.0), 0.1
HERE = np.ones(2, bool)


def _path(*places: tuple[float, float, float]) -> np.ndarray:
    """A robot of two particles, one of which stays in the middle, and the other goes through these places."""
    return np.array([[(1.0, 0.1, 0.5), place] for place in places])


@pytest.mark.parametrize(
    ("place", "gap"),
    [
        ((0.25, 0.1, 0.5), 2.5),
        ((1.85, 0.1, 0.5), 1.5),
        ((1.0, 0.1, 0.12), 1.2),
        ((1.0, 0.1, 0.97), 0.3),
        ((2.05, 0.1, 0.5), -0.5),
        ((1.0, 0.0, 0.5), 5.0),
        ((1.0, 0.5, 0.5), 5.0),
    ],
)
def test_the_gap_is_that_of_the_nearest_particle_to_the_nearest_side(
    place: tuple[float, float, float], gap: float
) -> None:
    """In cells, negative beyond it; neither the ground nor the ceiling is a side."""
    found = wall_gaps(_path((1.0, 0.1, 0.5), place), HERE, LOWER, UPPER, SPACING)
    assert found == pytest.approx([5.0, gap])


def test_sides_may_move_with_the_robot() -> None:
    """Of an arena that follows it the corners are given after every frame."""
    shifts = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])
    path = _path((1.0, 0.1, 0.5), (1.9, 0.1, 0.5))
    assert wall_gaps(path, HERE, LOWER + shifts, UPPER + shifts, SPACING)[1] == pytest.approx(5.0)
    assert wall_gaps(path, HERE, LOWER, UPPER, SPACING)[1] == pytest.approx(1.0)


def test_what_a_robot_does_not_have_meets_nothing() -> None:
    """A particle that is absent does not count, and a robot without any is nowhere near."""
    path = _path((0.05, 0.1, 0.5))
    assert wall_gaps(path, np.array([True, False]), LOWER, UPPER, SPACING) == pytest.approx([5.0])
    assert np.isinf(wall_gaps(path, ~HERE, LOWER, UPPER, SPACING)).all()


def test_an_object_may_meet_a_side_before_its_robot() -> None:
    """The nearest of both counts: what is pushed reaches it first."""
    scene = Scene(scenes.ground_scene().robot, (-0.5, 0.0, -0.5), (1.0, 1.0, 1.0))
    motion = carried([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.6, 0.0, 0.0]])
    found = gaps_of(motion, scene, np.zeros((3, 3)), SPACING)
    ends = motion.object.positions[:, 0, :, 0].max(dim=1).values.numpy()
    assert found[-1] == pytest.approx((1.0 - ends[-1]) / SPACING)
    assert found[0] > found[-1]


@pytest.mark.parametrize(("up", "why"), [(-9.0, "pressed what is below it through the ground"), (9.0, "ceiling")])
def test_a_base_that_leaves_the_arena_is_told_so(up: float, why: str) -> None:
    """A larger arena or a shorter episode alone would be no remedy."""
    problem = Problem(cell(task="reach", design="arm[base_speed=1]", frames=40))
    parameters = np.zeros(problem.parameter_count)
    parameters[-2] = up
    found = problem.evaluate(parameters)
    assert found.score == -np.inf
    assert why in str(found.failure)


@pytest.mark.parametrize(("current", "named"), [((8.0, 0.0, 0.0), True), ((0.0, 0.0, 0.0), False)])
def test_what_fails_in_water_by_forces_is_told_what_crushed_it(
    current: tuple[float, float, float], named: bool
) -> None:
    """A current, where there is one, and the body's strength; the water has no sides, however near they are."""
    scene = replace(Problem(cell(environment=SEA)).scene, surface_water=SurfaceWater(current=current))
    failure = Divergence(0, 5, 9, "finite state", np.nan, 0.5, 0, (np.nan,) * 3, "Use a smaller Courant fraction.")
    for gap in (np.nan, 0.1):
        advice = told(failure, gap, scene).advice
        assert ("a weaker current" in advice) is named
        assert "muscle_strength" in advice
        assert "youngs_modulus" in advice
        assert "Courant" not in advice
