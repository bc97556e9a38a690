"""Where a robot meets a medium: bearing capacity of clay, sinkage in mud, and Coulomb friction on a bed."""

import math
from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.envs.bed import rest_strains
from zoobench.sim.model.fidelity import Transfer
from zoobench.sim.model.matter import ClayMaterial, ElasticMaterial, MudMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.verify.cases import CaseRecorder, case
from zoobench.verify.validate.rig import GRAVITY, WEIGHTLESS, Rig, bed, lattice, passive_body

_H = 1 / 64
_PER_CELL = 2
_SHEAR_STRENGTH = 100.0
"""k [Pa] of the clay."""
_PUSH = 0.3
"""Depth to which a footing is pushed [cells]."""
_SPEED = 0.005
"""Of the footing [m/s]: at twice this speed the inertia of the clay adds a tenth."""
_RAMP = 0.2

PRANDTL = 2.0 + math.pi
"""Bearing capacity of a strip footing on clay without weight over its shear strength."""


# the deviatoric stress at yield is sqrt(2) k in pure shear
_CLAY = ClayMaterial(1e5, 0.3, 1600.0, yield_stress=math.sqrt(2.0) * _SHEAR_STRENGTH)
_THIN_MUD = MudMaterial(1e5, 0.3, 1600.0, yield_stress=_CLAY.yield_stress, viscosity=0.0)


def footing(
    cells: int, friction: float | None, *, depth: int | None = None, material: ClayMaterial | MudMaterial = _CLAY
) -> tuple[Array, Array]:
    """Depth [cells] and mean pressure over the medium's shear strength of a strip footing on a weightless medium.

    The footing, an elastic block, is led by a uniform body force so that its mean velocity is what it should be; the
    force is the medium's resistance. Plane strain: one cell between walls without friction.

    Args:
        cells: width of the footing.
        friction: between footing and medium; None for one velocity field.
        depth: of the medium on rough ground [cells]; None for one that does not matter, on smooth ground.
        material: of the medium; its shear strength is `_SHEAR_STRENGTH`.
    """
    rough, deep, high = depth is not None, depth or max(2 * cells, 8), 4
    beside = max(2 * min(cells, deep), 8)
    wide, top, edge = (cells + 2 * beside) * _H, deep * _H, _H / _PER_CELL
    block = lattice((beside * _H, top, 0.0), ((beside + cells) * _H, top + high * _H, _H), edge)
    layer = bed(material, lattice((0.0, 0.0, 0.0), (wide, top, _H), edge), edge**3)
    scene = Scene(
        passive_body(ElasticMaterial(2e5, 0.3, 1600.0), block, edge**3), (0, 0, 0), (wide, top + (high + 3) * _H, _H),
        medium=replace(layer, friction=friction), ground=Ground(100.0) if rough else None, gravity=WEIGHTLESS,
    )  # fmt: skip
    rig = Rig(scene, _H, _PUSH * _H / _SPEED / (1 - _RAMP / 2))
    robot, mass = rig.robot, rig.mass[rig.robot]
    depths, forces = np.zeros(rig.steps), np.zeros(rig.steps)
    for n in range(rig.steps):
        rig.advance(1)
        wanted = -_SPEED * min(1.0, (n + 1) / (_RAMP * rig.steps))
        add = np.array([0.0, wanted, 0.0]) - (mass @ rig.v[robot]) / mass.sum() * np.array([1.0, 1.0, 0.0])
        rig.v[robot] += add
        depths[n] = -wanted * rig.dt / _H
        forces[n] = -mass.sum() * add[1] / rig.dt
    pieces = 30
    whole = rig.steps // pieces * pieces
    pressure = forces[:whole].reshape(pieces, -1).mean(1) / (_SHEAR_STRENGTH * cells * _H * _H)
    return np.cumsum(depths)[:whole].reshape(pieces, -1)[:, -1], pressure


_MOST = {2: 1.6, 4: 1.3, 8: 1.2}
"""Largest mean pressure over Prandtl's by the footing's width [cells]."""


@case("strip-footing", "Prandtl 1920: bearing capacity (2 + π) k", "footings of 2, 4 and 8 cells", is_fast=False)
def strip_footing(record: CaseRecorder) -> None:
    """Footings pushed into clay by 0.3 cells carry Prandtl's load, broadened by a part of a cell."""
    figure = record.plot("Strip footing on clay", "depth [cells]", "pressure over shear strength [-]")
    for cells, most in _MOST.items():
        depth, pressure = footing(cells, 0.5)
        record.within(f"capacity over Prandtl's, {cells} cells", pressure[-1] / PRANDTL, 0.9, most)
        figure.computed(f"MPM, {cells} cells", depth, pressure)
    depth, pressure = footing(2, None)
    record.at_least("control: capacity of 2 cells in one velocity field over Prandtl's", pressure[-1] / PRANDTL, 1.6)
    figure.computed("MPM, 2 cells, one velocity field", depth, pressure)
    figure.reference("2 + π", depth, np.full_like(depth, PRANDTL))


_LAYERS = {2: (6.22, 1.45), 4: (5.24, 1.2)}
"""Bearing capacity over the shear strength of a layer this thin [cells] under a rough footing of 8 cells on a rough
base (Mandel and Salencon 1972, for widths of 4 and 2 times the depth), and the largest multiple of it."""


@case("thin-layer", "Mandel and Salencon 1972", "footing of 8 cells on 2 and 4 cells of mud", is_fast=False)
def thin_layer(record: CaseRecorder) -> None:
    """Mud of a few cells flows from under a footing, since it slides on the ground at its own strength.

    Clay sticks to it: it bears its robots, and hardly flows.
    """
    figure = record.plot("Strip footing on a thin layer", "depth [cells]", "pressure over shear strength [-]")
    for depth, (exact, most) in _LAYERS.items():
        depths, pressure = footing(8, 10.0, depth=depth, material=_THIN_MUD)
        record.within(f"capacity over the exact one, {depth} cells", pressure[-1] / exact, 0.9, most)
        figure.computed(f"MPM, mud of {depth} cells", depths, pressure)
        figure.reference(f"Mandel and Salencon, {depth} cells", depths, np.full_like(depths, exact))
    exact, _most = _LAYERS[2]
    depths, pressure = footing(8, 10.0, depth=2)
    record.at_least("control: capacity of clay, which sticks, over the exact one, 2 cells", pressure[-1] / exact, 1.6)
    figure.computed("MPM, clay of 2 cells", depths, pressure)


_BLOCK_WIDTH, _BLOCK_HEIGHT, _MUD_DEPTH = 6 / 64, 3 / 64, 6 / 64
_MUD = MudMaterial(1e5, 0.3, 1400.0, yield_stress=50.0, viscosity=1.0)
_BLOCK_DENSITY = 1000.0
_PIT_WIDTH = 4 * _BLOCK_WIDTH
_SINKING_TIME, _DRAG = 4.0, 10.0
"""Of the block [s], and the rate at which its velocity and the mud's decay [1/s]."""


def sinkage() -> float:
    """How far [m] a strip of `_BLOCK_HEIGHT` sinks: Prandtl's capacity and Archimedes' buoyancy carry its weight.

    The mud that it displaces rises beside it, so that it lies deeper below the mud than it has sunk. The norm of the
    deviator is sqrt2 times the shear strength k.
    """
    capacity = PRANDTL * _MUD.yield_stress / math.sqrt(2.0)
    below_the_mud = (_BLOCK_DENSITY * GRAVITY * _BLOCK_HEIGHT - capacity) / (_MUD.density * GRAVITY)
    return below_the_mud * (1.0 - _BLOCK_WIDTH / _PIT_WIDTH)


def sinking_block(cells: int, friction: float | None, transfer: Transfer = "apic") -> tuple[Array, Array]:
    """Times [s] and distances sunk [m] of a block let down on the level surface of mud, in plane strain.

    Drag keeps it from falling: one that is let go sinks by up to twice the depth at which it can rest, and stays there.

    Args:
        cells: width of the block.
        friction: between block and mud; None for one velocity field.
        transfer: of the mud's velocity between particles and grid.
    """
    h = _BLOCK_WIDTH / cells
    edge, wide, left = h / _PER_CELL, _PIT_WIDTH, (_PIT_WIDTH - _BLOCK_WIDTH) / 2
    places = lattice((0.0, 0.0, 0.0), (wide, _MUD_DEPTH, h), edge)
    load = _MUD.density * GRAVITY * (_MUD_DEPTH - places[:, 1])
    block = lattice((left, _MUD_DEPTH, 0.0), (left + _BLOCK_WIDTH, _MUD_DEPTH + _BLOCK_HEIGHT, h), edge)
    scene = Scene(
        passive_body(ElasticMaterial(2e5, 0.3, _BLOCK_DENSITY, viscosity=20.0), block, edge**3), (0, 0, 0),
        (wide, _MUD_DEPTH + _BLOCK_HEIGHT + 4 * h, h),
        medium=replace(bed(_MUD, places, edge**3, rest_strains(_MUD, load)), friction=friction), ground=Ground(0.5),
        gravity=(0.0, -GRAVITY, 0.0),
    )  # fmt: skip
    pieces = 30
    rig = Rig(scene, h, _SINKING_TIME / pieces, medium_transfer=transfer)
    depths = []
    for _ in range(pieces + 1):
        depths.append(block[:, 1].mean() - rig.positions[rig.robot, 1].mean())
        rig.equilibrate(_DRAG, rig.steps)
    return rig.times(pieces, rig.steps), np.array(depths)


@case("sinkage", "Prandtl 1920 and Archimedes", "block of 6 and 12 x 3 and 6 cells on mud of 50 Pa", is_fast=False)
def sinkage_in_mud(record: CaseRecorder) -> None:
    """A block that is too heavy for the mud sinks until the mud's strength and its buoyancy carry it."""
    figure = record.plot("Block on mud", "time [s]", "depth [m]")
    exact = sinkage()
    coarse = 0.0
    for cells in (12, 6):
        times, depths = sinking_block(cells, 0.5)
        coarse = depths[-1]
        record.within(f"depth over the exact one, {cells} cells", coarse / exact, 0.8, 1.1)
        figure.computed(f"MPM, {cells} cells", times, depths)
    times, depths = sinking_block(6, 0.5, "aflip")
    record.within("depth over the exact one, 6 cells, AFLIP in the mud", depths[-1] / exact, 0.8, 1.1)
    figure.computed("MPM, 6 cells, AFLIP in the mud", times, depths)
    times, depths = sinking_block(6, None)
    record.at_most("control: depth in one velocity field over that in two, 6 cells", depths[-1] / coarse, 0.9)
    figure.computed("MPM, 6 cells, one velocity field", times, depths)
    figure.reference("Prandtl and Archimedes", times, np.full_like(times, exact))


def slide(degrees: float, friction: float, seconds: float = 0.4) -> tuple[Array, Array]:
    """Times [s] and speeds [m/s] of a block of 6 x 3 x 3 cells on a hard bed, tilted to an angle in the first 0.1 s."""
    h, ramp, angle = _H, 0.1, math.radians(degrees)
    block = lattice((8 * h, 3 * h, h), (14 * h, 6 * h, 4 * h), h / 2)
    hard = ClayMaterial(1e6, 0.3, 1600.0, yield_stress=1e6)
    ground = bed(hard, lattice((0.0, 0.0, 0.0), (40 * h, 3 * h, 5 * h), h / 2), h**3 / 8)
    scene = Scene(
        passive_body(ElasticMaterial(1e5, 0.2, 1000.0, viscosity=20.0), block, h**3 / 8), (0, 0, 0),
        (40 * h, 9 * h, 5 * h), medium=replace(ground, friction=friction), ground=Ground(100.0),
        gravity=(0.0, -GRAVITY * math.cos(angle), 0.0),
    )  # fmt: skip
    rig = Rig(scene, h, 0.05)
    rig.equilibrate(400.0, rig.steps)
    rig.equilibrate(100.0, rig.steps)
    every = 20
    times = rig.times(round(seconds / rig.dt / every), every)
    speeds = []
    for begin in times:
        speeds.append(float(rig.v[rig.robot, 0].mean()))
        for n in range(every):
            risen = min((begin + n * rig.dt) / ramp, 1.0)
            rig.v[rig.robot, 0] += rig.dt * GRAVITY * math.sin(angle) * (0.5 - 0.5 * math.cos(math.pi * risen))
            rig.advance(1)
    return times, np.array(speeds)


@case("bed-friction", "Coulomb 1785: tan θ = μ", "block of 6 x 3 x 3 cells on a hard bed")
def bed_friction(record: CaseRecorder) -> None:
    """A block on a hard bed rests below the critical angle, and slides above it as its friction with the bed says."""
    friction = 0.4
    figure = record.plot("Block on a hard bed", "time [s]", "speed [m/s]")
    for degrees in (15.0, 30.0):
        times, speeds = slide(degrees, friction)
        figure.computed(f"MPM, {degrees:g}°", times, speeds)
        if math.tan(math.radians(degrees)) < friction:
            record.at_most(f"speed at {degrees:g}°", float(np.abs(speeds[times > 0.15]).max()), 1e-3, "m/s")
            continue
        rate, _ = np.polyfit(times[times > 0.15], speeds[times > 0.15], 1)
        angle = math.radians(degrees)
        felt = (math.sin(angle) - rate / GRAVITY) / math.cos(angle)
        record.at_most("friction felt, relative error", abs(felt / friction - 1), 0.05)
        ideal = GRAVITY * (math.sin(angle) - friction * math.cos(angle))
        figure.reference("Coulomb, 30°", times, speeds[-1] + ideal * (times - times[-1]))
