"""Quality diversity: not one best body, but good bodies of every kind, by CMA-ME (Fontaine et al. 2020)."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.methods.archive import Archive
from zoobench.methods.base import RunContext, Solution
from zoobench.methods.cmaes import SEPARABLE, check_strategy
from zoobench.methods.generations import Lesson, evolve, scores_of
from zoobench.registry import Kind, register


@register(Kind.METHOD, "quality-diversity", tags=("evolution", "space"))
@dataclass(frozen=True, kw_only=True)
class QualityDiversity:
    """An archive of the best bodies of every size and shape, which CMA-ME fills and improves, by pyribs.

    The archive has a cell for each pair of a body's volume, as a share of the workspace, and its elongation
    (1 - second longest / longest principal deviation). A strategy from a draw of the prior prefers what finds a new
    cell, then what improves one; where a generation does neither, a new one starts from one of the archive's bodies.
    What diverged enters no cell. The solution is the best of all; the archive is kept with the run, for
    `zoobench design archive RUN`, and its facts tell what it is worth:

    * `elites`: cells that are filled, and `coverage`, their share of all.
    * `qd_score`: the sum of all cells' scores, negative ones as 0 [unit of the score].

    Parameters:

    * `sigma`: initial standard deviation of every parameter; with 0.5, bodies of a space of 1000 parameters are all
      about alike, since what changes at random in many places does not change the whole.
    * `population`: individuals of a generation.
    * `cells`: along each side of the archive.
    """

    sigma: float = 1.0
    population: int = 10
    cells: int = 50

    def __post_init__(self) -> None:
        check_strategy(self.sigma, self.population)
        if self.cells < 1:
            raise UsageError(f"An archive with {self.cells} cells along each side is none. Give at least 1.")

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Fill the archive until the budget holds no further generation.

        Raises:
            UsageError: the design is no design space, or pyribs is not installed.
            DivergenceError, BudgetExhaustedError: as of every method.
        """
        if problem.robot.space is None:
            raise UsageError(
                "quality-diversity collects bodies, and this design has only one. "
                "Choose a design space, as --design voxel; for a fixed body there is cmaes."
            )

        founded: list[_Illumination] = []

        def found() -> _Illumination:
            founded.append(_Illumination(self, problem, context.rng))
            return founded[-1]

        solution = evolve(problem, context, found, population=self.population)
        return replace(solution, archive=founded[-1].archive())


class _Illumination:
    """The archive and the strategy that fills it: a `Breeder`. Its lessons are rows of score, volume, elongation."""

    def __init__(self, method: QualityDiversity, problem: Problem, rng: np.random.Generator) -> None:
        self._method, self._problem, self._rng = method, problem, rng
        self._volume = float(problem.body.volumes.sum())
        self._archive = _ribs().archives.GridArchive(
            solution_dim=problem.parameter_count,
            dims=[method.cells] * 2,
            ranges=[(0.0, 1.0)] * 2,
            seed=self._seed(),
        )
        self._begin()

    def ask(self) -> list[Array]:
        """The next generation, each `[parameter_count]`."""
        self._points: Array = np.array(self._emitter.ask(), dtype=np.float64)
        return list(self._points)

    def lesson(self, evaluations: Sequence[Evaluation]) -> Lesson:
        """Score, volume and elongation of each, None for one that failed."""
        rows = []
        for score, item in zip(scores_of(evaluations), evaluations, strict=True):
            shape = [item.metrics[name].value for name in ("body_volume", "elongation")] if score is not None else []
            rows.append([score, shape[0] / self._volume, shape[1]] if shape else None)
        return rows

    def learn(self, lesson: Lesson) -> None:
        """Offer all to the archive, and let the strategy learn from what became of it."""
        able = np.array([row is not None for row in lesson])
        rows = np.array([row for row in lesson if row is not None], dtype=np.float64).reshape(-1, 3)
        # what failed is told as the worst of those that entered no cell
        status, value = np.zeros(len(able), dtype=np.int32), np.full(len(able), -1e6)
        told = np.zeros((len(able), 3))
        told[able] = rows
        if len(rows):
            added = self._archive.add(self._points[able], rows[:, 0], rows[:, 1:])
            status[able], value[able] = added["status"], added["value"]
        if self._archive.empty:
            self._begin()  # the emitter would start again from the archive
            return
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._emitter.tell(self._points, told[:, 0], told[:, 1:], {"status": status, "value": value})

    def readings(self) -> dict[str, float]:
        """What the archive is worth."""
        scores = self._archive.data("objective")
        return {
            "elites": float(len(scores)),
            "coverage": len(scores) / self._method.cells**2,
            "qd_score": float(np.maximum(scores, 0.0).sum()),
        }

    def facts(self) -> dict[str, float]:
        """The same, at the end."""
        return self.readings()

    def archive(self) -> Archive:
        """All elites, the best first, and of equals the one in the earlier cell."""
        data = self._archive.data(["solution", "objective", "measures", "index"])
        order = np.lexsort((data["index"], -data["objective"]))
        return Archive(
            np.array(data["solution"], np.float64)[order],
            np.array(data["objective"], np.float64)[order],
            np.array(data["measures"], np.float64)[order],
            ("volume_share", "elongation"),
            self._method.cells,
        )

    def _begin(self) -> None:
        """A strategy from a draw of the prior."""
        start = self._problem.initial(self._rng)
        self._emitter = _ribs().emitters.EvolutionStrategyEmitter(
            self._archive,
            x0=start,
            sigma0=self._method.sigma,
            ranker="2imp",
            es="sep_cma_es" if len(start) > SEPARABLE else "cma_es",
            batch_size=self._method.population,
            seed=self._seed(),
        )

    def _seed(self) -> int:
        return int(self._rng.integers(2**63))


def _ribs() -> Any:
    """pyribs.

    Raises:
        UsageError: it is not installed.
    """
    try:
        import ribs.archives
        import ribs.emitters
    except ImportError:
        raise UsageError("quality-diversity needs pyribs. Install it with: pip install 'zoobench[qd]'.") from None
    return ribs
