"""Closed forms and conservation laws, worlds, repeatability and the solver's own checks."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.errors import SceneError, UsageError
from zoobench.sim import runtime
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import BodyState, Solver


@pytest.mark.parametrize(("precision", "tolerance"), [(64, 1e-10), (32, 1e-4)])
def test_free_fall_follows_the_exact_discrete_solution(precision: int, tolerance: float) -> None:
    """A thrown body takes y_n = y_0 + v n dt - g dt^2 n (n + 1) / 2, every particle alike."""
    start = np.array([0.1, 1.5, -0.1])
    scene = Scene(scenes.thrown_body(start), (0, 0, 0), scenes.ARENA)
    solver = Solver(scene, scenes.steady(scene, precision))
    rollout = solver.run(np.zeros((35, 1, scenes.MUSCLES)))
    assert not rollout.divergences
    exact = scenes.thrown(solver, start, 35)
    moved = (rollout.positions - scene.robot.positions)[:, 0]
    centre = moved.mean(1)
    scale = np.abs(exact).max()
    assert np.abs(centre - exact).max() <= tolerance * scale
    assert np.abs(moved - centre[:, None]).max() <= tolerance * scale


def test_momentum_and_angular_momentum_are_conserved() -> None:
    """A spinning, actuated body without gravity and contact keeps both over 500 substeps."""
    spin = np.array([[0.0, -4.0, 1.0], [4.0, 0.0, -2.0], [-1.0, 2.0, 0.0]])
    scene = scenes.weightless(scenes.thrown_body(np.array([0.1, 0.15, -0.05]), spin))
    solver = Solver(scene, scenes.steady(scene))
    frames = 500 // solver.substeps_per_frame
    assert frames * solver.substeps_per_frame == 500
    solver.simulation.set_body(BodyState().filled(scene, 1))
    linear, angular = scenes.momenta(solver)
    rollout = solver.run(scenes.actuation(solver, frames))
    assert not rollout.divergences
    linear_end, angular_end = scenes.momenta(solver)
    assert np.ptp(np.linalg.norm(rollout.positions[-1, 0] - rollout.positions[-1, 0].mean(0), axis=1)) > 0.02
    assert np.abs(linear_end - linear).max() <= 1e-12 * np.linalg.norm(linear)
    assert np.abs(angular_end - angular).max() <= 1e-8 * np.linalg.norm(angular)


@pytest.mark.parametrize("activation", [-0.3, 0.3])
def test_muscle_reaches_its_equilibrium_stretch(activation: float) -> None:
    """A slowly activated block takes the stretch at which passive and active stress cancel (validation case V16)."""
    expected = {-0.3: (1.6898, 0.8941), 0.3: (0.7969, 1.0452)}[activation]
    strong = replace(scenes.SOFT, muscle_strength=0.3 * scenes.SOFT.youngs_modulus)
    cube = scenes.muscle_body(cells=4)
    body = ElasticBody.passive(strong, cube.positions, cube.volumes)
    body = replace(body, muscle_membership=np.ones((body.particle_count, 1)))
    solver = Solver(scenes.weightless(body), scenes.fidelity())
    ramp, hold = 200, 50
    level = np.concatenate([0.5 - 0.5 * np.cos(np.pi * np.arange(ramp) / ramp), np.ones(hold)])
    rollout = solver.run(np.sign(activation) * level[:, None, None])
    assert not rollout.divergences
    stretch = (np.ptp(rollout.positions[-hold:, 0], axis=1) / np.ptp(body.positions, axis=0)).mean(0)
    assert stretch == pytest.approx([expected[0], expected[1], expected[1]], rel=5e-3)


def test_deformation_follows_the_new_velocity_gradient() -> None:
    """After one substep from rest F = I + dt C with the new C; with the old one F would run a step ahead of x."""
    scene = scenes.flight_scene(moving=False)
    solver = Solver(scene, scenes.steady(scene, frame_seconds=1e-3), frame_seconds=1e-3)
    assert solver.substeps_per_frame == 1
    solver.run(scenes.actuation(solver, 1))
    F, C = solver.matter.F[0, 0].numpy(), solver.matter.C[0, 0].numpy()
    assert np.abs(C).max() > 0.1
    assert np.abs(F - np.eye(3) - solver.dt * C).max() <= 1e-15


@pytest.fixture(scope="module")
def bodies() -> BodyState:
    """Three worlds that differ in every array."""
    made = [scenes.muscle_body((0.3, 0.0, 0.3), seed=seed) for seed in (1, 5, 6)]
    return BodyState(**{name: np.stack([getattr(body, name) for body in made]) for name in scenes.BODY_GROUPS})


def _wild(bodies: BodyState) -> BodyState:
    """The same, but the muscles of world 1 are so strong that it diverges."""
    assert bodies.muscle_membership is not None
    membership = bodies.muscle_membership.copy()
    membership[1] *= 1e6
    return replace(bodies, muscle_membership=membership)


Episode = tuple[Solver, Rollout, Gradient]


@pytest.fixture(scope="module")
def batch(bodies: BodyState) -> Episode:
    """The three worlds side by side on the ground."""
    return scenes.episode(scenes.ground_scene(), 4, body=bodies, worlds=3, density_ratio_min=0.5)


def _agree(one: Gradient, world: int, other: Gradient, place: int) -> bool:
    """Whether two worlds have the same gradient, bit for bit."""
    groups = [(getattr(one, name)[world], getattr(other, name)[place]) for name in scenes.BODY_GROUPS]
    groups.append((one.actuation[:, world], other.actuation[:, place]))
    return all(np.array_equal(a, b) for a, b in groups)


def test_world_of_a_batch_equals_the_same_world_alone(bodies: BodyState, batch: Episode) -> None:
    """Path and gradient of each of three worlds agree bit for bit with a solver of one world."""
    solver, together, gradient = batch
    actuation, weights = scenes.actuation(solver, 4), scenes.path_weights(solver, 4)
    alone = Solver(scenes.ground_scene(), scenes.fidelity(), gradients=True, density_ratio_min=0.5)
    for world in range(3):
        pick = slice(world, world + 1)
        body = BodyState(**{name: getattr(bodies, name)[pick] for name in scenes.BODY_GROUPS})
        single = alone.run(actuation[:, pick], body)
        assert np.array_equal(single.positions, together.positions[:, pick])
        assert np.array_equal(single.velocities, together.velocities[:, pick])
        assert _agree(alone.backward(single, weights[0][:, pick], weights[1][:, pick]), 0, gradient, world)
    assert not np.array_equal(together.positions[:, 0], together.positions[:, 1])


def test_diverging_world_leaves_its_neighbours_alone(bodies: BodyState, batch: Episode) -> None:
    """Neighbours of a world that diverges keep trajectory and gradient bit for bit; its own gradient is zero."""
    solver, healthy, expected = batch
    wild = solver.run(scenes.actuation(solver, 4), _wild(bodies))
    gradient = solver.backward(wild, *scenes.path_weights(solver, 4))
    assert set(wild.divergences) == {1}
    for world in (0, 2):
        assert np.array_equal(wild.positions[:, world], healthy.positions[:, world])
        assert _agree(gradient, world, expected, world)
    assert not gradient.actuation[:, 1].any()
    assert not any(getattr(gradient, name)[1].any() for name in scenes.BODY_GROUPS)


def test_meter_counts_the_substeps_of_living_worlds(bodies: BodyState) -> None:
    """Forward and backward world-substeps are counted, those of a dead world are not."""
    scene, frames = scenes.ground_scene(), 4
    steady = scenes.steady(scene, density_ratio_min=0.5)
    solver, rollout, _ = scenes.episode(scene, frames, steady, _wild(bodies), worlds=3, density_ratio_min=0.5)
    n = solver.substeps_per_frame
    dead_after = rollout.divergences[1].frame + 1
    assert solver.meter.forward == (2 * frames + dead_after) * n
    assert solver.meter.backward == 2 * frames * n
    assert solver.meter.recomputed == 0


def test_body_state_overrides_the_scene() -> None:
    """Mass and volume follow occupancy and density ratio of the body given; arrays not given are the scene's."""
    scene = scenes.flight_scene()
    robot = scene.robot
    solver = Solver(scene, scenes.fidelity())
    occupancy = np.full((1, robot.particle_count), 0.25)
    rollout = solver.run(np.zeros((1, 1, scenes.MUSCLES)), BodyState(occupancy=occupancy))
    assert np.allclose(solver.parameters.volume[0].numpy(), 0.25 * robot.volumes, rtol=1e-14)
    expected = 0.25 * robot.volumes * robot.density_ratio * 1000.0
    assert np.allclose(solver.parameters.mass[0].numpy(), expected, rtol=1e-14)
    assert np.array_equal(rollout.body["stiffness"][0], robot.stiffness)


def test_progress_reports_every_frame() -> None:
    """The callback gets the number of frames done."""
    solver = Solver(scenes.flight_scene(), scenes.fidelity())
    seen: list[int] = []
    solver.run(np.zeros((3, 1, scenes.MUSCLES)), progress=seen.append)
    assert seen == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("actuation", "complaint"),
    [
        (np.zeros((2, 1, 2)), "shape"),
        (np.zeros((2, 2, 3)), "shape"),
        (np.zeros((0, 1, 3)), "shape"),
        (np.zeros((2, 3)), "shape"),
        (np.full((2, 1, 3), 1.01), r"outside \[-1, 1\]"),
        (np.full((2, 1, 3), np.nan), "not finite"),
    ],
)
def test_unusable_actuation_is_refused(actuation: np.ndarray, complaint: str) -> None:
    """Actuation of another shape, out of range or not finite is a usage error."""
    solver = Solver(scenes.flight_scene(), scenes.fidelity())
    with pytest.raises(UsageError, match=complaint):
        solver.run(actuation)


@pytest.mark.parametrize(
    ("name", "value", "complaint"),
    [
        ("stiffness", np.ones((2, 216)), "stiffness have shape"),
        ("stiffness", 1.5, "stiffness range"),
        ("stiffness", np.nan, "stiffness range"),
        ("density_ratio", 0.1, "density_ratio range"),
        ("occupancy", -0.1, "occupancy range"),
        ("occupancy", 1.1, "occupancy range"),
        ("occupancy", 0.0, "empty"),
        ("fibres", np.inf, "fibres range"),
        ("muscle_membership", np.nan, "muscle_membership range"),
    ],
)
def test_unusable_body_is_refused(name: str, value: float | Array, complaint: str) -> None:
    """An array for other worlds, or outside the bounds declared for the solver, is refused before anything runs."""
    scene = scenes.flight_scene()
    solver = Solver(scene, scenes.fidelity())
    array = value if isinstance(value, np.ndarray) else np.full_like(getattr(scene.robot, name), value)[None]
    with pytest.raises((UsageError, SceneError), match=complaint):
        solver.run(np.zeros((1, 1, scenes.MUSCLES)), BodyState(**{name: array}))


def test_what_a_solver_was_not_made_for_is_refused() -> None:
    """No world, and a backward pass without gradients."""
    with pytest.raises(UsageError, match="0 worlds"):
        Solver(scenes.flight_scene(), scenes.fidelity(), worlds=0)
    solver = Solver(scenes.flight_scene(), scenes.fidelity())
    rollout = solver.run(np.zeros((1, 1, scenes.MUSCLES)))
    with pytest.raises(UsageError, match="gradients=True"):
        solver.backward(rollout, *scenes.path_weights(solver, 1))


def test_solver_of_an_ended_runtime_is_refused() -> None:
    """A solver whose runtime was restarted with another precision must not touch its kernels."""
    solver = Solver(scenes.flight_scene(), scenes.fidelity(64))
    runtime.start(32)
    with pytest.raises(UsageError, match="Make a new solver"):
        solver.run(np.zeros((1, 1, scenes.MUSCLES)))
