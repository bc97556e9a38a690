"""Results as data frames and as Parquet."""

import math
from pathlib import Path

import pandas as pd
import pytest

import zoobench
from tests.report.content import add_curve, fill, make_spec
from zoobench.db.frames import Frames
from zoobench.db.parquet import export_metrics, export_results
from zoobench.db.store import Store
from zoobench.errors import StorageError, UsageError
from zoobench.spec import RunSelection


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A bit of everything, and a run with curves."""
    path = fill(tmp_path / "zoo.db")
    with Store(path) as store:
        add_curve(store, make_spec(env="clay-v1"), [1.0, None, 3.0])
    return path


def test_results_have_a_row_per_run(path: Path) -> None:
    """Every number keeps every bit; a run without a result has NaN and its state."""
    found = zoobench.load(path).results()
    with Store(path) as store:
        runs = store.runs()
        assert list(found["run"]) == [run.id for run in runs]
        assert list(found["key"]) == [run.key for run in runs]
        assert list(found["state"]) == [str(run.state) for run in runs]
        for run, score in zip(runs, found["score [m/s]"], strict=True):
            stored = {final.name: final.value for final in store.finals(run.id)}.get("score", math.nan)
            assert score == stored or (math.isnan(score) and math.isnan(stored))
    assert found.groupby("method")["seed"].count().sum() == len(found)


def test_selectors_choose_runs(path: Path) -> None:
    """As on the command line; an axis or a name that is none is refused."""
    frames = Frames(path)
    assert set(frames.results(env="ice", method="rand*")["run"]) == {10, 11, 12}
    with pytest.raises(UsageError, match="no axis"):
        frames.results(animal="fish")
    with pytest.raises(UsageError):
        frames.results(env="moon")


def test_curves_have_a_row_per_step(path: Path) -> None:
    """`metrics` has a row for each point, `curves` a column for each name, NaN where there is no point."""
    frames = Frames(path)
    curves = frames.curves(env="clay")
    assert list(curves["step"]) == [1, 2, 3]
    assert list(curves["score"].fillna(-1.0)) == [1.0, -1.0, 3.0]
    assert list(curves["substeps"]) == [100.0, 200.0, 300.0]
    assert list(frames.metrics("score", env="clay")["value"]) == [1.0, 3.0]


def test_parquet_files_are_the_frames(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Written a few runs at a time they hold the same values and types."""
    monkeypatch.setattr("zoobench.db.frames._RUNS_AT_ONCE", 3)
    frames, file = Frames(path), tmp_path / "zoo.parquet"
    assert export_results(path, file, RunSelection()) == len(frames.results())
    read = pd.read_parquet(file)
    written = frames.results()
    assert list(read) == list(written)
    same = set(written) - {"seconds"}  # of a run that goes on
    assert all(written[name].astype(object).equals(read[name].astype(object)) for name in same)
    assert export_metrics(path, file, RunSelection()) == len(frames.metrics())
    assert list(pd.read_parquet(file)["value"]) == list(frames.metrics()["value"])
    assert [item.name for item in tmp_path.iterdir() if "parquet" in item.name] == ["zoo.parquet"]


def test_a_database_that_is_not_there_is_refused(tmp_path: Path) -> None:
    """Nothing is made in its place."""
    with pytest.raises(StorageError):
        zoobench.load(tmp_path / "none.db")
    assert list(tmp_path.iterdir()) == []
