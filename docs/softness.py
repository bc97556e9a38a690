"""Measure and draw how scores on clay and in mud depend on the grid as the soil softens.

`python docs/softness.py` evaluates the best gaits of `gaits` that move four animals, found on sand and on clay, on
softer and softer beds, writes each score into docs/softness.csv as it comes, and draws docs/softness.png. What the file
has already is not done again. A gait that tears is simulated once more with 27 particles in a cell in place of 8. About
an hour of one core.
"""

import csv
from collections import defaultdict
from dataclasses import replace
from itertools import product
from pathlib import Path
from statistics import fmean

import numpy as np

from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.db import published
from zoobench.registry import Kind
from zoobench.render import figures
from zoobench.spec import Budget, Ref

FILE = Path(__file__).with_suffix(".csv")
COLUMNS = ("bed", "yield_stress_Pa", "design", "found_on", "fidelity", "score_mm_s")
BEDS = {"clay": (200, 400, 800, 1600, 3200), "wetland": (200, 400, 800)}
ANIMALS = ("caterpillar", "panda", "baby-seal", "fish")
LEVELS = ("draft", "standard", "paper")
FRAMES = 100


def main() -> None:
    """Measure what is not known, and draw."""
    known = read()
    for level, (bed, stresses) in product(LEVELS, BEDS.items()):
        for stress, animal, found_on in product(stresses, ANIMALS, ("desert", "clay")):
            place = (bed, str(stress), animal, found_on, level)
            if place not in known and (score := measured(*place)) is not None:
                known[place] = score
                write(known)
    draw(known)


def measured(bed: str, stress: str, animal: str, found_on: str, level: str) -> float | None:
    """Score [mm/s] of a published gait on a bed that yields at this stress [Pa]; None if it tears there."""
    gait = published.named(f"best:gaits/{found_on}/movement-speed/{animal}")
    spec = replace(
        gait.spec, env=registry.resolve(Kind.ENV, Ref.parse(f"{bed}[yield_stress={stress}]")),
        design=registry.resolve(Kind.DESIGN, Ref(animal)), frames=FRAMES, budget=Budget.parse("2 episodes"),
    )  # fmt: skip
    for name in (level, f"{level}[particles_per_cell=27]"):
        fidelity = registry.resolve(Kind.FIDELITY, Ref.parse(name))
        found = Problem(replace(spec, fidelity=fidelity), worlds=1).evaluate(np.array(gait.params))
        if not found.failure:
            return round(1000.0 * found.score, 1)
    return None


def read() -> dict[tuple[str, ...], float]:
    """The scores in the file by their other columns."""
    if not FILE.exists():
        return {}
    with FILE.open(encoding="utf-8", newline="") as file:
        return {tuple(row[name] for name in COLUMNS[:-1]): float(row[COLUMNS[-1]]) for row in csv.DictReader(file)}


def write(known: dict[tuple[str, ...], float]) -> None:
    """The file anew, sorted."""
    order = {name: place for names in (BEDS, ANIMALS, LEVELS) for place, name in enumerate(names)}
    rows = sorted(
        known.items(), key=lambda row: [order.get(word, int(word) if word.isdigit() else 0) for word in row[0]]
    )
    with FILE.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *((*place, score) for place, score in rows)])


def draw(known: dict[tuple[str, ...], float]) -> None:
    """Scores at `draft` and `standard` over those at `paper` by the yield stress, a line for each animal."""
    figure = figures.blank((8.0, 3.6))
    panels = list(product(BEDS, LEVELS[:-1]))
    for place, (bed, level) in enumerate(panels):
        axes = figure.add_subplot(1, len(panels), place + 1)
        for animal in ANIMALS:
            ratios = defaultdict(list)
            for (b, stress, design, found_on, at), score in known.items():
                reference = known.get((b, stress, design, found_on, LEVELS[-1]))
                if (b, design, at) == (bed, animal, level) and reference:
                    ratios[int(stress)].append(score / reference)
            stresses = sorted(ratios)
            axes.plot(stresses, [fmean(ratios[stress]) for stress in stresses], marker="o", markersize=3, label=animal)
        axes.axhline(1.0, color="0.5", linewidth=0.8)
        axes.set_xscale("log")
        axes.set_xticks(BEDS[bed], labels=map(str, BEDS[bed]))
        axes.minorticks_off()
        axes.set_ylim(0.3, 2.6)
        axes.set_title(f"{bed}, {level}", fontsize=9)
        axes.set_xlabel("yield stress [Pa]", fontsize=8)
        axes.tick_params(labelsize=7)
        if place == 0:
            axes.set_ylabel("score over that at paper", fontsize=8)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    figures.save(figure, FILE.with_suffix(".png"))


if __name__ == "__main__":
    main()
