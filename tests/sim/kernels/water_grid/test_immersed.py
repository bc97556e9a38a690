"""A robot in water on a grid: momentum, added mass, weight, gradients, checkpoints and worlds."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.test_adjoint import GROUPS, Probe
from tests.sim.wet_scenes import SIZE, block_in_water, empty_water, fine, flow_of, muscles_in_water, stirred
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.solver import Solver
from zoobench.sim.step_control import Diagnostics


def test_still_water_and_a_body_of_its_density_stay_at_rest() -> None:
    """Nothing moves but by the rounding of weight against buoyancy."""
    solver = Solver(block_in_water(), fine())
    solver.substeps(50, 2e-4)
    assert solver.matter.v.abs().max() < 1e-7
    assert np.abs(flow_of(solver)).max() < 1e-7


def test_a_body_set_in_motion_takes_water_along() -> None:
    """In the first step it keeps what its added mass leaves: a cube's is about half of its own mass to two thirds."""
    solver = Solver(block_in_water(np.array([0.05, 0.0, 0.0])), fine())
    solver.substeps(1, 2e-4)
    share = scenes.momenta(solver)[0][0] / (solver.parameters.mass[0].sum().item() * 0.05)
    assert 0.55 < share < 0.72


def test_a_body_coasts() -> None:
    """A tenth of a second later it has lost little more."""
    solver = Solver(block_in_water(np.array([0.05, 0.0, 0.0])), fine())
    solver.substeps(1, 2e-4)
    first = scenes.momenta(solver)[0][0]
    solver.substeps(500, 2e-4)
    assert 0.6 * first < scenes.momenta(solver)[0][0] < first


@pytest.mark.parametrize(("density", "sign"), [(1200.0, -1.0), (700.0, 1.0)])
def test_a_body_sinks_or_rises_by_its_density(density: float, sign: float) -> None:
    """At first with the acceleration of its weight without buoyancy on its own and the added mass, here 0.6 to 1.1."""
    solver = Solver(block_in_water(density=density), fine())
    solver.substeps(100, 2e-4)
    speed = scenes.momenta(solver)[0][1] / solver.parameters.mass[0].sum().item()
    excess = abs(density / 1000.0 - 1.0)
    assert 9.81 * excess / (density / 1000.0 + 1.1) < sign * speed / 0.02 < 9.81 * excess / (density / 1000.0 + 0.6)


@pytest.mark.parametrize(("frames", "least"), [(4, 10), pytest.param(40, 110, marks=pytest.mark.slow)])
def test_gradients_are_exact(frames: int, least: int) -> None:
    """By actuation and all of the body, through robot and water, weight and muscles, against central differences."""
    probe = Probe(muscles_in_water(), frames)
    gradient = probe.gradient()
    assert not gradient.fault
    assert probe.rollout.counts.sum() >= least
    rng = np.random.default_rng(0)
    for name in GROUPS:
        direction = rng.normal(size=probe.base[name].shape)
        assert probe.error(gradient, name, direction, enough=1e-6) <= 1e-6, name


def test_gradients_do_not_depend_on_what_is_stored() -> None:
    """With checkpoints in place of all states they are the same bit for bit."""
    _, _, whole = scenes.episode(muscles_in_water(), 6)
    _, _, parts = scenes.episode(muscles_in_water(), 6, checkpoint_interval=2)
    assert scenes.same(whole, parts)


def test_worlds_do_not_mix() -> None:
    """Two worlds side by side are the same as each alone, water included."""
    solver = Solver(muscles_in_water(), fine(), worlds=2)
    activity = scenes.actuation(solver, 3)
    both = solver.run(activity)
    for world in range(2):
        alone = Solver(muscles_in_water(), fine())
        assert np.array_equal(alone.run(activity[:, world : world + 1]).positions[:, 0], both.positions[:, world])
        assert np.array_equal(flow_of(alone), flow_of(solver, world))


def test_fast_water_shortens_the_step() -> None:
    """The step follows the water's speed, too, and water that is not finite is noticed."""
    slow, fast = (Solver(empty_water(speed * stirred(), 1 / 32), fine()) for speed in (1e-6, 100.0))
    assert fast.current_limit()[0].dt < 0.5 * slow.current_limit()[0].dt
    fast.matter.flow[0, 0, 7, 1] = np.nan
    assert np.isnan(Diagnostics(fast.simulation).survey()[0].speed)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"water": GridWater(density=-1.0)}, "Give a positive density"),
        ({"water": GridWater(velocities=np.full((2, 2, 2, 3), np.nan))}, "not finite"),
        ({"ground": scenes.ground_scene().ground}, "Leave out the medium, and friction"),
    ],
)
def test_impossible_water_is_refused(changes: dict[str, object], message: str) -> None:
    """With what was given and what to do."""
    with pytest.raises(SceneError, match=message):
        replace(block_in_water(), **changes)  # type: ignore[arg-type]


def test_water_needs_some_cells_and_one_thread() -> None:
    """Neither a box of two cells nor worlds at once can be simulated."""
    with pytest.raises(SceneError, match="at least 2"):
        Solver(block_in_water(), replace(fine(), grid_spacing=SIZE[1]))
    with pytest.raises(UsageError, match="one thread"):
        Solver(block_in_water(), fine(), parallel=True)


@pytest.mark.slow  # tests/sim/kernels/test_velocity_fields.py shows it of a bed; its kernel takes eight seconds
def test_a_face_beyond_a_wall_that_the_robot_hardly_touches_has_finite_adjoints() -> None:
    """Its mass is 1e-27 kg, whose square is 0 in single precision, in which gradients are those of double."""
    # the robot's lowest corner is just within reach of the splines of faces below the floor
    corner = np.array([3.5, 1.0, 4.0]) - 1e-4
    scenes.compare_precisions(scenes.with_corner_at(muscles_in_water(), corner))
