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


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cache folder for each test."""
    monkeypatch.setattr("zoobench.sim.runtime.cache_folder", lambda: tmp_path / "kernels")


def test_references_are_those_of_the_cell() -> None:
    """Robot at rest and mean of draws, with the score's unit, for any method, seed and budget."""
    spec = cell(task="waypoint-following", budget=Budget("episodes", 1))
    references = reference_scores(spec)
    assert {name: metric.unit for name, metric in references.items()} == {"idle_score": "m", "random_score": "m"}
    problem = Problem(cell(task="waypoint-following"))
    idle = problem.evaluate(np.zeros(problem.parameter_count))
    assert references["idle_score"].value == idle.score
    assert references["random_score"].value != idle.score
    other = cell(task="waypoint-following", method="diffphysics", seed=3)
    assert reference_scores(other) == references
    assert reference_scores(cell(task="turning"))["random_score"] != references["random_score"]


@pytest.mark.parametrize(
    ("scores", "expected"),
    [
        ([1.0, 2.0] + [-math.inf] * (DRAWS - 2) + [0.5], {"idle_score": 0.5, "random_score": 1.5}),
        ([1.0] * DRAWS + [-math.inf], {"random_score": 1.0}),
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
    assert {name: metric.value for name, metric in reference_scores(cell()).items()} == expected


def test_references_are_computed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cached values are equal bit for bit; another episode length or a damaged file is computed again."""
    calls = []

    def evaluate(self: Problem, batch: list[np.ndarray]) -> list[Evaluation]:
        calls.append(len(batch))
        return [Evaluation(0.1 * number, {}, np.zeros(0)) for number in range(len(batch))]

    monkeypatch.setattr(Problem, "evaluate_batch", evaluate)
    first = reference_scores(cell())
    assert reference_scores(replace(cell(), seed=5)) == first
    assert calls == [DRAWS, 1]
    reference_scores(cell(frames=7))
    assert len(calls) == 4
    for path in (tmp_path / "references").iterdir():
        path.write_text("{")
    assert reference_scores(cell()) == first
    assert len(calls) == 6


def test_a_body_that_is_always_driven_is_idle_without_its_controller() -> None:
    """With a fixed controller the reference is the first body drawn, with muscles at rest."""
    references = reference_scores(cell(design="voxel", controller="fixed-sine"))
    assert references["idle_score"].value != references["random_score"].value
    assert abs(references["idle_score"].value) < 0.05
