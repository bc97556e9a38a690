"""Measure the scores of robots in their rest frame beside those of today's, at every grid.

`python docs/rest_frame.py` evaluates the best gaits that move or turn four animals on firm ground, and writes each
score into docs/rest-frame.csv as it comes. What the file has already is not done again. About two hours of one core,
nearly all of it at `fine` and `reference`.
"""

import csv
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.db import published
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref

FILE = Path(__file__).with_name("rest-frame.csv")
COLUMNS = ("env", "task", "design", "frames", "robot", "fidelity", "score")
ANIMALS = ("caterpillar", "baby-seal", "panda", "fish")
ROBOTS = ("mpm", "lagrangian")
LEVELS = ("draft", "standard", "paper", "fine", "reference")
LONG = ("ground", "movement-speed", "caterpillar", "600")
PLACES = [
    *((env, "movement-speed", animal, "100") for env in ("ground", "ice") for animal in ANIMALS),
    *(("ground", "turning", animal, "100") for animal in ANIMALS),
    LONG,
]

Place = tuple[str, ...]


def main() -> None:
    """Measure what is not known."""
    known = read()
    for level, robot, place in product(LEVELS, ROBOTS, PLACES):
        row = (*place, robot, level)
        if row not in known and not (place == LONG and level in LEVELS[3:]):
            known[row] = measured(*row)
            write(known)


def measured(env: str, task: str, animal: str, frames: str, robot: str, level: str) -> str:
    """Score of a published gait [m/s]; empty for a robot that tore."""
    gait = published.named(f"best:{env}/{task}/{animal}")
    spec = replace(
        gait.spec, env=registry.resolve(Kind.ENV, Ref(env)), design=registry.resolve(Kind.DESIGN, Ref(animal)),
        fidelity=registry.resolve(Kind.FIDELITY, Ref.parse(f"{level}[robot={robot}]")), frames=int(frames),
        budget=Budget.parse("2 episodes"),
    )  # fmt: skip
    found = Problem(spec, worlds=1).evaluate(np.array(gait.params))
    return "" if found.failure else f"{found.score:.4f}"


def read() -> dict[Place, str]:
    """Scores in the file by their other columns."""
    if not FILE.exists():
        return {}
    with FILE.open(encoding="utf-8", newline="") as file:
        rows = [tuple(row[name] for name in COLUMNS) for row in csv.DictReader(file)]
    return {row[:-1]: row[-1] for row in rows}


def write(known: dict[Place, str]) -> None:
    """The file anew, in the order of the lists above."""
    order: dict[Place, int] = {
        (*place, robot, level): n for n, (place, robot, level) in enumerate(product(PLACES, ROBOTS, LEVELS))
    }
    rows = sorted(known.items(), key=lambda row: order[row[0]])
    with FILE.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *((*place, found) for place, found in rows)])


if __name__ == "__main__":
    main()
