"""The published results of the accuracy study: errors and costs of each level."""

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from zoobench.spec import Ref

PUBLISHED = "published.json"
"""The results, in the folder of this file; `zoobench verify accuracy show --publish` writes them."""


@dataclass(frozen=True)
class KeptOrders:
    """Which orders of two scores hold at a fidelity.

    Attributes:
        ratio: the least ratio of two scores above which their order is known to hold; 1 if it does at all, None if
            none is known.
        pairs: of gaits that were compared.
        bodies: designs whose gaits these are.
    """

    ratio: float | None
    pairs: int
    bodies: tuple[str, ...]


@dataclass(frozen=True)
class LevelRow:
    """The gaits of one environment and task at one fidelity. None stands for a value that was not measured.

    Attributes:
        fidelity: its name, with the parameters that are not the default ones.
        components: environment, task and fidelity with version and every parameter.
        bodies: the designs, and by how much the scores of each are off: their error, and in quadrature the uncertainty
            of their references where that was measured.
        gaits, runs: numbers of gaits that were evaluated, and of the runs that trained them.
        error: of the score, as a share.
        unknown: uncertainty of the reference itself, as a share; None if one body's was not measured.
        checked: number of gaits whose reference was held against a finer grid.
        low, median, high: of the ratios of scores to their references: the 10th, 50th and 90th percentile.
        transfer: of the gaits found at this level, the median ratio of reference to score.
        one_body, two_bodies: which orders are the references', of gaits of one body, and of two that were trained in
            the same way.
        angle: 1 - cosine between the gradient and that at the finest level with gradients, mean over gaits.
        substeps: per simulated second.
        seconds, gradient_seconds: CPU time per simulated second [s], medians.
        memory: peak of the process [MiB].
    """

    env: str
    task: str
    fidelity: str
    components: str
    spacing: float
    bodies: dict[str, float | None]
    gaits: int
    runs: int
    error: float | None
    unknown: float | None
    checked: int
    low: float | None
    median: float | None
    high: float | None
    transfer: float | None
    one_body: KeptOrders
    two_bodies: KeptOrders
    angle: float | None
    particles: int | None
    substeps: float | None
    seconds: float | None
    gradient_seconds: float | None
    memory: float | None


@dataclass(frozen=True)
class Published:
    """The published results, by which `choose` judges.

    Attributes:
        origin: commits and machines of the measurements.
        levels: errors and costs; of those measured before gaits were trained the costs alone.
    """

    origin: tuple[str, ...]
    levels: tuple[LevelRow, ...]


def components(env: Ref, task: Ref, fidelity: Ref) -> str:
    """Resolved references as a text, with version and every parameter."""
    return f"{env} {task} {fidelity}"


@cache
def published() -> Published:
    """The results that come with the package."""
    text = files("zoobench.accuracy").joinpath(PUBLISHED).read_text(encoding="utf-8")
    document = json.loads(text)
    levels = tuple(map(_read, document["levels"]))
    return Published(tuple(document["origin"]), levels)


def _read(row: dict[str, Any]) -> LevelRow:
    orders = {
        name: KeptOrders(row[name]["ratio"], row[name]["pairs"], tuple(row[name]["bodies"]))
        for name in ("one_body", "two_bodies")
    }
    return LevelRow(**{**row, **orders})
