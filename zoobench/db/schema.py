"""Migration of a database to the schema of this code; unknown schemas are refused."""

import logging
from itertools import count
from pathlib import Path

from sqlalchemy import inspect, text
from sqlalchemy.orm import Session

from zoobench.db.engine import Database
from zoobench.errors import StorageError

_REVISIONS = tuple(f"{number:04}" for number in range(1, 10))
"""Those under migrations/versions, oldest first."""
HEAD = _REVISIONS[-1]
_LOG = logging.getLogger(__name__)
_MIGRATIONS = Path(__file__).parent / "migrations"


def prepare(database: Database) -> None:
    """Make the tables in an empty database, bring an older one up to date, and check the schema of any other.

    An older one is told of, and of an SQLite file a copy is kept.

    Raises:
        StorageError: the tables are another program's, or those of a newer zoobench; or somebody has added to them.
    """
    with database.read() as session:
        revision = _revision(session, database.name)
        if database.path is not None:
            _refuse_additions(session, database.name)
    if revision not in (None, *_REVISIONS):
        raise StorageError(
            f"{database.name} has schema {revision}, and this zoobench knows schemas up to {HEAD}. "
            "Update with `pip install --upgrade zoobench`, or name another database with --db."
        )
    if revision != HEAD and database.is_read_only:
        raise StorageError(
            f"{database.name} has schema {revision or 'none'}, and cannot be brought to {HEAD} where it is read-only. "
            "Copy it to a writable place, and name the copy with --db."
        )
    database.use_log()
    if revision != HEAD:
        with database.write(alone=True) as session:  # another process may be at it too
            if (revision := _revision(session, database.name)) != HEAD:
                if revision is not None:
                    _tell(database, revision)
                _migrate(session)


def _revision(session: Session, name: str) -> str | None:
    """The schema revision, None for a database without tables."""
    tables = inspect(session.connection()).get_table_names()
    if not tables:
        return None
    if "alembic_version" not in tables or "specs" not in tables:
        raise StorageError(f"{name} holds the tables of another program. Give another path with --db.")
    return str(session.scalar(text("SELECT version_num FROM alembic_version")))


def _refuse_additions(session: Session, name: str) -> None:
    """Refuse a file with triggers or views, which no zoobench makes and which may change stored data."""
    statement = "SELECT type, name FROM sqlite_master WHERE type IN ('trigger', 'view') ORDER BY name"
    added = session.execute(text(statement)).first()
    if added is not None:
        raise StorageError(
            f"{name} has the {added[0]} {ascii(added[1])[:60]}, which no zoobench makes: it may change results. Remove "
            "it, or name another database with --db."
        )


def _tell(database: Database, revision: str) -> None:
    """Say that a database is brought up to date, and keep a copy of it if it is a file."""
    kept = "An earlier zoobench cannot open it any more."
    if database.path is not None:
        first = database.path.with_name(f"{database.path.name}.schema-{revision}")
        copy = next(path for number in count() if not (path := _numbered(first, number)).exists())
        database.copy_to(copy)
        kept = f"A copy as it was is {copy}."
    _LOG.warning(
        "%s is of an earlier zoobench and is brought from schema %s to %s. %s", database.name, revision, HEAD, kept
    )


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.name}-{number}") if number else path


def _migrate(session: Session) -> None:
    # Alembic takes a third of a second to import, and is needed only where a database is made or outdated.
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    config.attributes["connection"] = session.connection()
    command.upgrade(config, "head")
