"""Two databases become one."""

import shutil
from pathlib import Path

import pytest
from sqlalchemy import update

from tests.harness.helpers import fake, numbers, spec, work_on_fakes
from tests.report.content import add_done, claim_new, make_spec
from zoobench.db.models import FinalRecord, MetricRecord, RunRecord
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, RunState
from zoobench.db.store import Store


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database with two finished runs of the fake child and one that is queued with a checkpoint."""
    path = tmp_path_factory.mktemp("made") / "other.db"
    work_on_fakes(path, 2)
    with Store(path) as store:
        claim = claim_new(store, spec(2))
        store.commit(claim, Batch(checkpoint=b"half", fraction=0.5))
        store.finish(claim, Ending(RunState.CANCELLED), Batch())
    return path


@pytest.fixture
def other(made: Path, tmp_path: Path) -> Path:
    """A second database, a copy of it."""
    return Path(shutil.copy(made, tmp_path))


def test_runs_are_added_with_all_that_is_stored_of_them(location: str, other: Path) -> None:
    """Results, attempts, logs and digests are those of the other; what is queued goes on from its checkpoint here."""
    with Store(location) as store, Store(other) as source:
        add_done(store, make_spec(), 1.0)
        assert store.merge(source).added == (2, 3, 4)
        assert store.damage() == []
        assert store.unsealed() == 0
        for here, there in ((2, 1), (3, 2), (4, 3)):
            assert store.runs(ids=[here])[0].key == source.runs(ids=[there])[0].key
            assert [vars(item) for item in store.attempts(here)] == [vars(item) for item in source.attempts(there)]
            assert store.logs(here) == source.logs(there)
            assert store.solution(here) == source.solution(there)
        claim = store.claim(Owner.current(), provenance={}, ids=[4])
        assert claim is not None
        assert (claim.checkpoint, claim.attempt) == (b"half", 2)
    assert numbers(location, 2) == numbers(other, 1)


@pytest.mark.slow
def test_what_both_have_done_must_agree_bit_for_bit(tmp_path: Path, other: Path) -> None:
    """The same run done twice agrees, though its times do not; another last digit is reported, and that here stays."""
    path = tmp_path / "zoo.db"
    work_on_fakes(path, 2, child=fake(pause=0.0))
    with Store(path) as store, Store(other) as source:
        report = store.merge(source)
        assert (report.agreeing, report.added, report.differing) == ((1, 2), (3,), ())
        with store._database.write() as session:
            number = store.finals(1)[-1].value
            changed = update(FinalRecord).where(FinalRecord.run_id == 1, FinalRecord.name == "score")
            session.execute(changed.values(value=number * (1.0 + 2.0**-52)))
        report = store.merge(source)
        assert report.agreeing == (2,)
        (difference,) = report.differing
        assert (difference.here, difference.there, difference.parts) == (1, 1, ("finals",))
        assert store.finals(1)[-1].value != number


def test_what_is_not_done_here_is_taken_from_the_other(tmp_path: Path, other: Path) -> None:
    """A queued and a failed run become the finished ones; a run in progress here is left alone."""
    path = tmp_path / "zoo.db"
    with Store(path) as store, Store(other) as source:
        store.finish(claim_new(store, spec(0)), Ending(RunState.FAILED, "a reason"), Batch())
        claim_new(store, spec(1))
        report = store.merge(source)
        assert (report.completed, report.kept, report.added) == ((1,), (2,), (3,))
        assert store.runs(ids=[1])[0].reason is None
        assert store.damage() == []
    assert numbers(path, 1) == numbers(other, 1)


def test_damaged_runs_and_those_in_progress_are_left_out(tmp_path: Path, other: Path) -> None:
    """Each with its reason."""
    with Store(tmp_path / "zoo.db") as store, Store(other) as source:
        with source._database.write() as session:
            session.execute(update(FinalRecord).where(FinalRecord.run_id == 1).values(value=7.0))
        claim_new(source, spec(3))
        report = store.merge(source)
        assert len(report.added) == 2
        assert dict(report.left_out).keys() == {1, 4}
        assert "damaged" in dict(report.left_out)[1]
        assert "in progress" in dict(report.left_out)[4]


def test_curves_with_other_times_agree(tmp_path: Path) -> None:
    """Wall time is no result; a point of any other curve is."""
    with Store(tmp_path / "a.db") as store, Store(tmp_path / "b.db") as source:
        for each, time, score in ((store, 1.0, 2.0), (source, 3.0, 2.0)):
            claim = claim_new(each, make_spec())
            points = {("seconds", 1): time, ("score", 1): score}
            each.finish(claim, Ending(RunState.DONE, params=(0.5,)), Batch(metrics=points))
        assert store.merge(source).agreeing == (1,)
        with source._database.write() as session:
            session.execute(update(MetricRecord).where(MetricRecord.name == "score").values(value=2.5))
            session.execute(update(RunRecord).values(digest=None))
        assert store.merge(source).differing[0].parts == ("curves",)
