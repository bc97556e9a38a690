"""Sand: the angle at which a layer slides, and how far a column runs out when it is let go.

Both are plane strain: one cell between walls, whose nodes are all walls'.
"""

import math
from functools import partial

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.matter import SandMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.verify.validate.base import Case, Check, Curve, Figure, Outcome, Role, curve
from zoobench.verify.validate.stage import GRAVITY, Stage, bed, dust, lattice

_DENSITY = 1600.0
_ROUGH = 100.0
"""Friction of a floor on which sand never slips."""


def _sand(friction_angle: float, height: float) -> SandMaterial:
    """Sand stiff enough to sink by half a per cent or so under its own weight at a height [m]."""
    return SandMaterial(300 * _DENSITY * GRAVITY * height, 0.2, _DENSITY, friction_angle)


def _angle_of(tangent: float) -> float:
    """The friction angle phi [degrees] of a sand whose plane-strain friction coefficient 3 alpha / sqrt2 is given.

    With alpha = sqrt(2/3) 2 sin(phi) / (3 - sin(phi)) the coefficient is 2 sqrt3 sin(phi) / (3 - sin(phi)).
    """
    return math.degrees(math.asin(3 * tangent / (2 * math.sqrt(3) + tangent)))


def _pressed(material: SandMaterial, depth: Array) -> Array:
    """Hencky strains `[.., 3]` of sand under the isotropic pressure of its own weight at a depth [m]."""
    pressure = material.density * GRAVITY * depth
    result: Array = np.stack([-pressure / material.kappa] * 3, axis=-1)
    return result


_TANGENT = 0.5


class _Layer:
    """A layer without end on a rough floor: a piece of it, with its images before and behind.

    The piece is kept in its place by taking its length off particles that have left it; the images take the state of
    their originals after every substep.
    """

    def __init__(self, cells: int, tangent: float) -> None:
        h, self._period, self._begin = 1 / 64, 4 / 64, 10 / 64
        depth, count = cells * h, 3
        self.material = _sand(_angle_of(tangent), depth)
        piece = lattice((self._begin, 0, 0), (self._begin + self._period, depth, h), (h / 2, h / 2, h))
        shifts = self._period * np.array([0.0, -1.0, 1.0])
        points = np.concatenate([piece + np.array([shift, 0.0, 0.0]) for shift in shifts])
        scene = Scene(
            dust((self._begin, depth / 2, h / 2), h), (0, 0, 0), (24 * h, depth + 4 * h, h),
            medium=bed(self.material, points, h**3 / 4, _pressed(self.material, depth - points[:, 1])),
            ground=Ground(_ROUGH),
        )  # fmt: skip
        shear = math.sqrt(self.material.constants[0] / _DENSITY)
        self.slowest = math.pi / 2 * shear / depth
        self.stage = Stage(scene, h, 4 * depth / shear)  # one period of the layer's shear
        self._shape, self._shifts = (count, len(piece)), shifts
        self._top = points[:, 1] > 0.75 * depth

    def advance(self, angle: float, rate: float = 0.0) -> float:
        """One substep at a slope of `angle` [rad] under drag of a `rate` [1/s]; the upper quarter's speed [m/s]."""
        stage, medium = self.stage, self.stage.medium
        stage.v[medium] += stage.dt * np.array(_tilt(angle))
        stage.advance(1)
        keep = math.exp(-rate * stage.dt)
        stage.v[medium] *= keep
        stage.C[medium] *= keep
        state = stage.solver.matter
        for tensor in (
            state.v[0, 0, medium],
            state.C[0, 0, medium],
            state.b[0, 0],
            state.history[0, 0],
            state.tau[0, 0],
        ):
            copies = tensor.numpy().reshape(*self._shape, -1)
            copies[1:] = copies[0]
        places = stage.positions[medium].reshape(*self._shape, 3)
        along = self._begin + (places[0, :, 0] - self._begin) % self._period
        places[:] = places[0]
        places[..., 0] = along + self._shifts[:, None]
        stage.place(medium, places.reshape(-1, 3))
        return float(stage.v[medium, 0][self._top].mean())


def _accelerate(cells: int, tangent: float, degrees: float) -> float:
    """Acceleration [m/s^2] of the upper quarter two to six periods after the layer was tilted slowly to an angle."""
    layer = _Layer(cells, tangent)
    angle, period = math.radians(degrees), layer.stage.steps
    for n in range(10 * period):
        layer.advance(angle * min(1.0, n / (8 * period)), 0.3 * layer.slowest)
    speed = np.array([layer.advance(angle) for _ in range(6 * period)])
    late = np.arange(2 * period, 6 * period)
    return float(np.polyfit(late * layer.stage.dt, speed[late], 1)[0])


def _slope() -> Outcome:
    """Beyond theta_c the layer accelerates with g (sin theta - tan(theta_c) cos theta), tan(theta_c) = 3 alpha / sqrt2.

    The onset is where the line through the accelerations meets zero. The matter on the floor sticks to it and is
    sheared: what slides as a whole is the upper part.
    """
    critical = math.degrees(math.atan(_TANGENT))
    angles = critical + np.array([-2.0, -1.0, 1.0, 2.0, 4.0, 7.0])
    found = np.array([_accelerate(8, _TANGENT, angle) for angle in angles])
    exact = closed_form(angles)
    beyond = angles > critical
    rise, offset = np.polyfit(angles[beyond], found[beyond], 1)
    held = float(np.abs(found[~beyond]).max()) / GRAVITY
    fine = np.linspace(angles[0], angles[-1], 200)
    return Outcome(
        (
            Check("angle of onset off atan(3 α / √2)", abs(-offset / rise - critical), "degrees", at_most=1.0),
            Check("acceleration 7° beyond it over the closed form's", float(found[-1] / exact[-1]),
                  at_least=0.8, at_most=1.2),
            Check("acceleration 1° and more below it, over g", held, at_most=5e-3),
        ),
        Figure(
            "Endless layer of sand on a rough slope, 8 cells deep", "slope [degrees]", "acceleration [m/s²]",
            (curve("MPM", Role.COMPUTED, angles, found, points=True),
             curve("g (sin θ - tan θc cos θ)", Role.REFERENCE, fine, closed_form(fine))),
        ),
    )  # fmt: skip


def closed_form(degrees: Array) -> Array:
    """Acceleration [m/s^2] of a layer whose friction coefficient is `_TANGENT` down a slope."""
    angle = np.radians(degrees)
    result: Array = GRAVITY * np.maximum(np.sin(angle) - _TANGENT * np.cos(angle), 0.0)
    return result


def _tilt(angle: float) -> tuple[float, float, float]:
    """What turns gravity from -y into the direction of a plane tilted by `angle` [rad], [m/s^2]."""
    return (GRAVITY * math.sin(angle), GRAVITY * (1 - math.cos(angle)), 0.0)


def _run_out(aspect: int, tangent: float, cells: int) -> tuple[float, Array, Array]:
    """Run-out over L0 of a column L0 wide and `aspect` L0 high, times [s] and the path of its front over L0.

    The front is where the pile is 0.06 L0 thick.
    """
    width = 0.1
    h, height = width / cells, aspect * width
    material = _sand(_angle_of(tangent), height)
    points = lattice((0, 0, 0), (width, height, h), (h / 2, h / 2, h))
    scene = Scene(
        dust((width / 2, height / 2, h / 2), h), (0, 0, 0), (7 * width, height + 2 * h, h),
        medium=bed(material, points, h**3 / 4, _pressed(material, height - points[:, 1])), ground=Ground(_ROUGH),
    )  # fmt: skip
    seconds = 4.5 * math.sqrt(height / GRAVITY)
    stage = Stage(scene, h, seconds)
    pieces = 30
    front = [1.0]
    for _ in range(pieces):
        stage.advance(stage.steps // pieces)
        front.append(_front(stage.positions[stage.medium], h, 0.06 * width) / width)
    t = stage.times(pieces, stage.steps // pieces)
    return front[-1] - 1, t, np.array(front) - 1


def _front(places: Array, h: float, thickness: float) -> float:
    """The farthest x [m] at which the pile is `thickness` thick; the area of a column of cells over its width tells."""
    area = np.bincount(np.floor(np.maximum(places[:, 0], 0) / h).astype(int)) * h**2 / 4
    return float((np.flatnonzero(area / h > thickness).max() + 1) * h)


_ENVELOPE = {1: (1.2, 1.8), 2: (2.4, 3.6)}
"""Run-out over L0 by aspect ratio: 1.2 a of sand, rice and sugar (Lube et al. 2005), 1.8 a of glass beads
(Lajeunesse et al. 2005), both for low columns."""


def _collapse(cells: int, aspects: tuple[int, ...]) -> Outcome:
    checks: list[Check] = []
    curves: list[Curve] = []
    for aspect in aspects:
        found, t, path = _run_out(aspect, _TANGENT, cells)
        low, high = _ENVELOPE[aspect]
        checks.append(Check(f"run-out over L0 at H0 = {aspect} L0", found, at_least=low, at_most=high))
        curves += [
            curve(f"MPM, H0 = {aspect} L0", Role.COMPUTED, t, path),
            Curve(f"experiments, H0 = {aspect} L0", Role.BAND, t[[0, -1]], np.full(2, low), np.full(2, high)),
        ]
    control, t, path = _run_out(aspects[0], math.tan(math.radians(60)), cells)
    checks.append(
        Check(
            f"control: run-out at tan θc = √3 over the lowest observed at H0 = {aspects[0]} L0",
            control / _ENVELOPE[aspects[0]][0],
            at_most=0.9,
        )
    )
    curves.append(curve("MPM, control with θc = 60°", Role.COMPUTED, t, path))
    return Outcome(
        tuple(checks),
        Figure("Collapse of sand columns", "time [s]", "run-out over initial width [-]", tuple(curves)),
    )


CASES = [
    Case("sand-slope", "closed form of the Drucker-Prager layer (Klar et al. 2016) in plane strain",
         "8 cells deep, periodic", _slope, is_fast=False),
    Case("sand-collapse", "Lube et al. 2005, Phys. Rev. E 72, 041301; Lajeunesse et al. 2005, Phys. Fluids 17, 103302",
         "16 cells per initial width", partial(_collapse, 16, (1, 2)), is_fast=False),
]  # fmt: skip
