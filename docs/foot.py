"""Measure and draw what a rigid foot meets on clay and in mud, at four grids.

`python docs/foot.py` presses a sole and a paw 3 mm into beds of weightless soil, drags them at that depth, writes the
pressures by depth and the drags into docs/foot.csv, and draws docs/foot.png. About 10 minutes of one core.
"""

import csv
from collections import defaultdict
from dataclasses import replace
from itertools import product
from pathlib import Path
from statistics import fmean

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.envs.bed import Bed
from zoobench.registry import Kind
from zoobench.render import figures
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.spec import Ref
from zoobench_verify.validate.rig import WEIGHTLESS, Rig, bed, lattice, passive_body
from zoobench_verify.validate.speed_control import SpeedControl

FILE = Path(__file__).with_suffix(".csv")
COLUMNS = ("bed", "yield_stress_Pa", "foot", "fidelity", "depth_mm", "pressure", "drag")
BEDS = {"clay": (200, 800), "wetland": (100, 400, 800)}
FEET = {"sole": (1 / 16, 1 / 32), "paw": (1 / 64, 1 / 64)}
"""Length and width [m]."""
LEVELS = ("draft", "standard", "paper", "fine")
DEPTHS = (0.0005, 0.001, 0.0015, 0.002, 0.0025, 0.00275)  # [m]; contact gives way by up to 0.1 mm of the 3 asked
DEPTH, DOWN = 0.003, 0.012  # [m], [m/s]
WAY, ALONG = 0.012, 0.1
HIGH = 1 / 32  # of the foot [m]
BESIDE = 3 / 64  # the bed around it [m]
PLACES = (0.0, 0.5)  # of its edges behind a column of nodes [cells]; what is written is the mean

Row = tuple[str, int, str, str, float, float, float]


def main() -> None:
    """Measure, write and draw."""
    rows: list[Row] = []
    for (name, stresses), level, (foot, size) in product(BEDS.items(), LEVELS, FEET.items()):
        for stress in stresses:
            found = [measured(name, stress, size, level, place) for place in PLACES]
            drag = fmean(each[1] for each in found)
            for depth, pressures in zip(DEPTHS, zip(*(each[0] for each in found), strict=True), strict=True):
                rows.append((name, stress, foot, level, 1000 * depth, round(fmean(pressures), 2), round(drag, 2)))
    rows.sort(key=lambda row: (row[0], row[1], list(FEET).index(row[2]), LEVELS.index(row[3]), row[4]))
    with FILE.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
    draw(rows)


def measured(name: str, stress: float, size: tuple[float, float], level: str, place: float) -> tuple[Array, float]:
    """Pressures at `DEPTHS` and the mean drag of a foot, both over its area and the soil's shear strength."""
    fidelity: Fidelity = registry.create(Kind.FIDELITY, Ref(level))
    layer: Bed = registry.create(Kind.ENV, Ref.parse(f"{name}[yield_stress={stress}]")).bed
    rig = Rig(scene(layer, size, fidelity.grid_spacing, place), fidelity.grid_spacing, DEPTH / DOWN / 0.9, precision=32)
    unit = stress / 2**0.5 * size[0] * size[1]
    down, along = SpeedControl(rig, 1), SpeedControl(rig, 0)
    depths, forces = np.zeros((2, rig.steps))
    for n in range(rig.steps):
        stiffen(rig)
        rig.v[rig.robot, 0] = 0.0
        down.advance(-DOWN * min(1.0, (n + 1) / (0.2 * rig.steps)))
        depths[n], forces[n] = -down.moved, -down.force
    window = max(1, rig.steps // 40)
    smooth = np.convolve(forces, np.ones(window) / window, "same") / unit
    pressures = np.interp(DEPTHS, np.maximum.accumulate(depths) + 1e-15 * np.arange(rig.steps), smooth)
    steps = round(WAY / ALONG / rig.dt)
    ways, drags = np.zeros((2, steps))
    for n in range(steps):
        stiffen(rig)
        down.push(0.0)
        along.advance(ALONG * min(1.0, (n + 1) / (0.1 * steps)))
        down.read()
        ways[n], drags[n] = along.moved, along.force
    return pressures, float(drags[ways > WAY / 3].mean()) / unit


def scene(layer: Bed, size: tuple[float, float], h: float, place: float) -> Scene:
    """A foot on a bed on rough ground, between walls without friction."""
    corner = (round(BESIDE / h) + place) * h
    wide = [2 * round(BESIDE / h) * h + each for each in size]
    top = layer.thickness
    block = lattice((corner, top, corner), (corner + size[0], top + HIGH, corner + size[1]), h / 2)
    body = passive_body(ElasticMaterial(2e5, 0.3, 1600.0), block, size[0] * size[1] * HIGH / len(block))
    soil = bed(layer.material, lattice((0.0, 0.0, 0.0), (wide[0], top, wide[1]), h / 2), (h / 2) ** 3)
    return Scene(
        body, (0, 0, 0), (wide[0], top + HIGH + 3 * h, wide[1]), medium=replace(soil, friction=layer.robot_friction),
        ground=Ground(100.0), gravity=WEIGHTLESS,
    )  # fmt: skip


def stiffen(rig: Rig) -> None:
    """Let the foot move as one, and not sideways."""
    mean = rig.v[rig.robot].mean(0)
    rig.v[rig.robot] = (mean[0], mean[1], 0.0)
    rig.C[rig.robot] = 0.0


def draw(rows: list[Row]) -> None:
    """Pressure by depth on the default soils, a panel for each foot and a line for each grid."""
    figure = figures.blank((8.0, 3.2))
    panels = [(name, stresses[-1], foot) for (name, stresses), foot in product(BEDS.items(), FEET)]
    for count, panel in enumerate(panels, 1):
        axes = figure.add_subplot(1, len(panels), count)
        lines = defaultdict(list)
        for row in rows:
            if row[:3] == panel:
                lines[row[3]].append(row[4:6])
        for level, points in lines.items():
            axes.plot(*zip((0.0, 0.0), *points, strict=True), marker="o", markersize=3, label=level)
        axes.set_ylim(0.0, 11.5)
        axes.set_title(f"{panel[0]} of {panel[1]} Pa, {panel[2]}", fontsize=9)
        axes.set_xlabel("depth [mm]", fontsize=8)
        axes.tick_params(labelsize=7)
        if count == 1:
            axes.set_ylabel("pressure over shear strength [-]", fontsize=8)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    figures.save(figure, FILE.with_suffix(".png"))


if __name__ == "__main__":
    main()
