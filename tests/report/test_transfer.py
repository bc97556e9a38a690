"""The transfer matrix."""

from typing import Any

from zoobench.report.transfer import newest, transfer_matrix


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
    assert found.columns[-2:] == ("ice", "ocean")
    (line,) = found.rows
    assert line[:6] == ("turning", "draft", "fish", "cmaes", "ocean", 100)
    assert line[6:] == ("0.5 m/s (n=1, 1 diverged)", "2 ± 13 m/s (n=2)")
    assert found.bold == {(0, 7)}


def test_homes_and_fidelities_have_rows_of_their_own() -> None:
    """Nothing is averaged over what must not be compared; a place that was not tried is empty."""
    rows = [row(1, "ice-v1", 1.0), row(2, "ice-v1", 2.0, home="ice-v1"), row(1, "snow-v1", None, fidelity="paper-v1")]
    found = transfer_matrix(rows)
    assert sorted((line[1], line[4], *line[6:]) for line in found.rows) == [
        ("draft", "ice", "2 m/s (n=1)", None),
        ("draft", "ocean", "1 m/s (n=1)", None),
        ("paper", "ocean", None, "1 diverged"),
    ]


def test_the_last_evaluation_counts() -> None:
    """A solution that was tried again is not counted twice."""
    rows = [row(1, "ice-v1", 1.0), row(1, "ice-v1", 2.0)]
    assert [found["score"] for found in newest(rows)] == [2.0]


def test_nothing_makes_an_empty_matrix() -> None:
    """No rows, and the columns that every matrix has."""
    assert transfer_matrix([]).rows == ()
