"""Coulomb friction: a block that sticks or slides on an incline."""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Robot
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import GRAVITY, NAMES, Rig, lattice, passive_body

_STIFF = ElasticMaterial(youngs_modulus=1e6, poissons_ratio=0.2, density=1000.0)
_LENGTH = 6 / 32
"""Length of the block along the plane [m]; it is half as high and as wide."""
_CELLS = 6
_RAMP = 0.2
"""Time over which the plane is tilted [s]. After a sudden tilt the elastic block would overshoot and slip."""


def _tilted(rig: Rig, degrees: float, seconds: float) -> tuple[Array, Array, Array]:
    """Times [s], positions [m] and velocities [m/s] of the centre along a plane that tilts within `_RAMP`.

    The rig's own gravity is the component normal to the final plane. All particles have the same mass.
    """
    downhill = GRAVITY * math.sin(math.radians(degrees))
    every = 8
    t = rig.times(round(seconds / rig.dt / every), every)

    def centre() -> tuple[float, float]:
        return float(rig.positions[:, 0].mean()), float(rig.v[:, 0].mean())

    path = [centre()]
    for begin in t[:-1]:
        for n in range(every):
            risen = min((begin + n * rig.dt) / _RAMP, 1.0)
            rig.velocities[:, 0] += rig.dt * downhill * (0.5 - 0.5 * math.cos(math.pi * risen))
            rig.advance(1)
        path.append(centre())
    x, v = np.array(path).T
    return t, x, v


class Slide(NamedTuple):
    """The motion of a block after the ramp.

    Attributes:
        rig: in its final state.
        since: times since the end of the ramp `[count]` [s].
        moved: distance covered by the centre along the plane `[count]` [m].
        exact: the same by Coulomb's law with the same initial speed `[count]` [m].
    """

    rig: Rig
    since: Array
    moved: Array
    exact: Array

    @property
    def error(self) -> float:
        """Relative error of the whole distance."""
        return float(self.moved[-1] / self.exact[-1] - 1)


def slide(
    degrees: float, friction: float, seconds: float = 0.5, cells: int = _CELLS, viscosity: float = 0.0, **settings: Any
) -> Slide:
    """A flat block, equilibrated under normal gravity before the plane tilts.

    Sliding with a constant coefficient is unstable for an elastic body: rocking is self-excited (Adams 1995,
    Self-excited oscillations of two elastic half-spaces sliding with a constant coefficient of friction), and the mean
    friction on a hopping block is below Coulomb's. Numerical dissipation suppresses it on coarse grids only; the closed
    form needs a block whose own viscosity suppresses it.

    Args:
        degrees: the final tilt, above the critical one for `exact` to hold.
        friction: Coulomb's coefficient.
        seconds: the time from the beginning of the ramp on [s].
        cells: of the grid along the block.
        viscosity: of the block [Pa s].
    """
    h = _LENGTH / cells
    high = cells // 2 * h
    points = lattice((0.2, 0.0, h), (0.2 + cells * h, high, h + high), h / 2)
    normal = GRAVITY * math.cos(math.radians(degrees))
    scene = Scene(
        passive_body(replace(_STIFF, viscosity=viscosity), points, h**3 / 8), (0, 0, 0), (2.0, 0.3, high + 2 * h),
        ground=Ground(friction), gravity=(0.0, -normal, 0.0),
    )  # fmt: skip
    rig = Rig(standing(scene, h / 2), h, 0.05, courant=0.8, **settings)
    rig.equilibrate(400.0, rig.steps)
    t, x, v = _tilted(rig, degrees, seconds)
    begin = int(np.flatnonzero(t >= _RAMP)[0])
    rate = GRAVITY * (math.sin(math.radians(degrees)) - friction * math.cos(math.radians(degrees)))
    since = t[begin:] - t[begin]
    return Slide(rig, since, x[begin:] - x[begin], v[begin] * since + rate * since**2 / 2)


@case("incline", "Coulomb 1785: a = g (sin θ - μ cos θ), at rest for tan θ < μ", "block of 6 x 3 x 3 cells")
def incline(record: CaseRecorder) -> None:
    """A block on an inclined plane rests below the critical angle and slides as Coulomb's law says above."""
    check_inclines(record)


def check_inclines(record: CaseRecorder, robot: Robot = "mpm") -> None:
    """Check the creep of a block below the critical angle, and its way above."""
    friction = 0.4
    critical = math.degrees(math.atan(friction))
    creep = 0.0
    for degrees in (19.0, 21.7):
        creep = max(creep, float(abs(slide(degrees, friction, 0.45, robot=robot).moved[-1])) * _CELLS / _LENGTH)
    slides = [(20.0, 0.0), (20.0, 0.2), (30.0, 0.4), (23.5, 0.4)]
    errors = []
    figure = record.plot("Block on an incline after the ramp", "time [s]", "distance slid [m]")
    for degrees, mu in slides:
        _, since, moved, exact = found = slide(degrees, mu, robot=robot)
        errors.append(abs(found.error))
        label = f"{degrees:g}°, μ = {mu:g}"
        every = len(since) // 12
        figure.computed(f"{NAMES[robot]}, {label}", since[::every], moved[::every], points=True)
        figure.reference(label, since, exact)
    record.at_most(f"creep in 0.25 s below the critical angle of {critical:.2f}°", creep, 0.02, "cells")
    record.at_most("distance slid at angles above it, relative error", max(errors), 0.02)
