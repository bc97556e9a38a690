"""Rows of which reports read very many at a time: tuples, with as little in them as is asked for."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from zoobench.db.rows import RunState
from zoobench.spec import Ref, RunSpec


class CellRun(NamedTuple):
    """A run of a cell.

    Attributes:
        spec: the settings of the cell, with the seed 0: one object for all its runs.
        unit: of the first final that was asked for.
        finals: a value for each name that was asked for; None where the run, which may not be DONE, has none that is
            finite.
    """

    spec: RunSpec
    id: int
    seed: int
    state: RunState
    unit: str
    finals: Sequence[float | None]


class PastRun(NamedTuple):
    """A run that is DONE: its settings with some seed, its wall time [s] and the substeps that were simulated."""

    spec: RunSpec
    seconds: float
    forward: float
    backward: float


class PastTotal(NamedTuple):
    """The sums of `PastRun` over an environment and a fidelity."""

    env: Ref
    fidelity: Ref
    seconds: float
    forward: float
    backward: float


class OriginRow(NamedTuple):
    """A provenance that results come from, with the first start and the last end of its attempts [s]."""

    started_at: float
    ended_at: float
    provenance: Mapping[str, Any]
