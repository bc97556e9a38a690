"""Quality diversity: good bodies of every size and shape, by CMA-ME (Fontaine et al. 2020)."""

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
from zoobench.methods.base import RunContext, Solution, Work
from zoobench.methods.cmaes import SEPARABLE, check_strategy
from zoobench.methods.generations import AskAndTell, Told, evolve, scores_of
from zoobench.registry import Kind, register


@register(Kind.METHOD, "quality-diversity", tags=("evolution", "space"))
@dataclass(frozen=True, kw_only=True)
class QualityDiversity:
    """An archive of the best bodies of every size and shape, by CMA-ME with pyribs.

    The archive is a grid over a body's volume, as a share of the workspace, and its elongation (1 - second longest /
    longest principal deviation). An evolution strategy from a draw of the prior ranks solutions that fill a new cell
    first, then those that improve one; if a generation does neither, a new strategy starts from an elite. Failed
    episodes enter no cell. The solution is the best of all. The archive is stored with the run for
    `zoobench design archive RUN`, with these facts:

    * `elites`: number of filled cells, and `coverage`, their share of all.
    * `qd_score`: the sum of all elites' scores, negative ones as 0 [unit of the score].

    Parameters:

    * `sigma`: initial standard deviation of every parameter; with 0.5, the bodies of a space of 1000 parameters are
      nearly alike, since independent changes at many sites average out.
    * `population`: individuals of a generation.
    * `cells`: along each side of the archive.
    """

    sigma: float = 1.0
    population: int = 10
    cells: int = 50

    def __post_init__(self) -> None:
        check_strategy(self.sigma, self.population)
        if self.cells < 1:
            raise UsageError(f"An archive with {self.cells} cells along each side is empty. Give at least 1.")

    def work(self, frames: int) -> Work:
        """A generation."""
        return Work(frames=self.population * frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Fill the archive until the budget does not suffice for another generation.

        Raises:
            UsageError: the design is not a design space, or pyribs is not installed.
            DivergenceError, BudgetExhaustedError: as for every method.
        """
        if problem.robot.space is None:
            raise UsageError(
                "quality-diversity collects bodies, and this design has only one. "
                "Choose a design space, as --design voxel; for a fixed body use cmaes."
            )
        created: list[_Illumination] = []

        def create() -> _Illumination:
            created.append(_Illumination(self, problem, context.rng))
            return created[-1]

        solution = evolve(problem, context, create, population=self.population)
        return replace(solution, archive=created[-1].archive())


class _Illumination(AskAndTell):
    """The archive and its evolution strategy, as an `AskAndTell` that is told score, volume and elongation."""

    def __init__(self, method: QualityDiversity, problem: Problem, rng: np.random.Generator) -> None:
        self._method, self._problem, self._rng = method, problem, rng
        self._volume = float(problem.body.volumes.sum())
        self._archive = _ribs().archives.GridArchive(
            solution_dim=problem.parameter_count, dims=[method.cells] * 2, ranges=[(0.0, 1.0)] * 2, seed=self._seed()
        )
        self._begin()

    def ask(self) -> list[Array]:
        """The next generation, `[parameter_count]` each."""
        self._points: Array = np.array(self._emitter.ask(), dtype=np.float64)
        return list(self._points)

    def digest(self, evaluations: Sequence[Evaluation]) -> Told:
        """Score, volume share and elongation of each body; None if its episode failed."""
        rows = []
        for score, item in zip(scores_of(evaluations), evaluations, strict=True):
            shape = [item.metrics[name].value for name in ("body_volume", "elongation")] if score is not None else []
            rows.append([score, shape[0] / self._volume, shape[1]] if shape else None)
        return rows

    def tell(self, told: Told) -> None:
        """Add the bodies to the archive and update the strategy by the resulting ranks."""
        able = np.array([row is not None for row in told])
        rows = np.array([row for row in told if row is not None], dtype=np.float64).reshape(-1, 3)
        # a failed episode ranks last among those that entered no cell
        status, value = np.zeros(len(able), dtype=np.int32), np.full(len(able), -1e6)
        results = np.zeros((len(able), 3))
        results[able] = rows
        if len(rows):
            added = self._archive.add(self._points[able], rows[:, 0], rows[:, 1:])
            status[able], value[able] = added["status"], added["value"]
        if self._archive.empty:
            self._begin()  # the emitter would restart from an elite, and there is none
            return
        with warnings.catch_warnings(action="ignore"):
            self._emitter.tell(self._points, results[:, 0], results[:, 1:], {"status": status, "value": value})

    def readings(self) -> dict[str, float]:
        """Size and quality of the archive."""
        scores = self._archive.data("objective")
        return {
            "elites": float(len(scores)),
            "coverage": len(scores) / self._method.cells**2,
            "qd_score": float(np.maximum(scores, 0.0).sum()),
        }

    def archive(self) -> Archive:
        """All elites by falling score, equal ones by their cell."""
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
        """Start a strategy from a draw of the prior."""
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
    """The module of pyribs.

    Raises:
        UsageError: it is not installed.
    """
    try:
        import ribs.archives
        import ribs.emitters
    except ImportError:
        raise UsageError("quality-diversity needs pyribs. Install it with: pip install 'zoobench[qd]'.") from None
    return ribs
