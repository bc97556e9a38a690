"""The transfer matrix."""

from dataclasses import replace
from typing import Any

import pytest

from tests.report.content import make_spec
from zoobench.report.listing import Listing
from zoobench.report.transfer_table import (
    episode_listing,
    episode_overview,
    newest,
    transfer_cells,
    transfer_matrices,
    tried,
)
from zoobench.spec import Budget, Ref, RunSpec


def matrix_of(rows: list[dict[str, Any]], specs: dict[int, RunSpec] | None = None) -> Listing:
    """The one matrix of these evaluations, its cells as they read."""
    (found,) = transfer_matrices(tried(rows, specs or {}))
    return replace(found, rows=tuple(map(tuple, found.reading())))


def row(run: int, env: str, score: float | None, home: str = "ocean-v4", fidelity: str = "draft-v1") -> dict[str, Any]:
    """What is kept of one evaluation."""
    return {
        "run": run, "design": "fish-v1", "method": "cmaes-v1", "seed": run, "home": [home, "turning-v1", "draft-v1"],
        "env": env, "task": "turning-v1", "fidelity": fidelity, "frames": 100, "score": score, "unit": "m/s",
        "reason": "" if score is not None else "torn",
    }  # fmt: skip


def test_runs_of_one_home_are_averaged_in_every_place() -> None:
    """Mean, half of the Student-t interval of two (12.7 s / sqrt 2), and how many; home is stressed."""
    rows = [row(1, "ocean-v4", 1.0), row(2, "ocean-v4", 3.0), row(1, "ice-v1", 0.5), row(2, "ice-v1", None)]
    found = matrix_of(rows)
    assert found.columns[-2:] == ("ice [m/s]", "ocean † [m/s]")
    (line,) = found.rows
    assert line[:6] == ("turning", "draft", "fish", "cmaes", "ocean †", "100")
    assert line[6:] == ("0.5 (n=1, 1 diverged)", "2 ± 13 (n=2)")
    assert found.bold == {(0, 7)}


def test_homes_and_fidelities_have_rows_of_their_own() -> None:
    """Nothing is averaged over what must not be compared; a place that was not tried is empty."""
    rows = [row(1, "ice-v1", 1.0), row(2, "ice-v1", 2.0, home="ice-v1"), row(1, "snow-v1", None, fidelity="paper-v1")]
    found = matrix_of(rows)
    assert sorted((line[1], line[4], *line[6:]) for line in found.rows) == [
        ("draft", "ice", "2 (n=1)", ""),
        ("draft", "ocean †", "1 (n=1)", ""),
        ("paper", "ocean †", "", "1 diverged"),
    ]


@pytest.mark.parametrize(
    ("other", "column", "names"),
    [
        ({"home": ["ocean-v4", "movement-speed-v1", "draft-v1"]}, "found_for", {"movement-speed", "turning"}),
        ({"home": ["ocean-v4", "turning-v1", "paper-v1"]}, "found_at", {"draft", "paper"}),
    ],
)
def test_what_was_found_otherwise_is_not_averaged(other: dict[str, Any], column: str, names: set[str]) -> None:
    """For another task or at another fidelity: a row of its own, and a column that says it."""
    found = matrix_of([row(1, "ice-v1", 1.0), row(2, "ice-v1", 3.0) | other])
    assert {line[found.columns.index(column)] for line in found.rows} == names
    assert sorted(line[-1] for line in found.rows) == ["1 (n=1)", "3 (n=1)"]


@pytest.mark.parametrize(
    ("other", "column", "names"),
    [
        ({"controller": Ref("trajectory", 1)}, "controller", {"sine-basis", "trajectory"}),
        ({"budget": Budget("substeps", 9)}, "budget", {"1000 substeps", "9 substeps"}),
    ],
)
def test_what_another_run_found_is_not_averaged(other: dict[str, Any], column: str, names: set[str]) -> None:
    """With another controller or budget, which its settings tell."""
    found = matrix_of(
        [row(1, "ice-v1", 1.0), row(2, "ice-v1", 3.0)], {1: make_spec(), 2: replace(make_spec(), **other)}
    )
    assert {line[found.columns.index(column)] for line in found.rows} == names


def test_variants_of_an_environment_have_columns_of_their_own_by_size() -> None:
    """Sorted as numbers, and told apart by what differs."""
    envs = [f"ground-v4[youngs_modulus={value}]" for value in (2e4, 5e3, 4e4)]
    found = matrix_of([row(1, env, 1.0) for env in envs])
    assert found.columns[-3:] == tuple(f"ground[youngs_modulus={value}] [m/s]" for value in (5000.0, 20000.0, 40000.0))


def test_programs_get_a_row_for_each_cell() -> None:
    """With numbers as numbers, and every parameter stated."""
    rows = [row(1, "ocean-v4", 1.0), row(2, "ocean-v4", 3.0), row(1, "ice-v1", None)]
    ice, ocean = transfer_cells(tried(rows, {1: make_spec(), 2: make_spec()})).records()
    assert (ice["env"], ice["n"], ice["diverged"], ice["mean"]) == ("ice-v1", 0, 1, None)
    assert (ocean["mean"], ocean["n"], ocean["unit"], ocean["budget_amount"]) == (2.0, 2, "m/s", 1000.0)
    assert ocean["low"] < 2.0 < ocean["high"]


def test_errors_stand_apart_and_are_positive() -> None:
    """Of them less is better, which the title says."""
    paths = [row(1, "ice-v1", -0.02) | {"task": "waypoint-following-v1", "unit": "m"}]
    score, error = transfer_matrices(tried([row(2, "ice-v1", 1.0), *paths], {}))
    assert (score.title, error.title) == ("Score [m/s]", "Error [m], less is better")
    assert error.reading()[0][-1] == "0.02 (n=1)"
    (episode,) = episode_overview(paths).records()
    assert (episode["error"], episode["unit"]) == (0.02, "m, less is better")
    assert episode_listing(paths).records()[0]["score"] == -0.02


def test_only_where_it_was_found_is_stressed() -> None:
    """The same environment with another task is not its home."""
    found = matrix_of([row(1, "ocean-v4", 1.0) | {"task": "movement-speed-v1"}, row(1, "ocean-v4", 2.0)])
    assert [line[0] for line in found.rows] == ["movement-speed", "turning"]
    assert found.bold == {(1, 6)}


def test_smoke_is_left_out() -> None:
    """Its numbers mean nothing, tried there or found there."""
    found_there = row(2, "ice-v1", 1.0) | {"home": ["ocean-v4", "turning-v1", "smoke-v1"]}
    assert tried([row(1, "ice-v1", 1.0, fidelity="smoke-v1"), found_there], {}) == []


def test_the_last_evaluation_counts() -> None:
    """A solution that was tried again is not counted twice."""
    rows = [row(1, "ice-v1", 1.0), row(1, "ice-v1", 2.0)]
    assert [found["score"] for found in newest(rows)] == [2.0]


def test_nothing_makes_an_empty_matrix() -> None:
    """There is none."""
    assert transfer_matrices(tried([], {})) == []
