"""Balls in water by forces on their surface, which sink, rise and coast freely."""

import math

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.solver import Solver
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.rig import GRAVITY, Vector
from zoobench_verify.validate.surface_rig import DENSITY, SPACINGS, ellipsoid, in_water, name_of

_RADIUS = 0.05
"""Of the balls [m]."""

_DRAG, _ADDED = 0.45, 0.5
"""Coefficient of a sphere's drag at Reynolds numbers of 1e3 to 2e5, and its added mass by the water displaced [-]."""

_STOPS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
"""Times at which balls are looked at [s]."""


def _paths(spacing: float, density: float, gravity: float, speed: float) -> tuple[Array, Array]:
    """Place along y [m] and velocity along x [m/s] of a ball's centre of mass at the stops."""
    down: Vector = (0.0, -gravity, 0.0)
    solid = ellipsoid(_RADIUS, _RADIUS, _RADIUS)
    scene, fidelity = in_water(solid, spacing, density=density, velocity=(speed, 0.0, 0.0), gravity=down)
    solver = Solver(scene, fidelity)
    solver.reset()
    mass = solver.parameters.mass[0].double().numpy()
    places, speeds = [], []
    for stop in range(len(_STOPS)):
        if stop:
            piece = float(_STOPS[stop] - _STOPS[stop - 1])
            count = math.ceil(piece / solver.dt)
            solver.substeps(count, piece / count)
        places.append(float(mass @ solver.positions(0)[:, 1] / mass.sum()))
        speeds.append(float(mass @ solver.matter.v[0, 0, :, 0].double().numpy() / mass.sum()))
    return np.array(places), np.array(speeds)


def _way(density: float, times: Array) -> Array:
    """Way down [m] of a ball of this density [kg/m^3] that is let go in water."""
    ratio = density / DENSITY
    gain = (ratio - 1.0) * GRAVITY / (ratio + _ADDED)
    loss = 0.75 * _DRAG / (2 * _RADIUS) / (ratio + _ADDED)
    found: Array = math.copysign(1.0, gain) * np.log(np.cosh(math.sqrt(abs(gain) * loss) * times)) / loss
    return found


@case("balls-let-go", "added mass of a half, drag coefficient 0.45: closed form", "1/64, 1/96, 1/128 m, 13 cells")
def balls_let_go(record: CaseRecorder) -> None:
    """A ball 15 % heavier than water sinks, and one 15 % lighter rises, as far as by the closed form."""
    figure = record.plot("Balls that are let go", "time [s]", "way down [m]")
    for word, density in (("heavier", 1.15 * DENSITY), ("lighter", 0.85 * DENSITY)):
        exact = _way(density, _STOPS)
        for h in SPACINGS:
            places, _ = _paths(h, density, GRAVITY, 0.0)
            way = places[0] - places
            for at in (3, 5):
                record.within(
                    f"way in {_STOPS[at]:g} s by the exact one, 15 % {word}, {name_of(h)}", way[at] / exact[at],
                    0.95, 1.05,
                )  # fmt: skip
            figure.computed(f"15 % {word}, {name_of(h)}", _STOPS, way)
        figure.reference(f"15 % {word}, exact", _STOPS, exact)


@case("ball-that-coasts", "added mass of a half, drag coefficient 0.45: v / (1 + k v t)", "1/64, 1/96, 1/128 m")
def ball_that_coasts(record: CaseRecorder) -> None:
    """A ball of water's density loses its speed to drag alone, with the water's mass that goes along."""
    figure = record.plot("A ball that coasts from 0.5 m/s", "time [s]", "speed left [-]")
    exact = 1 / (1 + 0.75 * _DRAG / (2 * _RADIUS) / (1 + _ADDED) * 0.5 * _STOPS)
    for h in SPACINGS:
        _, speeds = _paths(h, DENSITY, 0.0, 0.5)
        left = speeds / speeds[0]
        for at in (3, 5):
            record.within(f"speed left by the exact one after {_STOPS[at]:g} s, {name_of(h)}", left[at] / exact[at],
                          0.9, 1.1)  # fmt: skip
        figure.computed(name_of(h), _STOPS, left)
    figure.reference("exact", _STOPS, exact)
