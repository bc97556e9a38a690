"""Studies in the database: rows kept as they come, older databases brought up to date."""

from collections.abc import Iterator

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import text

from tests.harness.helpers import spec
from zoobench.db.models import Base
from zoobench.db.query import Reader
from zoobench.db.rows import StudyRow
from zoobench.db.store import Store

FIRST = StudyRow("free-fall", "pass", {"measured": [1.5, float("nan")], "bound": float("inf"), "steps": 3})
SECOND = StudyRow("spray", "fail", {"measured": {"energy": 2.0}})


def test_a_study_comes_back_as_it_was_stored(location: str) -> None:
    """Order, verdicts and documents are kept; numbers that JSON cannot hold become words."""
    with Store(location) as store:
        handed_on = list(store.save_study("stability", [FIRST, SECOND], provenance={"code": "abc"}))
        assert handed_on == [FIRST, SECOND]
    with Reader(location, create=False) as reader:
        study = reader.study("stability")
        assert study is not None
        assert study.finished_at is not None
        assert study.started_at <= study.rows[0].finished_at <= study.rows[1].finished_at <= study.finished_at
        assert study.provenance == {"code": "abc"}
        assert [(row.case, row.verdict) for row in study.rows] == [("free-fall", "pass"), ("spray", "fail")]
        assert study.rows[0].document == {"measured": [1.5, "nan"], "bound": "+inf", "steps": 3}


def test_an_interrupted_study_keeps_what_was_done(location: str) -> None:
    """The row of the case before the interruption is there, and the study is not called finished."""

    def rows() -> Iterator[StudyRow]:
        yield FIRST
        raise KeyboardInterrupt

    with Store(location) as store:
        with pytest.raises(KeyboardInterrupt):
            list(store.save_study("stability", rows(), provenance={}))
        study = store.study("stability")
        assert study is not None
        assert [row.case for row in study.rows] == ["free-fall"]
        assert study.finished_at is None


def test_a_damaged_row_is_left_out(location: str, caplog: pytest.LogCaptureFixture) -> None:
    """With a word; who reads the others needs what each row says."""
    with Store(location) as store:
        list(store.save_study("stability", [FIRST, SECOND], provenance={}))
        with store._database.write() as session:
            session.execute(text("UPDATE study_rows SET document = 'x' WHERE number = 0"))
        study = store.study("stability")
    assert study is not None
    assert [row.case for row in study.rows] == ["spray"]
    assert [record.message for record in caplog.records] == ["Row 0 of study 1 is damaged. It is left out."]


def test_the_newest_study_of_a_name_is_given(location: str) -> None:
    """Studies of other names do not matter, and of a name never used there is none."""
    with Store(location) as store:
        for name, row in (("stability", FIRST), ("stability", SECOND), ("validate", FIRST)):
            list(store.save_study(name, [row], provenance={}))
        newest = store.study("stability")
        assert newest is not None
        assert newest.rows[0].case == "spray"
        assert len(store.studies("stability")) == 2
        assert store.study("accuracy") is None


def _age(location: str) -> None:
    """Bring a database back to the first schema, which had runs and their numbers alone."""
    newer = ("study_rows", "studies", "solutions", "archives", "milestones", "reference_scores", "sweep_runs", "sweeps")
    with Store(location) as store, store._database.write() as session:
        for table in newer:
            session.execute(text(f"DROP TABLE {table}"))
        for index in ("ix_specs_controller", "ix_specs_fidelity", "ix_runs_finished_at", "ix_runs_queue"):
            session.execute(text(f"DROP INDEX {index}"))
        for column in ("digest", "rank"):
            session.execute(text(f"ALTER TABLE runs DROP COLUMN {column}"))
        session.execute(text("UPDATE alembic_version SET version_num = '0001'"))


def test_an_older_database_is_brought_up_to_date(location: str) -> None:
    """Opening one of the first schema, to write or only to read, adds what is missing and loses nothing."""
    with Store(location) as store:
        store.enqueue([spec()])
    for opened in (Store, Reader):
        _age(location)
        with opened(location) as reader:
            assert [run.spec for run in reader.runs()] == [spec()]
            assert reader.studies("stability") == []
            assert reader.solution(1) is None
            assert reader.archive(1) is None
            assert reader.milestones(1) == []
    with Store(location) as store:
        list(store.save_study("stability", [FIRST], provenance={}))
        with store._database.read() as session:
            context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
            assert compare_metadata(context, Base.metadata) == []
