"""Jobs of Slurm, by submitit's local executor: processes that stand for jobs."""

import time
from functools import partial
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT
from tests.harness.helpers import enqueue, fake
from zoobench.db.rows import RunRow, RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError, ZoobenchError
from zoobench.harness.engines import engine_named
from zoobench.harness.slurm_pool import SlurmPool, SlurmSettings
from zoobench.harness.worker_pool import run_all


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the database will be; jobs find the tests."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path / "zoo.db"


def local(path: Path, **options: int) -> partial[SlurmPool]:
    """An engine whose jobs are processes of this machine."""
    return partial(SlurmPool, settings=SlurmSettings(options, "local", path.parent / "jobs"))


def test_jobs_do_every_run_once(path: Path) -> None:
    """The log of each begins with where the output of its job is."""
    ids = enqueue(path, 2)
    rows = run_all(path, ids, jobs=1, child=fake(), engine=local(path))
    assert [(row.state, row.attempt) for row in rows] == [(RunState.DONE, 1)] * 2
    with Store(path) as store:
        for run_id in ids:
            note = store.logs(run_id)[0].text
            assert note.startswith("Slurm job ")
            assert Path(note.rpartition(" ")[2]).is_file()


@pytest.mark.slow
@pytest.mark.usefixtures("ctrl_c")  # by which submitit cancels the processes that stand for jobs
def test_an_interrupt_cancels_the_jobs(path: Path) -> None:
    """Their runs are handed back, to go on with."""

    def interrupt(rows: list[RunRow]) -> None:
        if rows[0].fraction > 0.0:
            raise KeyboardInterrupt

    ids = enqueue(path)
    with pytest.raises(KeyboardInterrupt):
        run_all(path, ids, child=fake(iterations=4000), engine=local(path), on_update=interrupt)
    with Store(path) as store:
        for _ in range(600):  # the job ends in its own time
            if RunState.RUNNING not in store.counts():
                break
            time.sleep(0.1)
        assert store.counts() == {RunState.QUEUED: 1}


@pytest.mark.slow
def test_a_job_that_fails_is_told_with_its_output(path: Path) -> None:
    """A job that cannot open the database, as one that its node does not reach."""
    ids = enqueue(path)

    def spoil(rows: list[RunRow]) -> None:
        if path.exists():
            path.rename(path.with_name("moved.db"))

    with pytest.raises(ZoobenchError, match="There is no database"):
        run_all(path, ids, child=fake(), engine=local(path), on_update=spoil)


@pytest.mark.parametrize("name", ["moon", "slurm[time=soon]", "ray[cpus=2]"])
def test_engines_that_are_none_are_refused(name: str) -> None:
    """At once, with what can be written."""
    with pytest.raises(UsageError):
        engine_named(name)


@pytest.mark.parametrize("name", ["slurm", "ray=auto"])
def test_an_extra_that_is_not_installed_is_named(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is queued."""
    monkeypatch.setattr("zoobench.harness.engines.find_spec", lambda _: None)
    with pytest.raises(UsageError, match="pip install 'zoobench"):
        engine_named(name)


def test_where_there_is_no_slurm_it_says_so(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is done."""
    monkeypatch.setenv("PATH", "")
    engine = engine_named("slurm[partition=cpu,time=10]")
    assert engine is not None
    with pytest.raises(UsageError, match="no Slurm here"):
        run_all(path, enqueue(path), child=fake(), engine=engine)
