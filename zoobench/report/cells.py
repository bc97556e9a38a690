"""Cells of the benchmark with the outcomes of their runs: all that tables of scores need."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from zoobench.db.rows import RunState
from zoobench.report.normalise import REFERENCES
from zoobench.report.run_results import NO_SCORE, PROBE, SCORE, SMOKE, RunResult
from zoobench.spec import WALL_GAP, RunSelection, RunSpec, currency

if TYPE_CHECKING:
    from zoobench.db.query import Reader

_FINALS = (SCORE, *REFERENCES, "forward_substeps", "backward_substeps", "episodes", "nonfinite_gradients", WALL_GAP)


class Outcome(NamedTuple):
    """The outcome of a run.

    Attributes:
        run: its id, or 0.
        state: None if it is wanted and does not exist.
        score: None if it has none that is finite.
        unit: of the score.
        floor: the better of its reference scores, None unless it has both.
        spent: the amount simulated, in the unit of its budget if that counts episodes, else in substeps; None if it
            is not known.
        nonfinite: share of its gradients that were not finite although their episodes did not fail.
        lacks: why it has no score, if it is DONE.
        wall_gap: how near its robot came to a side of the arena [cells]; None if it is not known.
    """

    run: int
    seed: int
    state: RunState | None = None
    score: float | None = None
    unit: str = ""
    floor: float | None = None
    spent: float | None = None
    nonfinite: float = 0.0
    lacks: str = NO_SCORE
    wall_gap: float | None = None


@dataclass(frozen=True)
class Cell:
    """The runs that differ by the seed alone; the seed of `spec` is 0."""

    spec: RunSpec
    outcomes: Sequence[Outcome]


def read_cells(reader: "Reader", selection: RunSelection) -> list[Cell]:
    """The selected runs of a database by their cells.

    Raises:
        UsageError: a selector fits no run of the database, as `RunSelection.among`.
        StorageError: the database cannot be read.
    """
    cells: dict[int, tuple[RunSpec, list[Outcome]]] = {}  # to hash settings takes longer than all the rest
    for spec, run, seed, state, unit, finals in reader.cells(selection, _FINALS):
        outcome = _outcome(spec, finals, run, seed, state, unit)
        cells.setdefault(id(spec), (spec, []))[1].append(outcome)
    return [Cell(spec, outcomes) for spec, outcomes in cells.values()]


def cells_of(results: Iterable[RunResult], missing: Iterable[RunSpec] = ()) -> list[Cell]:
    """Results by their cells, with the runs that are wanted and do not exist."""
    cells: dict[RunSpec, list[Outcome]] = {}
    for result in results:
        spec, run = result.spec, result.run
        values = (result.finals[name].value if name in result.finals else None for name in _FINALS)
        finals = [value if value is not None and math.isfinite(value) else None for value in values]
        unit = "" if result.score is None else result.score.unit
        outcome = _outcome(spec, finals, run.id, spec.seed, run.state, unit, result.lacks)
        cells.setdefault(replace(spec, seed=0), []).append(outcome)
    for spec in missing:
        cells.setdefault(replace(spec, seed=0), []).append(Outcome(0, spec.seed))
    return [Cell(spec, outcomes) for spec, outcomes in cells.items()]


def comparable(cells: Iterable[Cell]) -> list[Cell]:
    """Those that may stand in a table: no smoke runs, no probes, and of the others the runs that can be."""
    kept = (
        Cell(cell.spec, [outcome for outcome in cell.outcomes if outcome.state is not RunState.SKIPPED])
        for cell in cells
        if cell.spec.fidelity.name != SMOKE and cell.spec.method.name != PROBE
    )
    return [cell for cell in kept if cell.outcomes]


def _outcome(
    spec: RunSpec,
    finals: Sequence[float | None],
    run: int,
    seed: int,
    state: RunState,
    unit: str,
    lacks: str = NO_SCORE,
) -> Outcome:
    """The outcome of a run with these finals, in the order of `_FINALS`."""
    score, idle, chance, forward, backward, episodes, lost, gap = finals
    floor = None if idle is None or chance is None else max(idle, chance)
    spent = _spent(spec, forward, backward, episodes)
    nonfinite = lost / episodes if lost and episodes else 0.0  # there is one gradient an episode
    return Outcome(run, seed, state, score, unit, floor, spent, nonfinite, lacks, gap)


def _spent(spec: RunSpec, forward: float | None, backward: float | None, episodes: float | None) -> float | None:
    if currency(spec.budget.kind) == "episodes":
        return episodes
    return None if forward is None or backward is None else forward + backward
