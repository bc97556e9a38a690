"""Where a robot meets a medium: sinkage in mud, and Coulomb friction on a bed."""

import math
from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Transfer
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench_verify.cases import CaseRecorder, case
from zoobench_verify.validate.footings import PRANDTL
from zoobench_verify.validate.rig import GRAVITY, Rig, bed, lattice, passive_body

_H = 1 / 64
_PER_CELL = 2

_BLOCK_WIDTH, _BLOCK_HEIGHT, _MUD_DEPTH = 6 / 64, 3 / 64, 6 / 64
_MUD = MudMaterial(1e5, 0.3, 1400.0, yield_stress=50.0, viscosity=1.0)
_BLOCK_DENSITY = 1000.0
_PIT_WIDTH = 4 * _BLOCK_WIDTH
_SINKING_TIME, _DRAG = 4.0, 10.0
"""Sinking time of the block [s], and the rate at which its velocity and the mud's decay [1/s]."""


def sinkage() -> float:
    """How far [m] a strip of `_BLOCK_HEIGHT` sinks: Prandtl's capacity and Archimedes' buoyancy carry its weight.

    The mud that it displaces rises around it, so that it lies deeper below the mud than it has sunk. The norm of the
    deviator is sqrt2 times the shear strength k.
    """
    capacity = PRANDTL * _MUD.yield_stress / math.sqrt(2.0)
    below_the_mud = (_BLOCK_DENSITY * GRAVITY * _BLOCK_HEIGHT - capacity) / (_MUD.density * GRAVITY)
    return below_the_mud * (1.0 - _BLOCK_WIDTH / _PIT_WIDTH)


def sinking_block(cells: int, friction: float | None, transfer: Transfer = "apic") -> tuple[Rig, Array, Array]:
    """A block let down on the level surface of mud, in plane strain: the rig at the end, times [s] and depths [m].

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
        medium=replace(bed(_MUD, places, edge**3, _MUD.rest_strains(load)), friction=friction), ground=Ground(0.5),
        gravity=(0.0, -GRAVITY, 0.0),
    )  # fmt: skip
    pieces = 30
    rig = Rig(scene, h, _SINKING_TIME / pieces, medium_transfer=transfer)
    depths = []
    for _ in range(pieces + 1):
        depths.append(block[:, 1].mean() - rig.positions[rig.robot, 1].mean())
        rig.equilibrate(_DRAG, rig.steps)
    return rig, rig.times(pieces, rig.steps), np.array(depths)


def pressure_noise(rig: Rig) -> tuple[float, float]:
    """How unevenly the pressure of a medium in plane strain is spread, over its mean: within cells, and between them.

    The first is the root mean square of what particles differ by from the mean of their cell, large where they lock.
    The second is that of the part that alternates from cell to cell, a checkerboard.
    """
    pressure = -rig.medium_stress[:, :3].mean(axis=1)
    cells = np.floor(rig.positions[rig.medium] / rig.grid_spacing).astype(int)[:, :2]
    place = tuple((cells - cells.min(axis=0)).T)
    count = np.zeros(np.max(place, axis=1) + 1)
    total = np.zeros_like(count)
    np.add.at(count, place, 1.0)
    np.add.at(total, place, pressure)
    means = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0.0)
    second = [means[:-2] - 2.0 * means[1:-1] + means[2:], means[:, :-2] - 2.0 * means[:, 1:-1] + means[:, 2:]]
    alternating = np.concatenate([each[np.isfinite(each)] for each in second]) / 4.0  # of +a, -a, +a it is 4 a
    within = pressure - means[place]
    mean = pressure.mean()
    return math.sqrt((within**2).mean()) / mean, math.sqrt((alternating**2).mean()) / mean


@case("sinkage", "Prandtl 1920 and Archimedes", "block of 6 and 12 x 3 and 6 cells on mud of 50 Pa", is_fast=False)
def sinkage_in_mud(record: CaseRecorder) -> None:
    """A block that is too heavy for the mud sinks until the mud's strength and its buoyancy carry it."""
    figure = record.plot("Block on mud", "time [s]", "depth [m]")
    exact = sinkage()
    coarse = 0.0
    for cells in (12, 6):
        rig, times, depths = sinking_block(cells, 0.5)
        coarse = depths[-1]
        record.within(f"depth over the exact one, {cells} cells", coarse / exact, 0.8, 1.1)
        within, alternating = pressure_noise(rig)
        record.at_most(f"scatter of pressure within a cell over its mean, {cells} cells", within, 0.2)
        record.at_most(f"pressure that alternates from cell to cell over its mean, {cells} cells", alternating, 0.05)
        figure.computed(f"MPM, {cells} cells", times, depths)
    _, times, depths = sinking_block(6, 0.5, "aflip")
    record.within("depth over the exact one, 6 cells, AFLIP in the mud", depths[-1] / exact, 0.8, 1.1)
    figure.computed("MPM, 6 cells, AFLIP in the mud", times, depths)
    _, times, depths = sinking_block(6, None)
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
