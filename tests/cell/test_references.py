"""Reference scores from the real simulator."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import zoobench
from tests.conformance.cells import cell
from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.cell.references import _AROUND, DRAWS, code_digest, reference_scores
from zoobench.spec import Budget, RunSpec
from zoobench.tasks.base import Metric

NONE = np.zeros(0)
"""Parameters of a fixed body."""


class Shelf:
    """The scores of other runs, in memory."""

    def __init__(self) -> None:
        self.scores: dict[str, Metric] = {}

    def reference(self, key: str) -> Metric | None:
        """The score under a key."""
        return self.scores.get(key)

    def keep_reference(self, key: str, score: Metric) -> None:
        """Keep a score."""
        assert key not in self.scores
        self.scores[key] = score


def references(spec: RunSpec, design: Array = NONE, shared: Shelf | None = None) -> dict[str, Metric]:
    """The references of a run, by default of one that shares them with no other."""
    return reference_scores(spec, design, Shelf() if shared is None else shared)


def test_references_are_those_of_the_cell() -> None:
    """Robot at rest and mean of draws, with the score's unit, for any method, seed and budget."""
    spec = cell(task="waypoint-following", budget=Budget("episodes", 1))
    found = references(spec)
    assert {name: metric.unit for name, metric in found.items()} == {"idle_score": "m", "random_score": "m"}
    problem = Problem(cell(task="waypoint-following"))
    idle = problem.evaluate(np.zeros(problem.parameter_count))
    assert found["idle_score"].value == idle.score
    assert found["random_score"].value != idle.score
    other = cell(task="waypoint-following", method="diffphysics", seed=3)
    assert references(other) == found
    assert references(cell(task="turning"))["random_score"] != found["random_score"]


@pytest.mark.parametrize(
    ("scores", "expected"),
    [
        ([0.5, 1.0, 2.0] + [-math.inf] * (DRAWS - 2), {"idle_score": 0.5, "random_score": 1.5}),
        ([-math.inf] + [1.0] * DRAWS, {"random_score": 1.0}),
        ([-math.inf] * (DRAWS + 1), {}),
    ],
)
def test_what_diverged_is_no_reference(
    monkeypatch: pytest.MonkeyPatch, scores: list[float], expected: dict[str, float]
) -> None:
    """The mean is over finite scores; without any there is no reference."""

    left = iter(scores)

    def evaluate(self: Problem, batch: list[np.ndarray]) -> list[Evaluation]:
        return [Evaluation(next(left), {}, np.zeros(0)) for _ in batch]

    monkeypatch.setattr(Problem, "evaluate_batch", evaluate)
    assert {name: metric.value for name, metric in references(cell()).items()} == expected


def test_a_run_has_the_numbers_that_it_would_compute_itself() -> None:
    """Bit for bit, though another method with another seed and budget was first."""
    shared = Shelf()
    first = references(cell(Budget("episodes", 1), method="diffphysics", seed=3), shared=shared)
    assert len(shared.scores) == 2
    spec = cell()
    assert references(spec, shared=shared) == first == references(spec)


def test_references_are_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """For all runs of a cell; another episode length is another cell, and what diverged is not tried again."""
    calls = []

    def evaluate(self: Problem, batch: list[np.ndarray]) -> list[Evaluation]:
        calls.append(len(batch))
        scores = [0.1 * number if len(batch) > 1 else -math.inf for number in range(len(batch))]
        return [Evaluation(score, {}, np.zeros(0)) for score in scores]

    monkeypatch.setattr(Problem, "evaluate_batch", evaluate)
    shared = Shelf()
    first = references(cell(), shared=shared)
    assert set(first) == {"random_score"}
    assert references(replace(cell(), seed=5), shared=shared) == first
    assert calls == [1, DRAWS]
    references(cell(frames=7), shared=shared)
    assert calls == [1, DRAWS] * 2


@pytest.mark.parametrize("change", ["processor", "rounding", "version", "sources"])
def test_what_may_change_the_numbers_is_another_reference(monkeypatch: pytest.MonkeyPatch, change: str) -> None:
    """Another processor or choice of its code, other versions of libraries, other sources."""
    monkeypatch.setattr("zoobench.cell.references._random", lambda spec: Metric(1.0, "m"))
    monkeypatch.setattr("zoobench.cell.references._idle", lambda spec, design: Metric(0.0, "m"))
    shared = Shelf()
    references(cell(), shared=shared)
    if change == "processor":
        monkeypatch.setattr("zoobench.sim.equilibrium.processor", lambda: "another")
    elif change == "rounding":
        monkeypatch.setenv("ATEN_CPU_CAPABILITY", "another")
    elif change == "version":
        monkeypatch.setattr("zoobench.cell.references.version", lambda name: "another")
        monkeypatch.setattr("zoobench.cell.references.code_digest", code_digest.__wrapped__)
    else:
        monkeypatch.setattr("zoobench.cell.references.code_digest", lambda: b"other")
    references(cell(), shared=shared)
    assert len(shared.scores) == 4


def test_the_sources_are_those_that_an_episode_runs() -> None:
    """A new command or table does not make all references anew."""
    root = Path(zoobench.__file__).parent
    assert {path.name for path in root.iterdir() if path.is_dir()} > set(_AROUND)
    assert not {"cell", "controllers", "designs", "envs", "sim", "tasks"} & set(_AROUND)


@pytest.mark.slow
def test_the_body_at_rest_is_the_solutions(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a design space each solution has its own; the muscles are at rest whatever the controller."""
    monkeypatch.setattr("zoobench.cell.references.DRAWS", 2)
    spec = cell(design="voxel", controller="fixed-sine")
    problem = Problem(spec)
    bodies = [problem.initial(np.random.default_rng(seed))[problem.robot.control_count :] for seed in range(2)]
    first, second = (references(spec, body) for body in bodies)
    assert first["idle_score"] != second["idle_score"]
    assert first["random_score"] == second["random_score"] != first["idle_score"]
    assert abs(first["idle_score"].value) < 1e-5
