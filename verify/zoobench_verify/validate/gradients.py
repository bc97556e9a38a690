"""Gradients against difference quotients and closed forms, and between precisions and checkpoint intervals.

All cases but that of the free muscle differentiate the distance that a cube with four muscles crawls on the ground.
"""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench.sim.solver import Solver
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import lattice, passive_body
from zoobench_verify.validate.statics import muscle_scene, muscle_stretch

_GRID = "cube of 4³ cells on the ground, 120 frames"

_SPACING = 1 / 32
_CELLS = 4
_FRAMES = 120
_MUSCLES = 4
_CRAWLED = 1e-3
"""Least distance of the gait, without which gradients are of a cube at rest [m]."""
_SOFT = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=3000.0)


def _crawler(friction: float, precision: int = 64, interval: int | None = None) -> Solver:
    """A cube on the ground whose four upright quarters have muscles in different directions."""
    h, size = _SPACING, _CELLS * _SPACING
    points = lattice((0.3, 0.0, 0.3), (0.3 + size, size, 0.3 + size), h / 2)
    side = (points[:, [0, 2]] > 0.3 + size / 2) @ [1, 2]
    slant = np.array([[2.0, 1.0, 0.0], [2.0, -1.0, 0.0], [1.0, 2.0, 1.0], [1.0, 2.0, -1.0]])
    body = replace(
        passive_body(_SOFT, points, h**3 / 8),
        muscle_membership=np.eye(_MUSCLES)[side],
        fibres=(slant / np.linalg.norm(slant, axis=1, keepdims=True))[side],
    )
    scene = Scene(body, (0, 0, 0), (0.75, 0.5, 0.75), ground=Ground(friction))
    fidelity = Fidelity(h, precision=64 if precision == 64 else 32)
    return Solver(standing(scene, scene.robot_edge(fidelity)), fidelity, gradients=True, checkpoint_interval=interval)


def _actuation() -> Array:
    """A gait `[frames, 1, muscles]`: sines of different phase."""
    t = np.arange(_FRAMES)[:, None, None] / _FRAMES
    return 0.6 * np.sin(2 * np.pi * (8 * t + np.arange(_MUSCLES) / _MUSCLES))


class _Distance:
    """The distance of the centre of mass along x as a function of the actuation, with the steps of the first run."""

    def __init__(self, solver: Solver, replay: Rollout | None = None) -> None:
        self.solver = solver
        self.rollout = solver.run(_actuation(), replay=replay)
        mass = solver.parameters.mass[0].double().numpy()
        self._weights = mass / mass.sum()

    @property
    def value(self) -> float:
        """For the gait itself [m]."""
        return self._of(self.rollout)

    def _of(self, rollout: Rollout) -> float:
        moved = (rollout.positions[-1, 0] - rollout.positions[0, 0])[:, 0]
        return float(self._weights @ moved)

    def at(self, change: Array) -> float:
        """For the gait plus a change `[frames, 1, muscles]` [m]."""
        return self._of(self.solver.run(_actuation() + change, replay=self.rollout))

    def gradient(self) -> Array:
        """Gradient by the actuation `[frames, 1, muscles]` [m]."""
        adjoint = np.zeros(self.rollout.positions.shape)
        adjoint[-1, 0, :, 0] = self._weights
        return self.solver.backward(self.rollout, adjoint, 0 * adjoint).actuation


def _direction(muscle: int | None = None) -> Array:
    """A random direction of the actuation with a largest component of 1; of a single muscle if given."""
    direction = np.random.default_rng(7).normal(size=(_FRAMES, 1, _MUSCLES))
    if muscle is not None:
        direction *= np.eye(_MUSCLES)[muscle]
    result: Array = direction / np.abs(direction).max()
    return result


_WIDTHS = np.array([1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8])


@case("gradient-differences", "central differences of the forward run", _GRID)
def differences(record: CaseRecorder) -> None:
    """Directional derivatives against central differences of several widths."""
    distance = _Distance(_crawler(0.5))
    gradient, direction = distance.gradient(), _direction()
    exact = float((gradient * direction).sum())
    errors = np.array([abs(_quotient(distance, direction, width) / exact - 1) for width in _WIDTHS])
    best = float(_WIDTHS[errors.argmin()])
    own = [_direction(muscle) for muscle in range(_MUSCLES)]
    derivatives = np.array([(gradient * way).sum() for way in own])
    quotients = np.array([_quotient(distance, way, best) for way in own])
    cosine = float(derivatives @ quotients / np.linalg.norm(derivatives) / np.linalg.norm(quotients))
    record.at_most("smallest relative error of the directional derivative over widths", errors.min(), 1e-6)
    record.at_most("1 - cosine of the gradient by four muscles and the quotients", 1 - cosine, 1e-10)
    figure = record.plot(
        f"Gradient against central differences, {distance.rollout.substeps} substeps",
        "width of the quotient [-]",
        "relative error [-]",
        log="xy",
    )
    figure.computed("adjoint against quotient", _WIDTHS, errors)
    figure.level("bound", _WIDTHS, 1e-6)


def _quotient(distance: _Distance, direction: Array, width: float) -> float:
    return (distance.at(width * direction) - distance.at(-width * direction)) / (2 * width)


@case("gradient-taylor", "Taylor's theorem: the remainder is of second order", _GRID)
def taylor(record: CaseRecorder) -> None:
    """J(a + w d) - J(a) - w J' d is of second order in w as long as no node changes between sticking and sliding.

    The first node does so beyond w = 1e-4 in this direction, and between 2e-5 and 5e-5 in the opposite one; there the
    distance is not differentiable. Below 3e-6 the remainder is that of rounding.
    """
    distance = _Distance(_crawler(0.5))
    direction = _direction()
    derivative = float((distance.gradient() * direction).sum())
    widths = np.geomspace(4e-6, 8e-5, 7)
    left = np.array([abs(distance.at(width * direction) - distance.value - width * derivative) for width in widths])
    order = float(np.polyfit(np.log(widths), np.log(left), 1)[0])
    record.within("order of the remainder of first order", order, 1.9, 2.1)
    figure = record.plot(
        f"Taylor's remainder, {distance.rollout.substeps} substeps", "width [-]", "remainder [m]", log="xy"
    )
    figure.computed("|J(a + w d) - J(a) - w J' d|", widths, left, points=True)
    figure.reference("slope 2", widths, left[-1] * (widths / widths[-1]) ** 2)


@case("gradient-frictionless", "Newton: no force along the ground, no motion of the centre", _GRID)
def frictionless(record: CaseRecorder) -> None:
    """Without friction no force along the ground acts on the body: its centre stays at any actuation."""
    smooth, rough = (_Distance(_crawler(friction)) for friction in (0.0, 0.5))
    found, scale = smooth.gradient(), np.abs(rough.gradient()).max()
    size = np.abs(found).max((1, 2)) / scale
    frames = np.arange(_FRAMES)
    record.at_most("largest derivative over that with friction 0.5", size.max(), 1e-10)
    record.at_most("distance over that with friction 0.5", abs(smooth.value / rough.value), 1e-10)
    figure = record.plot(
        "Derivative of the distance by the actuation",
        "control frame",
        "over its largest with friction 0.5 [-]",
        log="y",
    )
    figure.computed("without friction", frames, np.maximum(size, 1e-20))
    figure.computed("friction 0.5", frames, np.abs(rough.gradient()).max((1, 2)) / scale)
    figure.level("bound", frames, 1e-10)


@case("gradient-single", "the gradient in float64", _GRID, precision=0)
def single(record: CaseRecorder) -> None:
    """The gradient in float32 against that in float64."""
    double = _Distance(_crawler(0.5))
    exact = double.gradient()
    found = _Distance(_crawler(0.5, precision=32), double.rollout).gradient()
    frames = np.arange(_FRAMES)
    error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    record.at_most("error of the float32 gradient, relative to the norm", error, 1e-4)
    record.at_least("distance crawled", abs(double.value), _CRAWLED, "m")
    figure = record.plot("Derivative of the distance by the first muscle", "control frame", "derivative [m]")
    figure.computed("float32", frames, found[:, 0, 0], points=True)
    figure.reference("float64", frames, exact[:, 0, 0])


def _stretch_derivative(activation: float) -> float:
    """Derivative by the activation of the stretch along the fibre of the block of `muscle_scene`.

    The activation rises slowly to its value and is held, without drag; the stretch is the mean over the hold, and the
    derivative is by the height of the whole curve.
    """
    ramp, hold = 200, 50
    level = np.concatenate([0.5 - 0.5 * np.cos(np.pi * np.arange(ramp) / ramp), np.ones(hold)])[:, None, None]
    scene = muscle_scene(1 / 32, 4)
    solver = Solver(scene, Fidelity(1 / 32, precision=64), gradients=True)
    rollout = solver.run(activation * level)
    rest = scene.robot.positions[:, 0] - scene.robot.positions[:, 0].mean()
    weights = rest / (rest @ rest)  # slope of the positions over the rest positions
    adjoint = np.zeros(rollout.positions.shape)
    adjoint[-hold:, 0, :, 0] = weights / hold
    gradient = solver.backward(rollout, adjoint, 0 * adjoint).actuation
    return float((gradient * level).sum())


@case("gradient-muscle", "slope of the closed form of the free active block", "block of 4³ cells, 250 frames")
def free_muscle(record: CaseRecorder) -> None:
    """The derivative of the equilibrium curve, from the whole history of a slow contraction."""
    levels = np.array([-0.6, 0.3, 0.9])
    found = np.array([_stretch_derivative(level) for level in levels])
    fine = np.linspace(-0.8, 1.0, 91)
    exact = _equilibrium_derivative(levels)
    record.at_most("derivative of the stretch by the activation, relative error", np.abs(found / exact - 1).max(), 1e-3)
    figure = record.plot(
        "Slope of a free muscle's stretch", "activation [-]", "derivative of the stretch by the activation [-]"
    )
    figure.computed("adjoint", levels, found, points=True)
    figure.reference("closed form", fine, _equilibrium_derivative(fine))


def _equilibrium_derivative(activations: Array) -> Array:
    """Derivative of the equilibrium stretch by the activation, by central differences of the closed form."""
    step = 1e-5
    rise = [muscle_stretch(float(a) + step)[0] - muscle_stretch(float(a) - step)[0] for a in activations]
    return np.array(rise) / (2 * step)


_INTERVALS = (1, 3, 7, _FRAMES)


@case("gradient-checkpoints", "the same arithmetic without checkpoints", _GRID)
def checkpoints(record: CaseRecorder) -> None:
    """Recomputing from checkpoints repeats the same arithmetic, and a second reverse pass equals the first."""
    runs = [_Distance(_crawler(0.5, interval=interval)) for interval in _INTERVALS]
    gradients = [run.gradient() for run in runs]
    again = runs[1].gradient()
    largest = max(np.abs(found - gradients[-1]).max() for found in [*gradients, again])
    frames = np.arange(_FRAMES)
    words = "largest difference between intervals of 1, 3, 7 and all frames, and a second pass"
    record.at_most(words, largest, 0.0, "m")
    record.at_least("gradient itself, largest component", np.abs(gradients[-1]).max(), 1e-6, "m")
    record.at_least("distance crawled", abs(runs[0].value), _CRAWLED, "m")
    figure = record.plot("Gradient by checkpoint interval, first muscle", "control frame", "derivative [m]")
    for n, found in zip(_INTERVALS[:-1], gradients, strict=False):
        figure.computed(f"every {n} frames", frames, found[:, 0, 0], points=True)
    figure.reference("one segment", frames, gradients[-1][:, 0, 0])
