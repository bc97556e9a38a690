"""Quality diversity: good bodies of every size and shape, by MAP-Elites (Mouret and Clune 2015)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError, extra
from zoobench.methods.archive import Archive
from zoobench.methods.base import First, RunContext, Solution, Work
from zoobench.methods.cmaes import check_strategy
from zoobench.methods.generations import AskAndTell, Told, evolve, scores_of
from zoobench.registry import Kind, register


@register(Kind.METHOD, "quality-diversity", version=2, tags=("evolution", "space"), extra="qd")
@dataclass(frozen=True, kw_only=True)
class QualityDiversity:
    """An archive of the best bodies of every size and shape, by MAP-Elites with pyribs.

    The archive is a grid over a body's volume, as a share of the workspace, and its elongation (1 - second longest /
    longest principal deviation). The first generations are draws from the prior, and so is a share of each that
    follows; all others are elites, changed along the line to another elite and by noise (Vassiliades and Mouret 2018).
    A step between two shapes is a shape again, where independent noise at every site would be dust. Failed episodes
    enter no cell. The solution is the best of all. The archive is stored with the run for
    `zoobench design archive RUN`, with these facts:

    * `elites`: number of filled cells, and `coverage`, their share of all.
    * `qd_score`: the sum of all elites' scores, negative ones as 0 [unit of the score].

    Parameters:

    * `sigma`: standard deviation of the noise of every parameter.
    * `line`: standard deviation of the step along the line, relative to the distance of the two elites.
    * `draws`: share of a generation that is drawn from the prior.
    * `beginning`: number of draws before the first elite is changed.
    * `population`: individuals of a generation.
    * `cells`: along each side of the archive.
    """

    sigma: float = 0.05
    line: float = 0.5
    draws: float = 0.2
    beginning: int = 50
    population: int = 10
    cells: int = 50

    def __post_init__(self) -> None:
        check_strategy(self.sigma, self.population)
        if self.cells < 1:
            raise UsageError(f"An archive with {self.cells} cells along each side is empty. Give at least 1.")
        if not 0.0 <= self.draws <= 1.0 or self.beginning < 1 or not self.line >= 0.0:
            raise UsageError(
                f"A share of draws of {self.draws:g}, {self.beginning} draws to begin with and steps of {self.line:g} "
                "along the line are not possible. Give a share from 0 to 1, a number from 1 and steps from 0 upwards."
            )

    def work(self, frames: int) -> Work:
        """A generation."""
        return Work(frames=self.population * frames)

    def first(self, frames: int) -> First:
        """A generation."""
        return First(self.population, frames=self.population * frames)

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
    """The archive and its variation, as an `AskAndTell` that is told score, volume and elongation."""

    def __init__(self, method: QualityDiversity, problem: Problem, rng: np.random.Generator) -> None:
        self._method, self._problem, self._rng = method, problem, rng
        self._volume = float(problem.body.volumes.sum())
        self._asked = 0
        with extra("qd", "quality-diversity needs"):
            import ribs.archives
            import ribs.emitters
        self._archive = ribs.archives.GridArchive(
            solution_dim=problem.parameter_count, dims=[method.cells] * 2, ranges=[(0.0, 1.0)] * 2, seed=self._seed()
        )
        self._emitter = ribs.emitters.IsoLineEmitter(
            self._archive,
            iso_sigma=method.sigma,
            line_sigma=method.line,
            x0=np.zeros(problem.parameter_count),
            batch_size=method.population,
            seed=self._seed(),
        )

    def ask(self) -> list[Array]:
        """The next generation, `[parameter_count]` each."""
        count, method = self._method.population, self._method
        is_begun = self._asked >= method.beginning and not self._archive.empty
        drawn = round(method.draws * count) if is_begun else count
        draws = [self._problem.initial(self._rng) for _ in range(drawn)]
        varied: list[Array] = list(self._emitter.ask())[: count - drawn] if drawn < count else []
        self._points: Array = np.array([*draws, *varied], dtype=np.float64)
        self._asked += count
        return list(self._points)

    def digest(self, evaluations: Sequence[Evaluation]) -> Told:
        """Score, volume share and elongation of each body; None if its episode failed."""
        rows = []
        for score, item in zip(scores_of(evaluations), evaluations, strict=True):
            shape = [item.metrics[name].value for name in ("body_volume", "elongation")] if score is not None else []
            rows.append([score, shape[0] / self._volume, shape[1]] if shape else None)
        return rows

    def tell(self, told: Told) -> None:
        """Add the bodies to the archive."""
        able = np.array([row is not None for row in told])
        rows = np.array([row for row in told if row is not None], dtype=np.float64).reshape(-1, 3)
        if len(rows):
            self._archive.add(self._points[able], rows[:, 0], rows[:, 1:])

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

    def _seed(self) -> int:
        return int(self._rng.integers(2**63))
