"""The shipped migrations make the tables that the models describe."""

import subprocess
import sys
from pathlib import Path

from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import text

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
