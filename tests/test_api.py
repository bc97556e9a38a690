"""Runs, evaluations and films from Python."""

import math
from pathlib import Path

import pandas as pd
import pytest

import zoobench
from tests.report.content import fill
from zoobench.errors import StorageError, UnknownNameError, UsageError

SETTINGS = {"task": "movement-speed", "design": "block", "method": "random[batch=2]", "smoke": True, "frames": 3}


@pytest.fixture
def db(tmp_path: Path) -> Path:
    """Where a database is not yet."""
    return tmp_path / "mine.db"


def test_runs_are_done_once_and_their_results_are_a_frame(db: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One row a run, in the order of the database; progress is told of each, and a second call does nothing."""
    told: list[tuple[int, str]] = []
    asked = {"env": "ground[friction=0.2|0.5]", "seeds": 1, "budget": "2 episodes", "jobs": 1, "db": db, **SETTINGS}
    found = zoobench.run(**asked, progress=lambda row: told.append((row.id, str(row.state))))  # type: ignore[arg-type]
    assert list(found["env.friction"]) == [0.2, 0.5]
    assert list(found["env.gravity"]) == [9.81, 9.81]  # a default
    assert list(found["state"]) == ["done", "done"]
    assert list(found["unit"]) == ["m/s", "m/s"]
    assert found["score"].notna().all()
    assert {(1, "done"), (2, "done")} <= set(told)
    pd.testing.assert_frame_equal(zoobench.run(**asked), found)  # type: ignore[arg-type]
    assert "0 new, 2 done already" in capsys.readouterr().err
    scores = zoobench.load(db).tidy_curves("score")
    assert scores.groupby("env.friction")["value"].last().tolist() == found["score"].tolist()


@pytest.mark.slow
def test_a_solution_is_evaluated_elsewhere_and_filmed(db: Path, tmp_path: Path) -> None:
    """At home its score comes out to the last bit."""
    (run,) = zoobench.run("ground", seeds=[4], budget="2 episodes", db=db, **SETTINGS).itertuples()  # type: ignore[arg-type]
    assert run.seed == 4
    found = zoobench.evaluate(1, env=["ground", "ice"], db=db)
    assert list(found["env"].str.partition("-")[0]) == ["ground", "ice"]
    assert found["score"][0] == run.score
    assert zoobench.film(1, tmp_path / "film.npz", db=db).stat().st_size > 0


def test_what_the_command_refuses_is_refused(db: Path) -> None:
    """With its words, and before a database is made."""
    for settings in ({"env": "moon", "task": "turning"}, {"env": "ice"}, {"suite": "no-such-suite"}):
        with pytest.raises(UsageError):
            zoobench.run(**settings, db=db)  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="moon"):
        zoobench.run("moon", "turning", db=db)
    with pytest.raises(UsageError, match="'lost' is no state to try again"):
        zoobench.run("ice", "turning", retry="lost", db=db)
    with pytest.raises(StorageError):
        zoobench.evaluate(1, db=db)
    assert not db.exists()
    with pytest.raises(AttributeError, match="nothing"):
        zoobench.nothing  # noqa: B018


def test_results_of_components_that_are_gone_are_read(db: Path) -> None:
    """With the parameters that they state; a run without a score has none in the frame, and its state."""
    found = zoobench.load(fill(db)).tidy()
    assert len(found) == len(zoobench.load(db).results())
    assert found["env.version"].notna().all()
    assert set(found["state"]) > {"done"}
    assert all(math.isnan(score) for score in found["score"][found["state"] != "done"])
