"""Gradients through episodes against central differences in float64, checkpointing and degenerate states."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Gradient
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import BodyState, Solver

BODY_GROUPS = ("stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres")
GROUPS = ("actuation", *BODY_GROUPS)


class Probe:
    """A random linear functional of the trajectory as a function of all parameters, with its gradient."""

    def __init__(
        self, scene: Scene, frames: int, frame_seconds: float = 0.008, fidelity: Fidelity | None = None
    ) -> None:
        self.solver = Solver(
            scene,
            fidelity or scenes.fidelity(),
            gradients=True,
            stiffness_max=1.0,
            density_ratio_min=0.5,
            frame_seconds=frame_seconds,
        )
        self.weights = scenes.path_weights(self.solver, frames)
        self.base = {name: getattr(scene.robot, name)[None] for name in BODY_GROUPS}
        self.base["actuation"] = scenes.actuation(self.solver, frames)
        self.schedule: np.ndarray | None = None

    def _run(self, values: dict[str, np.ndarray]) -> float:
        body = BodyState(**{name: values[name] for name in BODY_GROUPS})
        # a difference quotient keeps to the steps of the base point
        self.rollout = self.solver.run(values["actuation"], body, schedule=self.schedule)
        assert not self.rollout.divergences
        self.schedule = self.rollout.counts
        a, b = self.weights
        # differences from the start keep the round-off of the sum small
        moved = self.rollout.positions - self.rollout.positions[:1]
        return float((moved * a).sum() + (self.rollout.velocities * b).sum())

    def gradient(self) -> Gradient:
        """The adjoint's answer at the base point."""
        self._run(self.base)
        return self.solver.backward(self.rollout, *self.weights)

    def at(self, name: str, direction: np.ndarray, distance: float) -> float:
        """The functional at a distance along a direction of one group."""
        return self._run(self.base | {name: self.base[name] + distance * direction})

    def difference(self, name: str, direction: np.ndarray, distance: float) -> float:
        """Its central difference."""
        return (self.at(name, direction, distance) - self.at(name, direction, -distance)) / (2 * distance)


def _error(probe: Probe, gradient: Gradient, name: str, direction: np.ndarray) -> float:
    """Best relative error over the distances: round-off grows below the best one, curvature above it."""
    exact = float((getattr(gradient, name) * direction).sum())
    found = []
    for distance in (1e-4, 1e-5, 1e-6):
        difference = probe.difference(name, direction, distance)
        found.append(abs(difference - exact) / abs(difference))
    return min(found)


# name of the scene, tolerance, frames, least number of substeps, directions
EPISODES = [
    ("flight", 1e-6, 34, 100, 3),
    ("ground", 1e-4, 34, 100, 3),
    ("damped", 1e-4, 9, 36, 1),
    ("sand", 1e-4, 20, 100, 3),
    ("clay", 1e-4, 8, 36, 1),
    ("mud", 1e-4, 7, 36, 1),
    ("snow", 1e-4, 3, 36, 1),
    ("water", 1e-4, 4, 36, 1),
]

DEAR = ("clay", "mud", "snow")
"""Media whose kernels take long to compile; the conformance suite checks their environments' gradients in any case."""


def _marks(name: str) -> tuple[pytest.MarkDecorator, ...]:
    return (pytest.mark.slow,) if name in DEAR else ()


@pytest.fixture(
    scope="module", params=[pytest.param(episode, id=episode[0], marks=_marks(episode[0])) for episode in EPISODES]
)
def probed(request: pytest.FixtureRequest) -> tuple[Probe, Gradient, float, int]:
    """A scene over many substeps, its gradient, the tolerance and how many directions to try."""
    name, tolerance, frames, substeps, directions = request.param
    probe = Probe(scenes.SCENES[name](), frames)
    gradient = probe.gradient()
    assert probe.rollout.substeps >= substeps
    return probe, gradient, tolerance, directions


@pytest.mark.parametrize("name", GROUPS)
def test_directional_derivative_matches_central_differences(
    probed: tuple[Probe, Gradient, float, int], name: str
) -> None:
    """In three random directions of each parameter group, or in one."""
    probe, gradient, tolerance, directions = probed
    rng = np.random.default_rng(7)
    for _ in range(directions):
        # within +-1, so that the largest distance stays inside the bounds of the group
        direction = rng.uniform(-1.0, 1.0, probe.base[name].shape)
        assert _error(probe, gradient, name, direction) <= tolerance


def _resting() -> Probe:
    """One substep from rest, F = I, some particles absent."""
    scene = scenes.flight_scene(moving=False)
    occupancy = scene.robot.occupancy.copy()
    occupancy[::7] = 0.0
    probe = Probe(replace(scene, robot=replace(scene.robot, occupancy=occupancy)), 1, frame_seconds=1e-3)
    assert probe.solver.substeps_per_frame == 1
    return probe


@pytest.mark.parametrize("name", GROUPS)
def test_gradient_is_right_at_rest(name: str) -> None:
    """From F = I every group's gradient is finite and that of the difference quotient, absent particles included."""
    probe = _resting()
    gradient = probe.gradient()
    assert all(np.isfinite(getattr(gradient, group)).all() for group in GROUPS)
    direction = np.random.default_rng(8).uniform(-1.0, 1.0, probe.base[name].shape)
    if name == "occupancy":  # an absent particle cannot become less than absent
        direction[probe.base[name] == 0.0] = 0.0
    exact = (getattr(gradient, name) * direction).sum()
    difference = probe.difference(name, direction, 1e-3)
    # neo-Hookean stress is zero at rest, and so is the derivative by the stiffness
    assert exact == pytest.approx(difference, rel=1e-6, abs=1e-13)
    assert (name == "stiffness") == (abs(difference) < 1e-13)


def test_gradient_by_the_occupancy_of_an_absent_particle() -> None:
    """An absent particle amid the body gets the one-sided derivative of becoming present."""
    scene = scenes.flight_scene(moving=True)
    robot = scene.robot
    middle = int(np.argmin(np.linalg.norm(robot.positions - robot.positions.mean(0), axis=1)))
    occupancy = robot.occupancy.copy()
    occupancy[middle] = 0.0
    probe = Probe(replace(scene, robot=replace(robot, occupancy=occupancy)), 4)
    exact = probe.gradient().occupancy[0, middle]
    direction = np.zeros((1, robot.particle_count))
    direction[0, middle] = 1.0
    e = 1e-4
    here, near, far = (probe.at("occupancy", direction, k * e) for k in (0, 1, 2))
    assert exact == pytest.approx((4 * near - far - 3 * here) / (2 * e), rel=1e-5)


FRAMES = 6


def _gradient_with(scene: Scene, interval: int | None, precision: int = 64, backwards: int = 1) -> list[Gradient]:
    solver = Solver(scene, scenes.fidelity(precision), gradients=True, checkpoint_interval=interval)
    rollout = solver.run(scenes.actuation(solver, FRAMES))
    return [solver.backward(rollout, *scenes.path_weights(solver, FRAMES)) for _ in range(backwards)]


def _same(a: Gradient, b: Gradient) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in GROUPS)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=_marks(name)) for name in ("ground", "sand", "clay", "mud", "snow", "water")]
)
def test_checkpointed_gradient_is_the_full_memory_gradient(name: str) -> None:
    """Bit for bit at every interval of frames, divisors of the episode or not, the default one included."""
    scene = scenes.SCENES[name]()
    (full,) = _gradient_with(scene, FRAMES)
    assert full.actuation.any()
    for interval in (1, 2, 4, 5, None):
        (gradient,) = _gradient_with(scene, interval)
        assert _same(gradient, full), interval


def test_second_backward_repeats_the_first() -> None:
    """Nothing of an earlier backward pass is left in the later one."""
    first, second = _gradient_with(scenes.ground_scene(), None, backwards=2)
    assert _same(first, second)


def test_zero_path_adjoint_gives_zero_gradient() -> None:
    """A loss that does not depend on the trajectory has no gradient."""
    solver = Solver(scenes.ground_scene(), scenes.fidelity(), gradients=True)
    rollout = solver.run(scenes.actuation(solver, 2))
    nothing = np.zeros_like(rollout.positions)
    gradient = solver.backward(rollout, nothing, nothing)
    assert not any(getattr(gradient, name).any() for name in GROUPS)


def test_memory_budget_chooses_an_interval_that_fits() -> None:
    """Checkpoints and the recomputed segment stay within the budget, and the gradient is that of full memory."""
    scene = scenes.ground_scene()
    (full,) = _gradient_with(scene, 10**6)
    size = Solver(scene, scenes.fidelity()).matter.bytes_per_slot()
    declared = Solver(scene, scenes.fidelity()).substeps_per_frame
    for frames in (1, 2, 4):
        states = frames * declared + 1 + -(-FRAMES // frames)
        solver = Solver(scene, scenes.fidelity(), gradients=True, memory_budget=states * size)
        rollout = solver.run(scenes.actuation(solver, FRAMES))
        assert rollout.interval == frames
        assert rollout.interval * rollout.counts.max() + 1 + len(rollout.checkpoints) <= states
        assert _same(solver.backward(rollout, *scenes.path_weights(solver, FRAMES)), full)


def test_memory_budget_too_small_is_refused() -> None:
    """The message states the number of states needed and the number that fits."""
    scene = scenes.ground_scene()
    size = Solver(scene, scenes.fidelity()).matter.bytes_per_slot()
    solver = Solver(scene, scenes.fidelity(), gradients=True, memory_budget=5 * size)
    with pytest.raises(UsageError, match=rf"states of {size} bytes; the memory budget holds 5\. Give more memory"):
        solver.run(scenes.actuation(solver, FRAMES))


def test_frictionless_floor_gives_no_thrust() -> None:
    """Zero control: no actuation moves the centre of mass along a floor without friction."""
    scene = replace(scenes.ground_scene(friction=0.0), gravity=(0.0, -9.81, 0.0))
    solver = Solver(scene, scenes.fidelity(), gradients=True)
    rollout = solver.run(scenes.actuation(solver, 20))
    mass = solver.parameters.mass[0].numpy()
    adjoint = np.zeros_like(rollout.positions)
    adjoint[-1, 0, :, 0] = mass / mass.sum()
    along = solver.backward(rollout, adjoint, np.zeros_like(adjoint)).actuation
    adjoint = np.roll(adjoint, 1, axis=-1)
    upwards = solver.backward(rollout, adjoint, np.zeros_like(adjoint)).actuation
    assert np.abs(along).max() <= 1e-12
    assert np.abs(upwards).max() > 1e-6


def test_friction_gives_thrust() -> None:
    """The same derivative is not zero on a floor with friction."""
    solver = Solver(scenes.ground_scene(), scenes.fidelity(), gradients=True)
    rollout = solver.run(scenes.actuation(solver, 20))
    adjoint = np.zeros_like(rollout.positions)
    adjoint[-1, 0, :, 0] = 1.0 / solver.robot_count
    assert np.abs(solver.backward(rollout, adjoint, np.zeros_like(adjoint)).actuation).max() > 1e-6


@pytest.mark.parametrize(
    "name", ["ground", "sand", *(pytest.param(name, marks=pytest.mark.slow) for name in (*DEAR, "water"))]
)
def test_float32_gradient_agrees_with_float64(name: str) -> None:
    """To 1e-3 of the norm in every group."""
    (double,) = _gradient_with(scenes.SCENES[name](), None)
    (single,) = _gradient_with(scenes.SCENES[name](), None, precision=32)
    for group in GROUPS:
        expected = getattr(double, group)
        assert np.linalg.norm(getattr(single, group) - expected) <= 1e-3 * np.linalg.norm(expected), group
