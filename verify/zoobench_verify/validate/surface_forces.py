"""Water by forces on a body's surface: added mass, drag and lift of solids that are towed, on three grids."""

import math

import numpy as np

from zoobench.arrays import Array
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.surface_rig import (
    DENSITY,
    SPACINGS,
    Led,
    disc,
    drag_coefficient,
    ellipsoid,
    in_water,
    name_of,
    plate,
)

_RADIUS, _EDGE = 0.05, 0.12
"""Of the sphere, and of the square plate [m]."""
_THICKNESSES = (0.1, 0.05)
"""Of plates, by their edge [-]."""
_SPHEROID = (0.15, 0.03)
"""Half axes of the spheroid [m]."""

_THIN = 0.579 * math.pi / 4
"""Added mass of a thin square plate by that of a cube of water of its edge [-]."""
_ROUNDED = 1.14
"""Factor of a plate's added mass at most, if it is a tenth as thick as wide: that of one infinitely long."""


def _added(led: Led) -> Array:
    """Tensor of added mass by density `[3, 3]` [m^3]."""
    found: Array = led.towed(np.zeros(3)).added.sum(axis=0) / DENSITY
    return found


def _added_inertia(led: Led) -> float:
    """Added moment of inertia of the spheroid across its axis, by that of the water that it displaces [-]."""
    a, b = _SPHEROID
    turning = np.cross([0.0, 0.0, 1.0], led.places - led.places.mean(axis=0))
    added = np.einsum("na,nab,nb->", turning, led.towed(np.zeros(3)).added, turning)
    return float(added) / (DENSITY * 4 / 3 * math.pi * a * b**2 * (a**2 + b**2) / 5)


_BY_STRIPS = "the water that a slice takes along is that of a body that moves as a whole"
_OWN_NORMAL = "a panel's added mass is that along its own normal, by the potential's part along it"


@case(
    "added-mass-of-solids",
    "Lamb 1932, art. 92, 114, 373; plates: DNV-RP-C205 (recalled)",
    "1/64, 1/96, 1/128 m",
    is_fast=False,
)
def added_mass_of_solids(record: CaseRecorder) -> None:
    """Water resists the acceleration of a sphere, a spheroid and plates as potential flow does, on every grid."""
    ball, long = ellipsoid(_RADIUS, _RADIUS, _RADIUS), ellipsoid(*_SPHEROID, _SPHEROID[1])
    plates = [plate(_EDGE, share * _EDGE, _EDGE) for share in _THICKNESSES]
    balls, plain = [], []
    for h in SPACINGS:
        at = name_of(h)
        balls.append(np.diag(_added(Led(*in_water(ball, h)))) / (4 / 3 * math.pi * _RADIUS**3))
        record.within(f"sphere by its volume, along x, {at}", balls[-1][0], 0.475, 0.525)
        record.within(f"sphere by its volume, along y, {at}", balls[-1][1], 0.475, 0.525)
        along = np.diag(_added(Led(*in_water(long, h)))) / (4 / 3 * math.pi * _SPHEROID[0] * _SPHEROID[1] ** 2)
        record.within(f"spheroid 5:1 by its volume, across, {at}", along[2], 0.95 * 0.894, 1.05 * 0.894)
        record.within(
            f"spheroid 5:1 by its volume, along, {at}", along[0], 0.95 * 0.0591, 1.05 * 0.0591,
            shortfall=Shortfall(_OWN_NORMAL, 0.037),
        )  # fmt: skip
        turning = _added_inertia(Led(*in_water(long, h)))
        record.within(f"spheroid 5:1, moment of inertia by that of its water, {at}", turning, 0.95 * 0.70, 1.05 * 0.70,
                      shortfall=Shortfall(_BY_STRIPS, 0.8))  # fmt: skip
        thick, thinner = (_added(Led(*in_water(each, h)))[1, 1] / _EDGE**3 for each in plates)
        record.within(f"plate by its edge's cube, a tenth as thick, {at}", thick, _THIN, _ROUNDED * _THIN)
        plain.append(thinner)
        record.within(f"the same, a twentieth as thick, {at}", thinner, 0.95 * _THIN, 1.05 * _THIN)
    moved = [_added(Led(*in_water(ball, SPACINGS[0], shift=shift * SPACINGS[0])))[0, 0] for shift in (0.0, 0.3, 0.5)]
    record.at_most("spread over three places, by the mean, at 1/64 m", np.ptp(moved) / np.mean(moved), 1e-5)
    figure = record.plot("Added mass", "grid spacing [m]", "by volume, or by the cube of the edge [-]")
    figure.computed("sphere", np.array(SPACINGS), np.array(balls)[:, 0], points=True)
    figure.reference("1/2", np.array(SPACINGS), np.full(len(SPACINGS), 0.5))
    figure.computed("plate, a twentieth as thick", np.array(SPACINGS), np.array(plain), points=True)
    figure.reference("thin plate, 0.455", np.array(SPACINGS), np.full(len(SPACINGS), _THIN))


_SPEED = 0.5
"""Of what is towed [m/s]: a Reynolds number of 5e4."""


@case("drag-of-solids", "sphere: diracdelta.co.uk, 0.45; plates, spheroid: Hoerner 1965 (recalled)",
      "1/64, 1/96, 1/128 m")  # fmt: skip
def drag_of_solids(record: CaseRecorder) -> None:
    """A sphere, a plate across and along the flow and a streamlined spheroid are held back as measured."""
    ball, long = ellipsoid(_RADIUS, _RADIUS, _RADIUS), ellipsoid(*_SPHEROID, _SPHEROID[1])
    square, edgewise, drags = plate(_EDGE, 0.1 * _EDGE, _EDGE), [], []
    for h in SPACINGS:
        at = name_of(h)
        drags.append(_drag(Led(*in_water(ball, h)), 0, disc(_RADIUS)))
        record.within(f"drag coefficient of a sphere, {at}", drags[-1], 0.7 * 0.45, 1.3 * 0.45)
        flat = Led(*in_water(square, h))
        record.within(f"of a square plate across the flow, {at}", _drag(flat, 1, _EDGE**2), 1.0, 1.3)
        edgewise.append(_drag(flat, 0, _EDGE**2))
        record.within(f"of that plate edgewise, by its area, {at}", edgewise[-1], 0.08, 0.15)
        streamlined = _drag(Led(*in_water(long, h)), 0, disc(_SPHEROID[1]))
        record.within(f"of a spheroid 5:1 along its axis, by its disc, {at}", streamlined, 0.06, 0.15)
    record.at_most("edgewise, the largest of three grids by the least", max(edgewise) / min(edgewise), 1.1)
    figure = record.plot("Drag of a sphere and of a plate edgewise", "grid spacing [m]", "drag coefficient [-]")
    figure.computed("sphere", np.array(SPACINGS), np.array(drags), points=True)
    figure.computed("plate edgewise", np.array(SPACINGS), np.array(edgewise), points=True)
    figure.reference("sphere, 0.45", np.array(SPACINGS), np.full(len(SPACINGS), 0.45))


def _drag(led: Led, axis: int, area: float) -> float:
    """Drag coefficient by an area [m^2] of a body that is towed along an axis."""
    return drag_coefficient(-float(led.towed(_SPEED * np.eye(3)[axis]).on_body()[axis]), _SPEED, area)


_NORMAL_FORCES = {5.0: 0.13, 10.0: 0.28, 15.0: 0.45, 20.0: 0.62, 30.0: 1.0}
"""Normal force coefficients of a square plate by the angle of attack [degrees]. Lifting surfaces of this aspect begin
with a slope of 2 pi / (2 + 5^0.5) = 1.48 (Helmbold 1942) and gain 1.4 sin^2 by vortices of their edges (Polhamus
1966)."""


@case("plate-at-incidence", "Pelletier & Mueller 2000, Torres & Mueller 2004 (recalled); Helmbold 1942",
      "1/64, 1/96, 1/128 m")  # fmt: skip
def plate_at_incidence(record: CaseRecorder) -> None:
    """The force across a square plate grows with its angle to the flow as measured."""
    figure = record.plot("Square plate at an angle", "angle of attack [degrees]", "normal force coefficient [-]")
    square, angles = plate(_EDGE, 0.1 * _EDGE, _EDGE), np.array(list(_NORMAL_FORCES))
    for h in SPACINGS:
        led = Led(*in_water(square, h))
        found = np.array([_normal_force(led, angle) for angle in angles])
        for angle, value in zip(angles, found, strict=True):
            measured = _NORMAL_FORCES[angle]
            record.within(
                f"normal force coefficient at {angle:g} degrees, {name_of(h)}", value, 0.75 * measured, 1.25 * measured
            )
        record.at_most(f"the same without an angle, {name_of(h)}", abs(_normal_force(led, 0.0)), 0.005)
        figure.computed(name_of(h), angles, found)
    figure.reference("measured", angles, np.array(list(_NORMAL_FORCES.values())))


def _normal_force(led: Led, angle: float) -> float:
    """Coefficient of the force along y on a plate that is towed along x, at an angle [degrees]."""
    velocity = _SPEED * np.array([math.cos(math.radians(angle)), -math.sin(math.radians(angle)), 0.0])
    return drag_coefficient(float(led.towed(velocity).on_body()[1]), _SPEED, _EDGE**2)


@case("moment-on-a-spheroid", "Munk 1924: (m across - m along) U^2 sin cos; measured 0.6 to 0.9 of it (recalled)",
      "1/64, 1/96, 1/128 m")  # fmt: skip
def moment_on_a_spheroid(record: CaseRecorder) -> None:
    """Water turns a spheroid that it meets at an angle across the flow, by nearly the moment of potential flow."""
    figure = record.plot("Spheroid 5:1 at an angle", "angle of attack [degrees]", "moment by Munk's [-]")
    a, b = _SPHEROID
    long, angles = ellipsoid(a, b, b), np.array([5.0, 10.0, 20.0])
    scale = DENSITY * 4 / 3 * math.pi * a * b**2 * (0.894 - 0.059) * _SPEED**2
    for h in SPACINGS:
        led = Led(*in_water(long, h))
        middle = led.places.mean(axis=0)
        found = []
        for angle in np.radians(angles):
            push = led.towed(_SPEED * np.array([math.cos(angle), -math.sin(angle), 0.0]))
            moment = np.cross(led.places - middle, push.force).sum(axis=0)[2]
            found.append(moment / (scale * math.sin(angle) * math.cos(angle)))
        record.within(f"moment by Munk's at 10 degrees, {name_of(h)}", found[1], 0.5, 1.0)
        figure.computed(name_of(h), angles, np.array(found))
    figure.reference("Munk", angles, np.ones(len(angles)))
