"""The shipped migrations make the tables that the models describe."""

import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import text

from tests.harness.helpers import spec
from zoobench.db import schema
from zoobench.db.models import Base
from zoobench.db.store import Store


def test_the_migrations_give_what_the_models_say(location: str) -> None:
    """A model that is changed without a migration is found here."""
    with Store(location) as store, store._database.read() as session:
        context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []


def test_the_newest_revision_is_the_one_that_the_code_expects() -> None:
    """`HEAD` is kept by hand so that opening a database need not import Alembic."""
    assert ScriptDirectory(str(schema._MIGRATIONS)).get_current_head() == schema.HEAD


def test_the_database_has_a_write_ahead_log(tmp_path: Path) -> None:
    """Readers do not wait for the writer, and references are checked."""
    with Store(tmp_path / "zoo.db") as store, store._database.read() as session:
        assert session.scalar(text("PRAGMA journal_mode")) == "wal"
        assert session.scalar(text("PRAGMA foreign_keys")) == 1


def test_an_existing_database_opens_without_alembic(location: str) -> None:
    """Only the first opening pays for the import."""
    Store(location).close()
    code = (
        "import sys; from zoobench.db.store import Store; "
        f"Store({location!r}).close(); sys.exit('alembic' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_an_older_database_is_copied_before_it_is_changed(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """It is said, and the copy opens with what made it; an earlier copy stays."""
    path = tmp_path / "zoo.db"
    with Store(path) as store:
        store.enqueue([spec()])
        with store._database.write() as session:
            session.execute(text("UPDATE alembic_version SET version_num = '0008'"))
            session.execute(text("DROP INDEX ix_runs_queue"))
            session.execute(text("ALTER TABLE runs DROP COLUMN rank"))
    (tmp_path / "zoo.db.schema-0008").write_text("an earlier copy")
    with Store(path) as store:
        assert [run.spec for run in store.runs()] == [spec()]
    (record,) = caplog.records
    copy = tmp_path / "zoo.db.schema-0008-1"
    assert str(copy) in record.message
    with sqlite3.connect(copy) as connection:
        assert connection.execute("SELECT version_num FROM alembic_version").fetchall() == [("0008",)]
        assert connection.execute("SELECT count(*) FROM runs").fetchall() == [(1,)]
    connection.close()
    assert (tmp_path / "zoo.db.schema-0008").read_text() == "an earlier copy"
    caplog.clear()
    Store(path).close()
    assert caplog.records == []
