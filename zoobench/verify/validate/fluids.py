"""Water: pressure at rest, the collapse of a column, and a floating body.

All are plane: one cell between walls, so that all nodes lie on walls.
"""

import math

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws_numpy import water_pressure
from zoobench.sim.model.matter import ElasticMaterial, WaterMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.verify.cases import CaseRecorder, case
from zoobench.verify.validate.rig import GRAVITY, Rig, bed, dust, lattice, passive_body

_DENSITY = 1000.0


def _water(head: float, mach: float) -> WaterMaterial:
    """Water whose speed of sound is the speed of free fall from `head` [m] over `mach`."""
    return WaterMaterial(bulk_modulus=_DENSITY * 2 * GRAVITY * head / mach**2, density=_DENSITY)


def _hydrostatic_strain(material: WaterMaterial, depth: Array) -> Array:
    """Hencky strains `[.., 3]` of water at rest at a depth [m]: the Tait pressure carries the weight above."""
    pressure = material.density * GRAVITY * depth
    log_j = -np.log1p(material.exponent * pressure / material.bulk_modulus) / material.exponent
    return np.stack([log_j / 3] * 3, axis=-1)


def _rows(rig: Rig, material: WaterMaterial, row: Array) -> Array:
    """Mean pressure [Pa] of the particles by their initial row of cells."""
    J = rig.history.astype(float)
    return np.bincount(row, water_pressure(material, J) / J) / np.bincount(row)


@case("hydrostatic-column", "weight of the water above", "32 cells deep, Mach 0.1")
def hydrostatic(record: CaseRecorder) -> None:
    """Water without initial pressure is brought to rest under drag and then simulated freely for two periods.

    The two rows of cells on the floor are left out: the floor truncates the stencils of the lowest particles, which
    receive 59/64 of the pressure gradient and so have 64/59 of the pressure; the next row balances the difference.
    """
    cells, wide, mach = 32, 4, 0.1
    h, material = 1 / cells, _water(1.0, mach)
    points = lattice((0, 0, 0), (wide * h, 1.0, h), (h / 2, h / 2, h))
    scene = Scene(
        dust((wide * h / 2, 0.5, h / 2), h), (0, 0, 0), (wide * h, 1.25, h),
        medium=bed(material, points, h**3 / 4), ground=Ground(0.0),
    )  # fmt: skip
    speed = math.sqrt(material.bulk_modulus / _DENSITY)
    period = 4 / speed
    rig = Rig(scene, h, period)
    rig.equilibrate(math.pi * speed, 4 * rig.steps)
    rig.advance(2 * rig.steps)
    row = np.floor(points[:, 1] / h).astype(int)
    found = _rows(rig, material, row)
    height = np.bincount(row, rig.positions[rig.medium, 1]) / np.bincount(row)
    above = 1 - (np.arange(cells) + 0.5) * h
    exact = _DENSITY * GRAVITY * above
    head = _DENSITY * GRAVITY
    inner = slice(2, None)
    error = float(np.sqrt(np.mean((found - exact)[inner] ** 2))) / head
    slope = float(np.polyfit(above[inner], found[inner], 1)[0]) / head
    speeds = np.linalg.norm(rig.v[rig.medium], axis=1)
    record.at_most("pressure of cells above the second, rms error over rho g H", error, 1e-3)
    record.within("slope of the pressure over rho g", slope, 0.995, 1.005)
    record.at_most("residual speed over sqrt(g H)", float(np.sqrt((speeds**2).mean())) / math.sqrt(GRAVITY), 1e-2)
    figure = record.plot("Water at rest, 32 cells deep", "height [m]", "pressure [kPa]")
    figure.computed("MPM, mean of a row", height, found / 1e3, points=True)
    figure.reference("weight above", height, exact / 1e3)


# Martin and Moyce 1952, square-root time scale, n² = 2, a = 2.25 in: T = t sqrt(2 g / a) and front Z = x / a
_FRONT = np.array([
    (0.832, 1.217), (1.219, 1.474), (1.997, 2.292), (2.547, 2.995), (3.345, 4.134),
])  # fmt: skip


@case(
    "dam-break",
    "Martin & Moyce 1952, Phil. Trans. R. Soc. A 244, 312-324",
    "column of 32 x 64 cells, Mach 0.1",
    is_fast=False,
)
def dam_break(record: CaseRecorder) -> None:
    """A column twice as high as wide is released at once; the experiment's gate opened slowly, so the clock is shifted.

    Checked are the shift that fits best, the remaining error, and the speed of the front, which needs no shift.
    """
    cells, a, mach = 32, 0.05715, 0.1
    h, material = a / cells, _water(4 * a, mach)  # a front may run at 2 sqrt(g H), H = 2 a
    points = lattice((0, 0, 0), (a, 2 * a, h), (h / 2, h / 2, h))
    strains = _hydrostatic_strain(material, 2 * a - points[:, 1])
    scene = Scene(
        dust((a / 2, a, h / 2), h), (0, 0, 0), (6 * a, 2.5 * a, h),
        medium=bed(material, points, h**3 / 4, strains), ground=Ground(0.0),
    )  # fmt: skip
    unit = math.sqrt(a / (2 * GRAVITY))
    rig = Rig(scene, h, 3.7 * unit)
    pieces = 100
    piece = rig.steps // pieces
    front, pressed = [1.0], []
    for _ in range(pieces):
        rig.advance(piece)
        front.append(float(rig.positions[rig.medium, 0].max() + h / 4) / a)
        pressed.append(1 - float(rig.history.min()))
    T, Z = rig.times(pieces, piece) / unit, np.array(front)
    times, fronts = _FRONT.T

    def misfit(shift: float) -> float:
        return float(np.sqrt(np.mean((np.interp(times - shift, T, Z) / fronts - 1) ** 2)))

    shifts = np.linspace(-0.4, 0.6, 201)
    best = float(min(shifts, key=misfit))
    steady = (T > 2) & (T < 3)
    speed = float(np.polyfit(T[steady], Z[steady], 1)[0])
    record.at_most("front after the best shift of the clock, rms relative error", misfit(best), 0.03)
    record.within("that shift, in units of sqrt(a / 2 g)", best, -0.35, 0.35)
    record.within("speed of the front dZ/dT, 2 < T < 3", speed, 1.35, 1.5)
    record.at_most("largest compression 1 - J of the water", max(pressed), 0.013)
    figure = record.plot("Dam break, column of 32 x 64 cells", "T = t sqrt(2 g / a) [-]", "front Z = x / a [-]")
    figure.computed("MPM", T, Z)
    figure.computed(f"MPM, {best:.2f} later", (T + best)[T + best < 3.7], Z[T + best < 3.7])
    figure.reference("Martin & Moyce 1952", times, fronts, points=True)


def _draft(ratio: float) -> float:
    """Draft over side of a square block of a density ratio in equilibrium in a tank four sides wide.

    Archimedes: the draft is the density ratio. It is measured from the block's lowest layer to the level of the water
    away from the block.
    """
    side, cells = 0.1, 10
    h, deep, wide = side / cells, 1.5 * side, 4 * side
    material = _water(deep, 0.1)
    middle, bottom = wide / 2, deep - ratio * side
    points = lattice((0, 0, 0), (wide, deep, h), (h / 2, h / 2, h))
    inside = (np.abs(points[:, 0] - middle) < side / 2) & (points[:, 1] > bottom)
    points = points[~inside]
    block = lattice((middle - side / 2, bottom, 0), (middle + side / 2, bottom + side, h), (h / 2, h / 2, h))
    solid = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=ratio * _DENSITY)
    scene = Scene(
        passive_body(solid, block, h**3 / 4), (0, 0, 0), (wide, deep + 1.5 * side, h),
        medium=bed(material, points, h**3 / 4, _hydrostatic_strain(material, deep - points[:, 1])), ground=Ground(0.0),
    )  # fmt: skip
    rig = Rig(scene, h, 12 * math.sqrt(side / GRAVITY))
    rig.equilibrate(2 * math.sqrt(GRAVITY / side), rig.steps)
    places = rig.positions
    lowest = places[rig.robot][block[:, 1] < bottom + h / 2, 1].mean() - h / 4
    water = places[rig.medium]
    away = np.abs(water[:, 0] - middle) > side / 2 + 3 * h
    columns = np.floor(water[away, 0] / h).astype(int)
    tops = [water[away, 1][columns == c].max() for c in np.unique(columns)]
    return float(np.mean(tops) + h / 4 - lowest) / side


@case("buoyancy", "Archimedes' principle", "block of 10 x 10 cells in a tank of 40 x 15, Mach 0.1", is_fast=False)
def buoyancy(record: CaseRecorder) -> None:
    """Drafts of floating blocks of four densities."""
    ratios = np.array([0.3, 0.5, 0.7, 0.9])
    drafts = np.array([_draft(ratio) for ratio in ratios])
    record.at_most("error of the draft in cells", float(np.abs(drafts - ratios).max()) * 10, 0.25, "cells")
    figure = record.plot(
        "Floating block, 10 cells wide", "density of the block over that of water [-]", "draft over side [-]"
    )
    figure.computed("MPM", ratios, drafts, points=True)
    figure.reference("Archimedes", np.array([0.2, 1.0]), np.array([0.2, 1.0]))
