"""Gradients: against difference quotients, against closed forms, and of one precision or storage against the other.

All but the last case differentiate the distance that a cube of muscle in four bundles crawls on the ground.
"""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.matter import ElasticMaterial
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.state import IntArray
from zoobench.sim.solver import Solver
from zoobench.verify.validate.base import Case, Check, Figure, Outcome, Role, curve
from zoobench.verify.validate.stage import lattice, passive_body
from zoobench.verify.validate.statics import muscle_scene, muscle_stretch

_SPACING = 1 / 32
_CELLS = 4
_FRAMES = 120
_MUSCLES = 4
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
    return Solver(scene, fidelity, gradients=True, checkpoint_interval=interval)


def _actuation() -> Array:
    """A gait `[frames, 1, muscles]`: sines of different phase."""
    t = np.arange(_FRAMES)[:, None, None] / _FRAMES
    result: Array = 0.6 * np.sin(2 * np.pi * (8 * t + np.arange(_MUSCLES) / _MUSCLES))
    return result


class _Distance:
    """How far the centre of mass moves along x, as a function of the actuation, with the steps of the first run."""

    def __init__(self, solver: Solver, schedule: IntArray | None = None) -> None:
        self.solver = solver
        self.rollout = solver.run(_actuation(), schedule=schedule)
        mass = solver.parameters.mass[0].double().numpy()
        self._weights = mass / mass.sum()

    @property
    def value(self) -> float:
        """At the gait itself [m]."""
        return self._of(self.rollout)

    def _of(self, rollout: Rollout) -> float:
        moved = (rollout.positions[-1, 0] - rollout.positions[0, 0])[:, 0]
        return float(self._weights @ moved)

    def at(self, change: Array) -> float:
        """At the gait plus a change `[frames, 1, muscles]` [m]."""
        return self._of(self.solver.run(_actuation() + change, schedule=self.rollout.counts))

    def gradient(self) -> Array:
        """By the actuation `[frames, 1, muscles]` [m]."""
        pull = np.zeros(self.rollout.positions.shape)
        pull[-1, 0, :, 0] = self._weights
        return self.solver.backward(self.rollout, pull, 0 * pull).actuation


def _direction(muscle: int | None = None) -> Array:
    """A random direction of the actuation, of size 1 in its largest component; of one muscle only if given."""
    direction = np.random.default_rng(7).normal(size=(_FRAMES, 1, _MUSCLES))
    if muscle is not None:
        direction *= np.eye(_MUSCLES)[muscle]
    result: Array = direction / np.abs(direction).max()
    return result


_WIDTHS = np.array([1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8])


def _differences() -> Outcome:
    distance = _Distance(_crawler(0.5))
    gradient, direction = distance.gradient(), _direction()
    exact = float((gradient * direction).sum())
    errors = np.array([abs(_quotient(distance, direction, width) / exact - 1) for width in _WIDTHS])
    best = float(_WIDTHS[errors.argmin()])
    own = [_direction(muscle) for muscle in range(_MUSCLES)]
    slopes = np.array([(gradient * way).sum() for way in own])
    quotients = np.array([_quotient(distance, way, best) for way in own])
    cosine = float(slopes @ quotients / np.linalg.norm(slopes) / np.linalg.norm(quotients))
    return Outcome(
        (
            Check("smallest relative error of the directional derivative over widths", float(errors.min()),
                  at_most=1e-6),
            Check("1 - cosine of the gradient by four muscles and the quotients", 1 - cosine, at_most=1e-10),
        ),
        Figure(
            f"Gradient against central differences, {distance.rollout.substeps} substeps", "width of the quotient [-]",
            "relative error [-]",
            (curve("adjoint against quotient", Role.COMPUTED, _WIDTHS, errors),
             curve("bound", Role.REFERENCE, _WIDTHS[[0, -1]], np.full(2, 1e-6))),
            log_x=True, log_y=True,
        ),
    )  # fmt: skip


def _quotient(distance: _Distance, direction: Array, width: float) -> float:
    return (distance.at(width * direction) - distance.at(-width * direction)) / (2 * width)


def _taylor() -> Outcome:
    """J(a + w d) - J(a) - w J' d is of second order in w as long as no node changes between sticking and sliding.

    The first that does, does so between w = 4e-4 and 1e-3; beyond, the distance has kinks.
    """
    distance = _Distance(_crawler(0.5))
    direction = _direction()
    slope = float((distance.gradient() * direction).sum())
    widths = np.geomspace(1e-6, 1e-4, 7)
    left = np.array([abs(distance.at(width * direction) - distance.value - width * slope) for width in widths])
    order = float(np.polyfit(np.log(widths), np.log(left), 1)[0])
    return Outcome(
        (Check("order of the remainder of first order", order, at_least=1.9, at_most=2.1),),
        Figure(
            f"Taylor's remainder, {distance.rollout.substeps} substeps", "width [-]", "remainder [m]",
            (curve("|J(a + w d) - J(a) - w J' d|", Role.COMPUTED, widths, left, points=True),
             curve("slope 2", Role.REFERENCE, widths, left[-1] * (widths / widths[-1]) ** 2)),
            log_x=True, log_y=True,
        ),
    )  # fmt: skip


def _frictionless() -> Outcome:
    """Without friction no force along the ground acts on the body: its centre stays, whatever its muscles do."""
    smooth, rough = (_Distance(_crawler(friction)) for friction in (0.0, 0.5))
    found, scale = smooth.gradient(), np.abs(rough.gradient()).max()
    size = np.abs(found).max((1, 2)) / scale
    frames = np.arange(_FRAMES)
    return Outcome(
        (
            Check("largest derivative over that with friction 0.5", float(size.max()), at_most=1e-10),
            Check("distance over that with friction 0.5", abs(smooth.value / rough.value), at_most=1e-10),
        ),
        Figure(
            "Derivative of the distance by the actuation", "control frame", "over its largest with friction 0.5 [-]",
            (curve("without friction", Role.COMPUTED, frames, np.maximum(size, 1e-20)),
             curve("friction 0.5", Role.COMPUTED, frames, np.abs(rough.gradient()).max((1, 2)) / scale),
             curve("bound", Role.REFERENCE, frames[[0, -1]], np.full(2, 1e-10))),
            log_y=True,
        ),
    )  # fmt: skip


def _single() -> Outcome:
    double = _Distance(_crawler(0.5))
    schedule, exact = double.rollout.counts, double.gradient()
    found = _Distance(_crawler(0.5, precision=32), schedule).gradient()
    frames = np.arange(_FRAMES)
    return Outcome(
        (
            Check("error of the float32 gradient, relative to the norm",
                  float(np.linalg.norm(found - exact) / np.linalg.norm(exact)), at_most=1e-4),
        ),
        Figure(
            "Derivative of the distance by the first muscle", "control frame", "derivative [m]",
            (curve("float32", Role.COMPUTED, frames, found[:, 0, 0], points=True),
             curve("float64", Role.REFERENCE, frames, exact[:, 0, 0])),
        ),
    )  # fmt: skip


_INTERVALS = (1, 3, 7, _FRAMES)


def _checkpoints() -> Outcome:
    """Recomputing from checkpoints repeats the same arithmetic, and a second reverse pass starts afresh."""
    runs = [_Distance(_crawler(0.5, interval=interval)) for interval in _INTERVALS]
    gradients = [run.gradient() for run in runs]
    again = runs[1].gradient()
    largest = max(float(np.abs(found - gradients[-1]).max()) for found in [*gradients, again])
    frames = np.arange(_FRAMES)
    return Outcome(
        (
            Check("largest difference between intervals of 1, 3, 7 and all frames, and a second pass", largest,
                  "m", at_most=0.0),
            Check("gradient itself, largest component", float(np.abs(gradients[-1]).max()), "m", at_least=1e-6),
        ),
        Figure(
            "Gradient by checkpoint interval, first muscle", "control frame", "derivative [m]",
            (*(curve(f"every {n} frames", Role.COMPUTED, frames, found[:, 0, 0], points=True)
               for n, found in zip(_INTERVALS[:-1], gradients, strict=False)),
             curve("one segment", Role.REFERENCE, frames, gradients[-1][:, 0, 0])),
        ),
    )  # fmt: skip


def _stretch_slope(activation: float) -> tuple[float, float]:
    """Stretch along the fibre of the block of `muscle_scene` and its derivative by the activation.

    The activation rises slowly to its value and is held, without drag; the stretch is the mean over the hold, and the
    derivative that by the height of the whole curve.
    """
    ramp, hold = 200, 50
    level = np.concatenate([0.5 - 0.5 * np.cos(np.pi * np.arange(ramp) / ramp), np.ones(hold)])[:, None, None]
    scene = muscle_scene(1 / 32, 4)
    solver = Solver(scene, Fidelity(1 / 32, precision=64), gradients=True)
    rollout = solver.run(activation * level)
    rest = scene.robot.positions[:, 0] - scene.robot.positions[:, 0].mean()
    weights = rest / (rest @ rest)  # slope of the positions over the rest positions
    stretch = float((rollout.positions[-hold:, 0, :, 0] @ weights).mean())
    pull = np.zeros(rollout.positions.shape)
    pull[-hold:, 0, :, 0] = weights / hold
    gradient = solver.backward(rollout, pull, 0 * pull).actuation
    return stretch, float((gradient * level).sum())


def _muscle_slope() -> Outcome:
    """The slope of the equilibrium curve, from the whole history of a slow contraction."""
    levels = np.array([-0.6, 0.3, 0.9])
    found = np.array([_stretch_slope(level)[1] for level in levels])
    fine = np.linspace(-0.8, 1.0, 91)
    exact = _equilibrium_slope(levels)
    return Outcome(
        (Check("derivative of the stretch by the activation, relative error", float(np.abs(found / exact - 1).max()),
               at_most=1e-3),),
        Figure(
            "Slope of a free muscle's stretch", "activation [-]", "derivative of the stretch by the activation [-]",
            (curve("adjoint", Role.COMPUTED, levels, found, points=True),
             curve("closed form", Role.REFERENCE, fine, _equilibrium_slope(fine))),
        ),
    )  # fmt: skip


def _equilibrium_slope(activations: Array) -> Array:
    """Derivative of the equilibrium stretch by the activation, by central differences of the closed form."""
    step = 1e-5
    rise = [muscle_stretch(float(a) + step)[0] - muscle_stretch(float(a) - step)[0] for a in activations]
    result: Array = np.array(rise) / (2 * step)
    return result


_GRID = "cube of 4³ cells on the ground, 120 frames"
CASES = [
    Case("gradient-differences", "central differences of the forward run", _GRID, _differences),
    Case("gradient-taylor", "Taylor's theorem: the remainder is of second order", _GRID, _taylor),
    Case("gradient-frictionless", "Newton: no force along the ground, no motion of the centre", _GRID, _frictionless),
    Case("gradient-muscle", "slope of the closed form of the free active block", "block of 4³ cells, 250 frames",
         _muscle_slope),
    Case("gradient-checkpoints", "the same arithmetic without checkpoints", _GRID, _checkpoints),
    Case("gradient-single", "the gradient in float64", _GRID, _single, precision=0),
]  # fmt: skip
