"""The transfer matrix."""

from typing import Any

import pytest

from zoobench.report.transfer_table import newest, transfer_matrix


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
    found = transfer_matrix(rows)
    assert found.columns[-2:] == ("ice", "ocean †")
    (line,) = found.rows
    assert line[:6] == ("turning", "draft", "fish", "cmaes", "ocean †", 100)
    assert line[6:] == ("0.5 m/s (n=1, 1 diverged)", "2 ± 13 m/s (n=2)")
    assert found.bold == {(0, 7)}


def test_homes_and_fidelities_have_rows_of_their_own() -> None:
    """Nothing is averaged over what must not be compared; a place that was not tried is empty."""
    rows = [row(1, "ice-v1", 1.0), row(2, "ice-v1", 2.0, home="ice-v1"), row(1, "snow-v1", None, fidelity="paper-v1")]
    found = transfer_matrix(rows)
    assert sorted((line[1], line[4], *line[6:]) for line in found.rows) == [
        ("draft", "ice", "2 m/s (n=1)", None),
        ("draft", "ocean †", "1 m/s (n=1)", None),
        ("paper", "ocean †", None, "1 diverged"),
    ]


@pytest.mark.parametrize(
    ("other", "column", "names"),
    [
        ({"home": ["ocean-v4", "movement-speed-v1", "draft-v1"]}, "found_for", {"movement-speed", "turning"}),
        ({"home": ["ocean-v4", "turning-v1", "paper-v1"]}, "found_at", {"draft", "paper"}),
        ({"controller": "trajectory-v1"}, "controller", {"sine-basis", "trajectory"}),
        ({"budget": "9 substeps"}, "budget", {"5 substeps", "9 substeps"}),
    ],
)
def test_what_was_found_otherwise_is_not_averaged(other: dict[str, Any], column: str, names: set[str]) -> None:
    """For another task or fidelity, with another controller or budget: a row of its own, and a column that says it."""
    usual = {"controller": "sine-basis-v1", "budget": "5 substeps"}
    rows = [row(1, "ice-v1", 1.0) | usual, row(2, "ice-v1", 3.0) | usual | other]
    found = transfer_matrix(rows)
    assert {line[found.columns.index(column)] for line in found.rows} == names
    assert sorted(line[-1] for line in found.rows) == ["1 m/s (n=1)", "3 m/s (n=1)"]


def test_only_where_it_was_found_is_stressed() -> None:
    """The same environment with another task is not its home."""
    found = transfer_matrix([row(1, "ocean-v4", 1.0) | {"task": "movement-speed-v1"}, row(1, "ocean-v4", 2.0)])
    assert [line[0] for line in found.rows] == ["movement-speed", "turning"]
    assert found.bold == {(1, 6)}


def test_smoke_is_left_out() -> None:
    """Its numbers mean nothing, tried there or found there."""
    found_there = row(2, "ice-v1", 1.0) | {"home": ["ocean-v4", "turning-v1", "smoke-v1"]}
    assert transfer_matrix([row(1, "ice-v1", 1.0, fidelity="smoke-v1"), found_there]).rows == ()


def test_the_last_evaluation_counts() -> None:
    """A solution that was tried again is not counted twice."""
    rows = [row(1, "ice-v1", 1.0), row(1, "ice-v1", 2.0)]
    assert [found["score"] for found in newest(rows)] == [2.0]


def test_nothing_makes_an_empty_matrix() -> None:
    """No rows, and the columns that every matrix has."""
    assert transfer_matrix([]).rows == ()
