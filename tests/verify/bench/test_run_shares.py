"""Shares of a run's processor time: what is added up, and what is refused."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from zoobench.errors import UsageError, ZoobenchError
from zoobench_verify.bench import run_shares
from zoobench_verify.bench.run_shares import measure_run, share


def times(loading: float, launching: float, kernel: float) -> dict[str, float]:
    """What `launch_clock` writes of a kernel."""
    return {"calls": 10, "loading_s": loading, "launching_s": launching, "kernel_s": kernel}


def test_processes_and_launchers_are_added_up(tmp_path: Path) -> None:
    """Two processes, one with two launchers; all parts together are the whole."""
    first = [{"advance": times(1.0, 0.5, 20.0), "survey": times(0.0, 0.0, 1.0)}, {"advance": times(0.0, 0.5, 10.0)}]
    second = [{"advance": times(1.0, 1.0, 10.0), "reverse": times(2.0, 1.0, 20.0)}]
    for name, launches in (("1", first), ("2", second)):
        (tmp_path / f"{name}.json").write_text(json.dumps({"process_s": 40.0, "launches": launches}))
    found = share("--env ground", 100.0, 55.0, tmp_path)
    assert (found.processes, found.cpu_s, found.wall_s) == (2, 100.0, 55.0)
    assert (found.advance_s, found.reverse_s, found.survey_s) == (40.0, 20.0, 1.0)
    assert (found.loading_s, found.launching_s) == (4.0, 3.0)
    assert found.rest_s == pytest.approx(100.0 - 61.0 - 7.0)


def test_a_run_that_fails_is_reported_with_its_last_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """As `run` itself says it."""

    def fail(words: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(words, 2, "", "0 new\nUnknown environment 'dessert'.\n")

    monkeypatch.setattr(run_shares.subprocess, "run", fail)
    with pytest.raises(ZoobenchError, match=r"zoobench run --env dessert` failed: Unknown environment 'dessert'"):
        measure_run("--env dessert")


def test_unreadable_options_are_refused() -> None:
    """An open quotation mark is noticed before anything runs."""
    with pytest.raises(UsageError, match="Cannot read the options"):
        measure_run("--env 'ground")


def test_the_run_has_a_database_of_its_own_and_is_timed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The user's database is not touched; processor time is that of the processes."""
    seen: list[list[str]] = []
    clock = iter([10.0, 34.0])

    def pretend(words: list[str], env: dict[str, str], **_: Any) -> subprocess.CompletedProcess[str]:
        seen.append(words)
        record = {"process_s": 1.0, "launches": [{"advance": times(0.0, 0.0, 18.0)}]}
        (Path(env[run_shares.VARIABLE]) / "7.json").write_text(json.dumps(record))
        return subprocess.CompletedProcess(words, 0, "", "")

    monkeypatch.setattr(run_shares.subprocess, "run", pretend)
    monkeypatch.setattr(run_shares, "_seconds_of_children", lambda: next(clock))
    monkeypatch.setenv("ZOOBENCH_DB", str(tmp_path / "mine.db"))
    found = measure_run("--env ground -j 1")
    assert (found.cpu_s, found.advance_s) == (24.0, 18.0)
    assert seen[0][3:6] == ["run", "--env", "ground"]
    assert "mine.db" not in seen[0][seen[0].index("--db") + 1]


@pytest.mark.slow
def test_where_a_smoke_run_spends_its_time() -> None:
    """Both of its runs have told; launches and loading are a part of the time of all processes."""
    found = measure_run("--env ground --task turning --smoke -j 1")
    assert found.processes == 2
    assert min(found.launching_s, found.loading_s, found.rest_s) > 0
    assert found.launching_s + found.loading_s < found.cpu_s
    assert found.advance_s < found.cpu_s
