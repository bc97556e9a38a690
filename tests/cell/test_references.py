"""Reference scores from the real simulator."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.cell.references import DRAWS, reference_scores
from zoobench.spec import Budget

NONE = np.zeros(0)
"""Parameters of a fixed body."""


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cache folder for each test."""
    monkeypatch.setattr("zoobench.sim.runtime.cache_folder", lambda: tmp_path / "kernels")


def test_references_are_those_of_the_cell() -> None:
    """Robot at rest and mean of draws, with the score's unit, for any method, seed and budget."""
    spec = cell(task="waypoint-following", budget=Budget("episodes", 1))
    references = reference_scores(spec, NONE)
    assert {name: metric.unit for name, metric in references.items()} == {"idle_score": "m", "random_score": "m"}
    problem = Problem(cell(task="waypoint-following"))
    idle = problem.evaluate(np.zeros(problem.parameter_count))
    assert references["idle_score"].value == idle.score
    assert references["random_score"].value != idle.score
    other = cell(task="waypoint-following", method="diffphysics", seed=3)
    assert reference_scores(other, NONE) == references
    assert reference_scores(cell(task="turning"), NONE)["random_score"] != references["random_score"]


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
    assert {name: metric.value for name, metric in reference_scores(cell(), NONE).items()} == expected


def test_references_are_computed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cached values are equal bit for bit; another episode length or a damaged file is computed again."""
    calls = []

    def evaluate(self: Problem, batch: list[np.ndarray]) -> list[Evaluation]:
        calls.append(len(batch))
        return [Evaluation(0.1 * number, {}, np.zeros(0)) for number in range(len(batch))]

    monkeypatch.setattr(Problem, "evaluate_batch", evaluate)
    first = reference_scores(cell(), NONE)
    assert reference_scores(replace(cell(), seed=5), NONE) == first
    assert calls == [1, DRAWS]
    reference_scores(cell(frames=7), NONE)
    assert len(calls) == 4
    for path in (tmp_path / "references").iterdir():
        path.write_text("{")
    assert reference_scores(cell(), NONE) == first
    assert len(calls) == 6


def test_the_body_at_rest_is_the_solutions(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a design space each solution has its own; the muscles are at rest whatever the controller."""
    monkeypatch.setattr("zoobench.cell.references.DRAWS", 2)
    spec = cell(design="voxel", controller="fixed-sine")
    problem = Problem(spec)
    bodies = [problem.initial(np.random.default_rng(seed))[problem.robot.control_count :] for seed in range(2)]
    first, second = (reference_scores(spec, body) for body in bodies)
    assert first["idle_score"] != second["idle_score"]
    assert first["random_score"] == second["random_score"] != first["idle_score"]
    assert abs(first["idle_score"].value) < 1e-5
