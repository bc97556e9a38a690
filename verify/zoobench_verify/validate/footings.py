"""Strip footings that are pushed into clay and mud, against their bearing capacity."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.rig import WEIGHTLESS, Rig, bed, lattice, passive_body
from zoobench_verify.validate.speed_control import SpeedControl, check_motion

PRANDTL = 2.0 + math.pi
"""Bearing capacity of a strip footing on clay without weight over its shear strength."""

_H = 1 / 64
_PUSH = 0.3
"""Depth to which a footing is pushed [cells]."""
_SPEED = 0.005
"""Speed of the footing [m/s]: at twice this speed the inertia of the clay adds a tenth."""
_RAMP = 0.2
"""Share of the time in which the footing gains its speed."""
_PIECES = 30
"""Parts of the way whose means are taken."""


def _clay(shear_strength: float) -> ClayMaterial:
    """Clay of a shear strength k [Pa]: the deviatoric stress at yield is sqrt(2) k in pure shear."""
    return ClayMaterial(1e5, 0.3, 1600.0, yield_stress=math.sqrt(2.0) * shear_strength)


_CLAY = _clay(100.0)
_STRONGER = (250.0, 500.0)
"""Shear strengths [Pa] of further clays, which a footing yields to hardly within its push, but must be pushed into."""
_THIN_MUD = MudMaterial(1e5, 0.3, 1600.0, yield_stress=_CLAY.yield_stress, viscosity=0.0)


class FootingPush(NamedTuple):
    """The motion and the forces of a footing, in means over parts of its way `[parts]`, all read from its particles.

    Attributes:
        depth: [cells].
        pressure: over the medium's shear strength [-].
        speed: [m/s].
        reached: depth at the end [cells].
    """

    depth: Array
    pressure: Array
    speed: Array
    reached: float


def footing(
    cells: int, friction: float | None, *, depth: int | None = None, material: ClayMaterial | MudMaterial = _CLAY,
    place: float = 0.0,
) -> FootingPush:  # fmt: skip
    """Push a strip footing, an elastic block, into a weightless medium; the force on it is the medium's resistance.

    Plane strain: one cell between walls without friction.

    Args:
        cells: width of the footing.
        friction: between footing and medium; None for one velocity field.
        depth: of the medium on rough ground [cells]; None for one that does not matter, on smooth ground.
        material: of the medium.
        place: of its edges behind a column of nodes [cells].
    """
    rough, deep, high, edge = depth is not None, depth or max(2 * cells, 8), 4, _H / 2
    margin = max(2 * min(cells, deep), 8)
    wide, top = (cells + 2 * margin) * _H, deep * _H
    left = (margin + place) * _H
    block = lattice((left, top, 0.0), (left + cells * _H, top + high * _H, _H), edge)
    layer = bed(material, lattice((0.0, 0.0, 0.0), (wide, top, _H), edge), edge**3)
    scene = Scene(
        passive_body(ElasticMaterial(2e5, 0.3, 1600.0), block, edge**3), (0, 0, 0), (wide, top + (high + 3) * _H, _H),
        medium=replace(layer, friction=friction), ground=Ground(100.0) if rough else None, gravity=WEIGHTLESS,
    )  # fmt: skip
    rig = Rig(scene, _H, _PUSH * _H / _SPEED / (1 - _RAMP / 2))
    control, robot = SpeedControl(rig, 1), rig.robot
    depths, speeds, forces = np.zeros((3, rig.steps))
    for n in range(rig.steps):
        rig.v[robot, 0] -= rig.v[robot, 0].mean()
        control.advance(-_SPEED * min(1.0, (n + 1) / (_RAMP * rig.steps)))
        depths[n], speeds[n], forces[n] = -control.moved / _H, -control.speed, -control.force
    whole = rig.steps // _PIECES * _PIECES
    way, speed, force = (values[:whole].reshape(_PIECES, -1).mean(1) for values in (depths, speeds, forces))
    strength = material.yield_stress / math.sqrt(2.0)
    return FootingPush(way, force / (strength * cells * _H * _H), speed, float(depths[-1]))


def pushed(
    record: CaseRecorder, label: str, cells: int, friction: float | None, *, depth: int | None = None,
    material: ClayMaterial | MudMaterial = _CLAY, place: float = 0.0,
) -> FootingPush:  # fmt: skip
    """A `footing` that is drawn, and fails the case unless it went as deep and as fast as it was pushed."""
    found = footing(cells, friction, depth=depth, material=material, place=place)
    steady = found.speed[math.ceil(_RAMP * _PIECES) + 1 :]
    check_motion(record, label, found.reached / _PUSH, steady / _SPEED)
    if record.figure is not None:
        record.figure.computed(label, found.depth, found.pressure)
    return found


_EARLY = "robot and medium meet 0.4 cells too early, so that the footing is broader by a part of a cell"
_WORST = {2: 1.72, 4: 1.25, 8: 1.17}
"""Largest mean pressure over Prandtl's that is known, the mean over `_PLACES`, by the footing's width [cells]."""

_PLACES = (0.0, 0.5)
"""On a column of nodes an edge carries most, half a cell behind it least."""


@case("strip-footing", "Prandtl 1920: bearing capacity (2 + π) k", "footings of 2, 4 and 8 cells", is_fast=False)
def strip_footing(record: CaseRecorder) -> None:
    """Footings pushed into clay by 0.3 cells carry Prandtl's load."""
    figure = record.plot("Strip footing on clay", "depth [cells]", "pressure over shear strength [-]")
    loads = {}
    for cells, worst in _WORST.items():
        found = [pushed(record, f"{cells} cells, {place:g} behind", cells, 0.5, place=place) for place in _PLACES]
        loads[cells] = sum(each.pressure[-1] for each in found) / len(found) / PRANDTL
        record.within(
            f"capacity over Prandtl's, {cells} cells", loads[cells], 0.9, 1.1, shortfall=Shortfall(_EARLY, worst)
        )
    single = pushed(record, "2 cells, one velocity field", 2, None)
    record.at_least(
        "control: capacity of 2 cells in one velocity field over that in two",
        single.pressure[-1] / PRANDTL / loads[2], 1.1,
    )  # fmt: skip
    for strength in _STRONGER:
        pushed(record, f"4 cells on clay of {strength:g} Pa", 4, 0.5, material=_clay(strength))
    figure.reference("2 + π", single.depth, np.full_like(single.depth, PRANDTL))


_NARROW = Shortfall(f"{_EARLY}; of two cells between rough walls one layer of nodes can move", 2.3)
_LAYERS = {2: (6.22, _NARROW), 4: (5.24, None)}
"""Bearing capacity over the shear strength of a layer this thin [cells] under a rough footing of 8 cells on a rough
base (Mandel and Salencon 1972, for widths of 4 and 2 times the depth), and the largest multiple that is known."""


@case("thin-layer", "Mandel and Salencon 1972", "footing of 8 cells on 2 and 4 cells of mud", is_fast=False)
def thin_layer(record: CaseRecorder) -> None:
    """Mud of a few cells flows from under a footing, since it slides on the ground at its own strength.

    Clay sticks to it: it bears its robots, and hardly flows. The exact load is that of the layer before it is pressed;
    a push of 0.3 cells adds a twentieth to that of two cells.
    """
    figure = record.plot("Strip footing on a thin layer", "depth [cells]", "pressure over shear strength [-]")
    loads = {}
    for depth, (exact, known) in _LAYERS.items():
        found = pushed(record, f"mud of {depth} cells", 8, 10.0, depth=depth, material=_THIN_MUD)
        loads[depth] = found.pressure[-1]
        record.within(
            f"capacity over the exact one, {depth} cells", loads[depth] / exact, 0.9, 1.2,
            shortfall=known,
        )  # fmt: skip
        figure.reference(f"Mandel and Salencon, {depth} cells", found.depth, np.full_like(found.depth, exact))
    clay = pushed(record, "clay of 2 cells", 8, 10.0, depth=2)
    record.at_least(
        "control: capacity of clay, which sticks, over that of mud, 2 cells", clay.pressure[-1] / loads[2], 1.6
    )
