"""Coulomb friction: a block on an incline that must stick or slide."""

import math

import numpy as np

from zoobench.sim.matter import ElasticMaterial
from zoobench.sim.scene import Ground, Scene
from zoobench.studies.validate.base import Array, Case, Check, Figure, Outcome, Role, curve
from zoobench.studies.validate.stage import GRAVITY, Stage, lattice, passive_body

_STIFF = ElasticMaterial(youngs_modulus=1e6, poissons_ratio=0.2, density=1000.0)
_SPACING = 1 / 32
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


def _block_on_plane(degrees: float, friction: float, seconds: float) -> tuple[Array, Array, Array]:
    """The path of a flat block that was settled under normal gravity before the plane tilts."""
    h = _SPACING
    points = lattice((0.2, 0.0, h), (0.2 + 6 * h, 3 * h, 4 * h), h / 2)
    normal = GRAVITY * math.cos(math.radians(degrees))
    scene = Scene(
        passive_body(_STIFF, points, h**3 / 8), (0, 0, 0), (2.0, 0.3, 5 * h),
        ground=Ground(friction), gravity=(0.0, -normal, 0.0),
    )  # fmt: skip
    stage = Stage(scene, h, 0.05, courant=0.8)
    stage.settle(400.0, stage.steps)
    return _tilted(stage, degrees, seconds)


def _incline() -> Outcome:
    friction = 0.4
    critical = math.degrees(math.atan(friction))
    creep = 0.0
    for degrees in (19.0, 21.7):
        t, x, _ = _block_on_plane(degrees, friction, 0.45)
        creep = max(creep, float(abs(x[-1] - x[t >= _RAMP][0])) / _SPACING)
    slides = [(20.0, 0.0), (20.0, 0.2), (30.0, 0.4), (23.5, 0.4)]
    errors, curves = [], []
    for degrees, mu in slides:
        t, x, v = _block_on_plane(degrees, mu, 0.5)
        begin = int(np.flatnonzero(t >= _RAMP)[0])
        rate = GRAVITY * (math.sin(math.radians(degrees)) - mu * math.cos(math.radians(degrees)))
        since = t[begin:] - t[begin]
        exact = v[begin] * since + rate * since**2 / 2
        moved = x[begin:] - x[begin]
        errors.append(abs(moved[-1] / exact[-1] - 1))
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
