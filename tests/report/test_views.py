"""Listings of runs and the card of one run."""

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from tests.report.content import add_done, claim_new, fill, make_spec
from zoobench.cli.progress import describe
from zoobench.db.rows import Batch, RunState
from zoobench.db.store import Store
from zoobench.report.run_results import choose_results
from zoobench.report.views import (
    counts_text,
    duration,
    finals_shown,
    results_listing,
    results_overview,
    results_record,
    running_listing,
    running_overview,
)
from zoobench.spec import Budget, Ref, RunSelection, repeat_command


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(None, "unknown"), (0.4, "0 s"), (59.6, "1 min 00 s"), (185, "3 min 05 s"), (7800, "2 h 10 min")],
)
def test_time_spans_read_well(seconds: float | None, text: str) -> None:
    """Seconds, minutes and hours, whichever fit."""
    assert duration(seconds) == text


def test_every_final_is_a_column_with_its_unit(tmp_path: Path) -> None:
    """A run without the value has an empty cell."""
    with Store(fill(tmp_path / "runs.db"), create=False) as store:
        listing = results_listing(choose_results(store, RunSelection()))
    records = listing.records()
    assert records[0]["distance [m]"] == 2.0
    assert records[0]["score [m/s]"] == 1.0
    assert records[9]["state"] == "failed"
    assert records[9]["score [m/s]"] is None


def test_the_overview_says_in_what_runs_differ(tmp_path: Path) -> None:
    """Controller, frames and budget are columns only where there is more than one."""
    with Store(tmp_path / "runs.db") as store:
        add_done(store, make_spec(), 1.0)
        assert "budget" not in results_overview(choose_results(store, RunSelection())).columns
        add_done(store, replace(make_spec(), budget=Budget("episodes", 7), frames=33), 2.0)
        listing = results_overview(choose_results(store, RunSelection()))
    assert {"budget", "frames"} <= set(listing.columns)
    assert "controller" not in listing.columns
    last = listing.records()[-1]
    assert (last["frames"], last["budget"], last["score"]) == (33, "7 episodes", 2.0)


def test_people_are_shown_errors_and_programs_scores(tmp_path: Path) -> None:
    """A path missed by 20 mm is an error of 0.02 m; beside other tasks, the unit says that less is better."""
    path = replace(make_spec(), task=Ref("waypoint-following", 1))
    with Store(tmp_path / "runs.db") as store:
        add_done(store, path, -0.02, unit="m")
        claim = claim_new(store, replace(path, seed=1))
        store.commit(claim, Batch(fraction=0.5, score=-0.03))
        listing = results_overview(choose_results(store, RunSelection()))
        assert (listing.records()[0]["error"], listing.records()[0]["unit"]) == (0.02, "m, less is better")
        running = [run for run in store.runs() if run.state is RunState.RUNNING]
        assert running_overview(running).records()[0]["error"] == 0.03
        assert running_listing(running).records()[0]["score"] == -0.03
        assert describe(running[0]).endswith(", error 0.03 m")
        add_done(store, make_spec(), 1.0)
        both = results_overview(choose_results(store, RunSelection())).records()
        record = results_record(choose_results(store, RunSelection())[0])
    assert [row["score or error"] for row in both] == [0.02, None, 1.0]
    assert record["finals"]["score"]["value"] == -0.02
    finals = {name: {"value": -0.02, "unit": "m"} for name in ("idle_score", "score", "drift")} | {
        "random_score": {"value": None, "unit": "m"}
    }
    assert finals_shown(path.task, finals) == [
        ("idle_error", 0.02, "m"), ("error", 0.02, "m"), ("drift", -0.02, "m"), ("random_error", None, "m")
    ]  # fmt: skip
    assert [name for name, *_ in finals_shown(make_spec().task, finals)] == list(finals)


def test_records_mark_smoke_runs(tmp_path: Path) -> None:
    """Programs that read results can leave them out, too."""
    with Store(fill(tmp_path / "runs.db"), create=False) as store:
        records = [results_record(result) for result in choose_results(store, RunSelection())]
    assert [record["run"] for record in records if record["is_smoke"]] == [13]


def test_runs_in_progress_show_their_age_and_lease(tmp_path: Path) -> None:
    """Ages count from the last report, the lease to its end."""
    with Store(fill(tmp_path / "runs.db"), create=False) as store:
        (run,) = store.runs(states=[RunState.RUNNING])
    assert run.progress_at is not None
    record = running_listing([run], now=run.progress_at + 20.0).records()[0]
    assert record["metric_age_s"] == 20
    assert 30 <= record["lease_s"] <= 41
    assert (record["progress"], record["score"], record["attempt"]) == (0.25, 0.05, 1)
    assert running_overview([run]).reading()[0][8] == "25%"


def test_the_repeat_command_states_every_axis() -> None:
    """What it says is the whole spec, the one seed as a list of one."""
    words = shlex.split(repeat_command(make_spec(seed=4, budget="1.5 seconds")))
    options = dict(zip(words[2::2], words[3::2], strict=True))
    assert words[:2] == ["zoobench", "run"]
    assert options["--method"] == "diffphysics-v2[lr=0.1]"
    assert options["--seeds"] == "4,"
    assert options["--budget"] == "1.5 seconds"
    assert options["--frames"] == "10"


def test_counts_read_as_a_sentence() -> None:
    """States without runs are left out."""
    assert counts_text({RunState.DONE: 3, RunState.RUNNING: 1}) == "1 running, 3 done"
    assert counts_text({}) == "no runs"
