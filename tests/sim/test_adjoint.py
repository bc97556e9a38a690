"""Gradients through episodes against central differences in float64, checkpointing and degenerate states."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import BodyState, Solver

BODY_GROUPS, GROUPS = scenes.BODY_GROUPS, scenes.GROUPS


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
        self.replay: Rollout | None = None

    def _run(self, values: dict[str, np.ndarray]) -> float:
        body = BodyState(**{name: values[name] for name in BODY_GROUPS})
        # a difference quotient keeps to the steps of the base point
        self.rollout = self.solver.run(values["actuation"], body, replay=self.replay)
        assert not self.rollout.divergences
        self.replay = self.rollout
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

    def error(
        self, gradient: Gradient, name: str, direction: np.ndarray, enough: float, largest: float = 1e-4
    ) -> float:
        """Best relative error over three distances, of which the next is tried only if that of the last is not enough.

        Round-off grows below the best distance, curvature above it.
        """
        exact = float((getattr(gradient, name) * direction).sum())
        errors: list[float] = []
        for distance in (largest, largest / 10, largest / 100):
            difference = self.difference(name, direction, distance)
            errors.append(abs(difference - exact) / abs(difference))
            if errors[-1] <= enough:
                break
        return min(errors)


# name of the scene, tolerance, frames, least number of substeps
EPISODES = [
    ("flight", 1e-6, 34, 100),
    ("ground", 1e-4, 34, 100),
    ("damped", 1e-4, 9, 36),
    ("sand", 1e-4, 20, 100),
    ("interface", 1e-4, 20, 100),
    ("clay", 1e-4, 8, 36),
    ("mud", 1e-4, 7, 36),
    ("snow", 1e-4, 3, 36),
    ("water", 1e-4, 4, 36),
    ("wading", 1e-4, 12, 36),
]

DEAR = ("interface", "clay", "mud", "snow", "water", "wading")
"""Scenes whose kernels take long to compile. The adjoints of their laws are checked alone in
`tests/sim/kernels/test_media_adjoint.py` and `test_drift.py`, sand has all that they have beside it, and the
conformance suite has robots of viscous matter, and one in the desert, whose velocity field is its own."""


def _marks(name: str) -> tuple[pytest.MarkDecorator, ...]:
    return (pytest.mark.slow,) if name in (*DEAR, "damped") else ()


@pytest.fixture(
    scope="module", params=[pytest.param(episode, marks=_marks(episode[0]), id=episode[0]) for episode in EPISODES]
)
def probed(request: pytest.FixtureRequest) -> tuple[Probe, Gradient, float]:
    """A scene over many substeps, its gradient and the tolerance."""
    name, tolerance, frames, substeps = request.param
    probe = Probe(scenes.SCENES[name](), frames)
    gradient = probe.gradient()
    assert probe.rollout.substeps >= substeps
    return probe, gradient, tolerance


@pytest.mark.parametrize("name", GROUPS)
def test_directional_derivative_matches_central_differences(probed: tuple[Probe, Gradient, float], name: str) -> None:
    """In a random direction of each parameter group, in which every entry has a part."""
    probe, gradient, tolerance = probed
    # within +-1, so that the largest distance stays inside the bounds of the group
    direction = np.random.default_rng(7).uniform(-1.0, 1.0, probe.base[name].shape)
    assert probe.error(gradient, name, direction, tolerance) <= tolerance


@pytest.fixture(scope="module")
def resting() -> tuple[Probe, Gradient]:
    """One substep from rest, F = I, some particles absent."""
    scene = scenes.flight_scene(moving=False)
    occupancy = scene.robot.occupancy.copy()
    occupancy[::7] = 0.0
    probe = Probe(replace(scene, robot=replace(scene.robot, occupancy=occupancy)), 1, frame_seconds=1e-3)
    assert probe.solver.substeps_per_frame == 1
    return probe, probe.gradient()


@pytest.mark.parametrize("name", GROUPS)
def test_gradient_is_right_at_rest(resting: tuple[Probe, Gradient], name: str) -> None:
    """From F = I every group's gradient is finite and that of the difference quotient, absent particles included."""
    probe, gradient = resting
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


def _gradient(name: str, interval: int | None = None, precision: int = 64) -> Gradient:
    return scenes.episode(scenes.SCENES[name](), FRAMES, scenes.fidelity(precision), checkpoint_interval=interval)[2]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=_marks(name)) for name in ("ground", "sand", "clay", "mud", "snow", "water")]
)
def test_checkpointed_gradient_is_the_full_memory_gradient(name: str) -> None:
    """Bit for bit at every interval of frames, divisors of the episode or not, the default one included."""
    full = _gradient(name, FRAMES)
    assert full.actuation.any()
    for interval in (1, 4, 5, None):
        assert scenes.same(_gradient(name, interval), full), interval


def test_second_backward_repeats_the_first() -> None:
    """Nothing of an earlier backward pass is left in the later one."""
    solver, rollout, first = scenes.episode(scenes.ground_scene(), FRAMES)
    assert scenes.same(solver.backward(rollout, *scenes.path_weights(solver, FRAMES)), first)


def test_zero_path_adjoint_gives_zero_gradient() -> None:
    """A loss that does not depend on the trajectory has no gradient."""
    solver, rollout, _ = scenes.episode(scenes.ground_scene(), 2)
    nothing = np.zeros_like(rollout.positions)
    gradient = solver.backward(rollout, nothing, nothing)
    assert not any(getattr(gradient, name).any() for name in GROUPS)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_thrust_needs_friction(friction: float) -> None:
    """No actuation moves the centre of mass along a floor without friction, but upwards; on one with friction, both."""
    scene = replace(scenes.ground_scene(friction), gravity=(0.0, -9.81, 0.0))
    solver, rollout, _ = scenes.episode(scene, 20)
    mass = solver.parameters.mass[0].numpy()
    adjoint = np.zeros_like(rollout.positions)
    adjoint[-1, 0, :, 0] = mass / mass.sum()
    along, upwards = (
        np.abs(solver.backward(rollout, np.roll(adjoint, axis, axis=-1), np.zeros_like(adjoint)).actuation).max()
        for axis in (0, 1)
    )
    assert upwards > 1e-6
    assert along > 1e-6 if friction else along <= 1e-12


@pytest.mark.parametrize(
    # sand has all that the ground has
    "name",
    ["ground", *(pytest.param(name, marks=pytest.mark.slow) for name in ("sand", "clay", "mud", "snow", "water"))],
)
def test_float32_gradient_agrees_with_float64(name: str) -> None:
    """To 1e-3 of the norm in every group."""
    double, single = _gradient(name), _gradient(name, precision=32)
    for group in GROUPS:
        expected = getattr(double, group)
        assert np.linalg.norm(getattr(single, group) - expected) <= 1e-3 * np.linalg.norm(expected), group
