"""Work and precision against exact answers: error and time of a case on finer and finer grids.

Errors come from the functions that `validate` judges. Times are those of the simulator's substeps alone, from the final
state of the case, without its own work on the particles. Several cases are one cell wide, so that their cost grows with
h^-2, not h^-4; nanoseconds per particle and substep hold for any body.
"""

import math
import statistics
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from zoobench.errors import UnknownNameError, UsageError
from zoobench_verify.accuracy.analytic_cases import CASES, AnalyticCase
from zoobench_verify.comparison_figure import Figure
from zoobench_verify.validate.rig import Rig, order_of_accuracy

_WORK = 1_000_000  # particle-substeps in a launch; the overhead of a launch is that of a thousand
_SAMPLE_SECONDS = 0.05


@dataclass(frozen=True)
class AnalyticRow:
    """One quantity of a case on one grid.

    Attributes:
        cells: of the grid along the case's reference length.
        spacing: of the grid [m].
        precision: bits of a real number.
        settings: parameters of the fidelity that were given, sorted.
        error: relative to the exact answer, not negative.
        order: of the error, from the next coarser grid to this one; None on the coarsest.
        seconds, seconds_min, seconds_max: wall time of all substeps [s], median and range of the samples.
        simulated_seconds: simulated time of all substeps [s].
        particles: of the scene, including images around a periodic cell.
        nanoseconds: processor time per particle and substep, median [ns].
    """

    case: str
    quantity: str
    cells: int
    spacing: float
    precision: int
    settings: tuple[tuple[str, str | int | float], ...]
    error: float
    order: float | None
    seconds: float
    seconds_min: float
    seconds_max: float
    simulated_seconds: float
    substeps: int
    particles: int
    nanoseconds: float

    @property
    def slowdown(self) -> float:
        """Wall time by simulated time [-]."""
        return self.seconds / self.simulated_seconds


@dataclass(frozen=True)
class AnalyticSummary:
    """The order of accuracy of one quantity of a case.

    Attributes:
        order: slope of the error over the spacing in logarithms, over all grids; None for a single one.
        at_least, at_most: bounds by the theory; None where there is none.
        verdict: `met`, `missed`, or `not judged` without an order of the theory or with a single grid.
    """

    case: str
    quantity: str
    order: float | None
    at_least: float | None
    at_most: float | None
    verdict: str


def case_names() -> list[str]:
    """Names of the cases."""
    return [case.name for case in CASES]


def analytic(
    cases: Sequence[str] | None = None, levels: int | None = None, repeats: int = 3, **settings: Any
) -> Iterator[AnalyticRow]:
    """Simulate cases on their ladders of grids, and time all grids of a case in turn.

    Args:
        cases: names out of `case_names`; all if None.
        levels: number of grids of each ladder, the coarsest first; all if None.
        repeats: samples of the time, of which the median is given.
        settings: precision (64 bits if not given) and other parameters of the fidelity.

    Raises:
        UnknownNameError: an unknown case.
        UsageError: levels or repeats below 1.
    """
    known = {case.name: case for case in CASES}
    for name in cases or ():
        if name not in known:
            raise UnknownNameError("analytic case", name, known)
    if repeats < 1 or (levels is not None and levels < 1):
        raise UsageError(f"{levels} levels and {repeats} repeats were asked for. Give at least 1 of each.")
    chosen = [known[name] for name in (known if cases is None else cases)]
    return (row for case in chosen for row in _climb(case, case.cells[:levels], repeats, settings))


def _climb(case: AnalyticCase, ladder: Sequence[int], repeats: int, settings: dict[str, Any]) -> Iterator[AnalyticRow]:
    """The rows of one case, the coarsest grid first."""
    found = [case.solve(cells, **settings) for cells in ladder]
    clocks = [_Clock(solved.rig) for solved in found]
    samples = list(zip(*([clock.sample() for clock in clocks] for _ in range(repeats)), strict=True))
    for number, (cells, solved, times) in enumerate(zip(ladder, found, samples, strict=True)):
        rig, (wall, processor) = solved.rig, zip(*times, strict=True)
        pair = found[max(number - 1, 0) : number + 1]
        for quantity, error in solved.errors.items():
            yield AnalyticRow(
                case=case.name,
                quantity=quantity,
                cells=cells,
                spacing=rig.grid_spacing,
                precision=rig.solver.fidelity.precision,
                settings=tuple(sorted((name, value) for name, value in settings.items() if name != "precision")),
                error=error,
                order=_order([one.rig.grid_spacing for one in pair], [one.errors[quantity] for one in pair]),
                seconds=statistics.median(wall) * rig.done,
                seconds_min=min(wall) * rig.done,
                seconds_max=max(wall) * rig.done,
                simulated_seconds=rig.done * rig.dt,
                substeps=rig.done,
                particles=rig.solver.particle_count,
                nanoseconds=1e9 * statistics.median(processor) / rig.solver.particle_count,
            )


def _order(spacings: list[float], errors: list[float]) -> float | None:
    """The observed order; None on a single grid."""
    return order_of_accuracy(spacings, errors) if len(errors) > 1 else None


class _Clock:
    """Times the substeps of a rig from the state that it is in."""

    def __init__(self, rig: Rig) -> None:
        self._solver, self._state = rig.solver, rig.solver.matter.copy_slot(0)
        self._burst = min(rig.done, math.ceil(_WORK / rig.solver.particle_count))

    def sample(self) -> tuple[float, float]:
        """Wall and processor time per substep [s], over launches of `_SAMPLE_SECONDS` at least."""
        wall, processor, count = 0.0, 0.0, 0
        while wall < _SAMPLE_SECONDS:
            self._solver.matter.load_slot(0, self._state)
            begin = time.perf_counter(), time.process_time()
            self._solver.substeps(self._burst)
            wall += time.perf_counter() - begin[0]
            processor += time.process_time() - begin[1]
            count += self._burst
        return wall / count, processor / count


def _curves(rows: Iterable[AnalyticRow]) -> dict[tuple[str, str], list[AnalyticRow]]:
    """Rows by case and quantity, the coarsest grid first."""
    found: dict[tuple[str, str], list[AnalyticRow]] = {}
    for row in sorted(rows, key=lambda row: row.cells):
        found.setdefault((row.case, row.quantity), []).append(row)
    names = case_names()
    return dict(sorted(found.items(), key=lambda item: names.index(item[0][0])))


def summarise(rows: Iterable[AnalyticRow]) -> list[AnalyticSummary]:
    """The observed order of every case and quantity, judged by the theory's."""
    bounds = {(case.name, quantity): bound for case in CASES for quantity, bound in case.orders.items()}
    found = []
    for key, group in _curves(rows).items():
        low, high = bounds.get(key, (None, None))
        order = _order([row.spacing for row in group], [row.error for row in group])
        if order is None or low is None:
            verdict = "not judged"
        else:
            verdict = "met" if low <= order <= (math.inf if high is None else high) else "missed"
        found.append(AnalyticSummary(*key, order, low, high, verdict))
    return found


def figure(rows: Iterable[AnalyticRow]) -> Figure:
    """Error over wall seconds per simulated second, the first quantity of every case; labels name the grids."""
    words = ("Accuracy against exact answers", "wall seconds per simulated second", "error, relative [-]")
    found = Figure(*words, log="xy")
    drawn = set()
    for (case, _), group in _curves(rows).items():
        if case in drawn:
            continue
        drawn.add(case)
        label = f"{case}, {' '.join(str(row.cells) for row in group)} cells"
        found.computed(label, [row.slowdown for row in group], [row.error for row in group])
    return found
