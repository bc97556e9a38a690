"""Water: pressure at rest, the collapse of a column, and bodies that float and sink.

All are plane: one cell between walls, so that all nodes lie on walls.
"""

import math
from dataclasses import replace
from itertools import product

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.rig import GRAVITY, Rig, bed, dust, lattice, passive_body

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
    return np.bincount(row, material.pressure(J) / J) / np.bincount(row)


def _settled(cells: int) -> tuple[Rig, Array, Array]:
    """A column of water, 1 m and `cells` deep, settled under drag and then free for two periods.

    Returns:
        the rig, and by rows of cells the heights [m] and the pressures' errors over rho g H [-].
    """
    deep, wide = 1.0, 4
    h, material = deep / cells, _water(deep, 0.1)
    points = lattice((0, 0, 0), (wide * h, deep, h), (h / 2, h / 2, h))
    scene = Scene(
        dust((wide * h / 2, deep / 2, h / 2), h), (0, 0, 0), (wide * h, deep + 8 * h, h),
        medium=bed(material, points, h**3 / 4), ground=Ground(0.0),
    )  # fmt: skip
    speed = math.sqrt(material.bulk_modulus / _DENSITY)
    rig = Rig(scene, h, 4 * deep / speed)
    rig.equilibrate(math.pi * speed / deep, 4 * rig.steps)
    rig.advance(2 * rig.steps)
    row = np.floor(points[:, 1] / h).astype(int)
    found = _rows(rig, material, row)
    height = np.bincount(row, rig.positions[rig.medium, 1]) / np.bincount(row)
    exact = _DENSITY * GRAVITY * (deep - (np.arange(cells) + 0.5) * h)
    return rig, height, (found - exact) / (_DENSITY * GRAVITY * deep)


@case("hydrostatic-column", "weight of the water above", "32 cells deep, and 3 to 6; Mach 0.1")
def hydrostatic(record: CaseRecorder) -> None:
    """Water without initial pressure is brought to rest under drag and then simulated freely for two periods."""
    cells = 32
    rig, height, error = _settled(cells)
    coarse = max(float(np.abs(_settled(few)[2]).max()) * few for few in (3, 4, 6))
    above = 1 - (np.arange(cells) + 0.5) / cells
    speeds = np.linalg.norm(rig.v[rig.medium], axis=1)
    record.at_most(
        "largest error of a row's pressure over rho g h, the floor's included", np.abs(error).max() * cells, 0.05
    )
    record.within("slope of the pressure over rho g", np.polyfit(above, above + error, 1)[0], 0.998, 1.002)
    record.at_most("residual speed over sqrt(g H)", math.sqrt((speeds**2).mean() / GRAVITY), 1e-10)
    record.at_most("the same over rho g h at 3, 4, 6 cells", coarse, 0.05)
    figure = record.plot("Water at rest, 32 cells deep", "height [m]", "pressure over ρ g H [-]")
    figure.computed("MPM, mean of a row", height, above + error, points=True)
    figure.reference("weight above", height, above)


# Martin and Moyce 1952, square-root time scale, n² = 2, a = 2.25 in: T = t sqrt(2 g / a) and front Z = x / a
_FRONT = np.array([
    (0.832, 1.217), (1.219, 1.474), (1.997, 2.292), (2.547, 2.995), (3.345, 4.134), (4.034, 4.944), (4.418, 5.881),
    (5.091, 6.980), (5.685, 7.945), (6.306, 8.966), (6.822, 9.986), (7.439, 10.963), (8.031, 11.977), (8.633, 13.005),
    (9.237, 13.970),
])  # fmt: skip
_REPEATABILITY = 0.09
"""Largest difference between the fronts of the experiment's two sizes, 1.125 and 2.25 in, at equal T [-]."""


def _collapse(cells: int) -> tuple[Array, Array, float]:
    """T, Z and the largest compression 1 - J before T = 3.7 of a column twice as high as wide, `cells` wide."""
    a, mach, pieces = 0.05715, 0.1, 200
    h, material = a / cells, _water(4 * a, mach)  # a front may run at 2 sqrt(g H), H = 2 a
    points = lattice((0, 0, 0), (a, 2 * a, h), (h / 2, h / 2, h))
    strains = _hydrostatic_strain(material, 2 * a - points[:, 1])
    scene = Scene(
        dust((a / 2, a, h / 2), h), (0, 0, 0), (20 * a, 2.5 * a, h),
        medium=bed(material, points, h**3 / 4, strains), ground=Ground(0.0),
    )  # fmt: skip
    unit = math.sqrt(a / (2 * GRAVITY))
    rig = Rig(scene, h, 9.4 * unit)
    piece = rig.steps // pieces
    front, pressed = [1.0], []
    for _ in range(pieces):
        rig.advance(piece)
        front.append(float(rig.positions[rig.medium, 0].max() + h / 4) / a)
        pressed.append(1 - float(rig.history.min()))
    T = rig.times(pieces, piece) / unit
    return T, np.array(front), float(np.max(pressed, where=T[1:] < 3.7, initial=0.0))


@case(
    "dam-break",
    "Martin & Moyce 1952, Phil. Trans. R. Soc. A 244, 312-324; Ritter 1892",
    "column of 16 x 32 cells, and of 4 x 8; Mach 0.1",
    is_fast=False,
)
def dam_break(record: CaseRecorder) -> None:
    """The front of a column twice as high as wide, against all fifteen points of the experiment, by its own clock.

    The experiment's gate opened slowly and its floor had friction, so that it must lie behind. A front without friction
    tends to 2 sqrt(g H) (Ritter), which is dZ/dT = 2.
    """
    times, fronts = _FRONT.T
    T, Z, pressed = _collapse(16)
    few_T, few_Z, _ = _collapse(4)
    found = np.interp(times, T, Z)
    raw = found / fronts - 1
    coarse = np.interp(times, few_T, few_Z) / found - 1
    late = T > 5
    speed, measured = (
        float(np.polyfit(t, z, 1)[0]) for t, z in ((T[late], Z[late]), (times[times > 5], fronts[times > 5]))
    )
    record.at_most(
        "front at the experiment's times, rms relative error", math.sqrt((raw**2).mean()), _REPEATABILITY,
        shortfall=Shortfall("the column is released at once and on a floor without friction", 0.14),
    )  # fmt: skip
    record.within("speed of the front dZ/dT, T > 5: the experiment's to Ritter's", speed, measured, 2.0)
    record.at_most("front of a column of 4 x 8 cells off it, rms relative", math.sqrt((coarse**2).mean()), 0.1)
    record.at_most("largest compression 1 - J of the water, T < 3.7", pressed, 0.013)
    record.remark(f"errors at the fifteen points {', '.join(f'{error:+.0%}' for error in raw)}")
    figure = record.plot("Dam break, column of 16 x 32 cells", "T = t sqrt(2 g / a) [-]", "front Z = x / a [-]")
    figure.computed("MPM", T, Z)
    figure.computed("MPM, column of 4 x 8 cells", few_T, few_Z)
    figure.reference("Martin & Moyce 1952", times, fronts, points=True)


_STICKS = "water and body share one velocity field, so that water sticks to the body"
_THICK = "water of particles is thicker than real water even where it slips along the body"
_RAFT = 1.6
"""Width of a floating block over its height: a square one does not float upright."""


def _float(ratio: float, cells: int, raised: float, *, depth: float = 1.5, slip: bool = True) -> float:
    """Draft over height of a block of a density ratio, released `raised` heights above it, damped and then free.

    Archimedes: the draft is the density ratio. It is measured from the block's lowest layer to the level of the water
    away from the block.
    """
    side = 0.1
    bottom = depth - ratio + raised
    rig, block, h = _immersed(ratio, cells, depth=depth, bottom=bottom, periods=12, wide=_RAFT, slip=slip)
    rig.equilibrate(2 * math.sqrt(GRAVITY / side), rig.steps)
    rig.advance(2 * rig.steps)
    places = rig.positions
    lowest = places[rig.robot][block[:, 1] < block[:, 1].min() + h / 4, 1].mean() - h / 4
    water = places[rig.medium]
    away = np.abs(water[:, 0] - 2 * side) > _RAFT * side / 2 + 3 * h
    columns = np.floor(water[away, 0] / h).astype(int)
    tops = [water[away, 1][columns == c].max() for c in np.unique(columns)]
    return float(np.mean(tops) + h / 4 - lowest) / side


def _immersed(
    ratio: float, cells: int, *, depth: float, bottom: float, periods: float, wide: float = 1.0, slip: bool = False
) -> tuple[Rig, Array, float]:
    """A block 0.1 m high in a tank four times as wide: the rig, the block's positions, and the spacing [m].

    Args:
        ratio: of the densities of block and water.
        cells: along the block's height, its side.
        depth, bottom: of the water, and the height of the block's lower side, in sides.
        periods: length of the rig's run in units of sqrt(side / g).
        wide: width of the block, in sides.
        slip: as in shallow water: both have velocity fields of their own, and the water's transfer is AFLIP.
    """
    side = 0.1
    h, deep, tank, low, half = side / cells, depth * side, 4 * side, bottom * side, wide * side / 2
    material = _water(deep, 0.1)
    points = lattice((0, 0, 0), (tank, deep, h), (h / 2, h / 2, h))
    points, volumes = _around(points, np.array([tank / 2 - half, low]), np.array([tank / 2 + half, low + side]), h)
    block = lattice((tank / 2 - half, low, 0), (tank / 2 + half, low + side, h), (h / 2, h / 2, h))
    solid = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=ratio * _DENSITY)
    water = bed(material, points, volumes, _hydrostatic_strain(material, deep - points[:, 1]))
    if slip:
        water = replace(water, friction=0.0, transfer="aflip")
    scene = Scene(
        passive_body(solid, block, h**3 / 4), (0, 0, 0), (tank, deep + 1.5 * side, h), medium=water, ground=Ground(0.0)
    )
    return Rig(scene, h, periods * math.sqrt(side / GRAVITY)), block, h


def _around(points: Array, low: Array, high: Array, h: float) -> tuple[Array, Array]:
    """The rest that a block leaves of particles that stand for squares of half a cell: centroids [m] and volumes [m^3].

    Args:
        points: centres of the squares `[n, 3]` [m].
        low, high: corners of the block `[2]` [m].
        h: edge of a cell, and thickness of the slab [m].
    """
    near, far = (np.clip(points[:, :2] + side * h / 4, low, high) for side in (-1, 1))
    taken = np.prod(far - near, axis=1) / (h / 2) ** 2
    left = taken < 0.98
    taken, middle = taken[left, None], (near + far)[left] / 2
    found = points[left]
    found[:, :2] = (found[:, :2] - taken * middle) / (1.0 - taken)
    return found, (1.0 - taken[:, 0]) * h**3 / 4


@case("buoyancy", "Archimedes' principle", "blocks of 8 x 5 cells in a tank of 20 x 7.5, Mach 0.1", is_fast=False)
def buoyancy(record: CaseRecorder) -> None:
    """Drafts of blocks released two cells above and below their floating position."""
    cells, ratios, raised = 5, np.array([0.3, 0.45, 0.6]), (0.4, -0.4)

    def afloat(depth: float) -> Array:
        return np.array([[_float(ratio, cells, start, depth=depth) for ratio in ratios] for start in raised])

    drafts, deeper = afloat(1.5), afloat(1.6)
    for words, found in (("", drafts), (", in water half a cell deeper", deeper)):
        error = np.abs(found - ratios).max() * cells
        record.at_most(f"largest error of the draft, of 2 cells at first{words}", error, 0.25, "cells")
    stuck = abs(_float(0.6, cells, -0.4, slip=False) - 0.6) * cells
    record.at_least("control: error in one velocity field at 0.6, from below", stuck, 0.5, "cells")
    figure = record.plot("Floating blocks", "density of the block over that of water [-]", "draft over side [-]")
    for row, start in zip(drafts, raised, strict=True):
        figure.computed(f"MPM, released {start:+g} sides above", ratios, row, points=True)
    figure.reference("Archimedes", np.array([0.2, 0.8]), np.array([0.2, 0.8]))


@case(
    "sinking-stone",
    "buoyancy and added mass 1.19 rho b² of a square across the stream (Newman 1977, Marine hydrodynamics)",
    "blocks of 5 x 5 cells in a tank of 20 x 20",
    is_fast=False,
)
def sinking(record: CaseRecorder) -> None:
    """Blocks heavier than water, released at rest in deep water, sink with g (r - 1) / (r + 1.19) at first.

    In half a length of sqrt(side / g) they move by a tenth of the side, and drag is yet small; the walls are 1.5 sides
    away and slow them by a few per cent.
    """
    side, ratios = 0.1, (1.15, 2.0)
    figure = record.plot("Blocks sinking from rest", "time [s]", "distance sunk [m]")
    ways = (("in one velocity field", False, Shortfall(_STICKS, 0.1)), ("in two", True, Shortfall(_THICK, 0.5)))
    for (fields, slip, shortfall), ratio in product(ways, ratios):
        rig, block, _ = _immersed(ratio, 5, depth=4.0, bottom=1.5, periods=1.5, slip=slip)
        pieces = 12
        sunk = [0.0]
        for _ in range(pieces):
            rig.advance(rig.steps // pieces)
            sunk.append(float(block[:, 1].mean() - rig.positions[rig.robot, 1].mean()))
        t = rig.times(pieces, rig.steps // pieces)
        exact = GRAVITY * (ratio - 1) / (ratio + 1.19) * t**2 / 2
        record.within(
            f"distance sunk in {t[-1] / math.sqrt(side / GRAVITY):.1f} sqrt(b / g) over the closed form's, "
            f"density ratio {ratio:g}, {fields}", sunk[-1] / exact[-1], 0.8, 1.1, shortfall=shortfall,
        )  # fmt: skip
        figure.computed(f"MPM, density ratio {ratio:g}, {fields}", t, np.array(sunk), points=True)
        if slip:
            figure.reference(f"closed form, {ratio:g}", t, exact)
