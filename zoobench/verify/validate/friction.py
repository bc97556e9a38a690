"""Coulomb friction: a block on an incline that must stick or slide."""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.matter import ElasticMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.verify.validate.base import Case, Check, Figure, Outcome, Role, curve
from zoobench.verify.validate.stage import GRAVITY, Stage, lattice, passive_body

_STIFF = ElasticMaterial(youngs_modulus=1e6, poissons_ratio=0.2, density=1000.0)
_LENGTH = 6 / 32
"""Of the block along the plane [m]; it is half as high and as wide."""
_CELLS = 6
_RAMP = 0.2
"""Time over which the plane is tilted [s]. A sudden tilt makes the elastic block overshoot, and so slip, by itself."""


def _tilted(stage: Stage, degrees: float, seconds: float) -> tuple[Array, Array, Array]:
    """Times [s] and the centre's path and velocity along a plane that tilts within `_RAMP` and then stays.

    The stage's own gravity is that normal to the plane in its final position.
    """
    pull = GRAVITY * math.sin(math.radians(degrees))
    every = 8
    t = stage.times(round(seconds / stage.dt / every), every)
    path = [_centre(stage)]
    for begin in t[:-1]:
        for n in range(every):
            risen = min((begin + n * stage.dt) / _RAMP, 1.0)
            stage.v[:, 0] += stage.dt * pull * (0.5 - 0.5 * math.cos(math.pi * risen))
            stage.advance(1)
        path.append(_centre(stage))
    x, v = np.array(path).T
    return t, x, v


def _centre(stage: Stage) -> tuple[float, float]:
    """Place [m] and speed [m/s] of the centre along the plane; all particles weigh the same."""
    return float(stage.positions[:, 0].mean()), float(stage.v[:, 0].mean())


class Slide(NamedTuple):
    """The path of a block from the end of the ramp on.

    Attributes:
        stage: what moved it on.
        since: times `[count]` [s], from 0 on.
        moved: distance that its centre went along the plane `[count]` [m].
        exact: the same by Coulomb's law, begun at the same speed `[count]` [m].
    """

    stage: Stage
    since: Array
    moved: Array
    exact: Array

    @property
    def error(self) -> float:
        """Of the whole distance, relative."""
        return float(self.moved[-1] / self.exact[-1] - 1)


def slide(
    degrees: float,
    friction: float,
    seconds: float = 0.5,
    cells: int = _CELLS,
    viscosity: float = 0.0,
    **settings: Any,
) -> Slide:
    """A flat block that was equilibrated under normal gravity before the plane tilts.

    Sliding with a constant coefficient is unstable for an elastic body: rocking grows out of nothing (Adams 1995,
    Self-excited oscillations of two elastic half-spaces sliding with a constant coefficient of friction), and a block
    that hops is carried on by less friction than Coulomb's. Numerical dissipation hides it on coarse grids only; the
    closed form needs a block whose own viscosity does.

    Args:
        degrees: the final tilt, above the critical one for `exact` to hold.
        friction: Coulomb's coefficient.
        seconds: the time from the beginning of the ramp on [s].
        cells: of the grid along the block.
        viscosity: of the block [Pa s].
        settings: precision and further choices of the fidelity.
    """
    h = _LENGTH / cells
    high = cells // 2 * h
    points = lattice((0.2, 0.0, h), (0.2 + cells * h, high, h + high), h / 2)
    normal = GRAVITY * math.cos(math.radians(degrees))
    scene = Scene(
        passive_body(replace(_STIFF, viscosity=viscosity), points, h**3 / 8), (0, 0, 0), (2.0, 0.3, high + 2 * h),
        ground=Ground(friction), gravity=(0.0, -normal, 0.0),
    )  # fmt: skip
    stage = Stage(scene, h, 0.05, courant=0.8, **settings)
    stage.equilibrate(400.0, stage.steps)
    t, x, v = _tilted(stage, degrees, seconds)
    begin = int(np.flatnonzero(t >= _RAMP)[0])
    rate = GRAVITY * (math.sin(math.radians(degrees)) - friction * math.cos(math.radians(degrees)))
    since = t[begin:] - t[begin]
    return Slide(stage, since, x[begin:] - x[begin], v[begin] * since + rate * since**2 / 2)


def _incline() -> Outcome:
    friction = 0.4
    critical = math.degrees(math.atan(friction))
    creep = 0.0
    for degrees in (19.0, 21.7):
        creep = max(creep, float(abs(slide(degrees, friction, 0.45).moved[-1])) * _CELLS / _LENGTH)
    slides = [(20.0, 0.0), (20.0, 0.2), (30.0, 0.4), (23.5, 0.4)]
    errors, curves = [], []
    for degrees, mu in slides:
        _, since, moved, exact = found = slide(degrees, mu)
        errors.append(abs(found.error))
        label = f"{degrees:g}°, μ = {mu:g}"
        every = len(since) // 12
        curves += [
            curve(f"MPM, {label}", Role.COMPUTED, since[::every], moved[::every], points=True),
            curve(label, Role.REFERENCE, since, exact),
        ]
    return Outcome(
        (
            Check(f"creep in 0.25 s below the critical angle of {critical:.2f}°", creep, "cells", at_most=0.02),
            Check("distance slid at angles above it, relative error", max(errors), at_most=0.02),
        ),
        Figure("Block on an incline after the ramp", "time [s]", "distance slid [m]", tuple(curves)),
    )


CASES = [
    Case(
        "incline", "Coulomb 1785: a = g (sin θ - μ cos θ), at rest for tan θ < μ", "block of 6 x 3 x 3 cells", _incline
    ),
]
