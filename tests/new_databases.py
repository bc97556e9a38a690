"""Databases for the tests: the statements of the migrations are made once, and nothing waits for the disk."""

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from sqlalchemy import Connection, Engine, event
from sqlalchemy.orm import Session

from zoobench.db import schema

_Statement = tuple[str, Any]
_READS = ("SELECT", "PRAGMA")


@contextmanager
def repeated_migrations() -> Iterator[None]:
    """The first new database of each kind is made by the migrations, the others by the statements of that one.

    To bring an empty database up to date takes Alembic a hundred times as long as to carry out what it says. A database
    with an older schema is migrated as ever.
    """
    migrate, known = schema._migrate, dict[str, list[_Statement]]()

    def repeat(session: Session) -> None:
        connection = session.connection()
        if schema._revision(session, "") is not None:
            migrate(session)
        elif (statements := known.get(connection.dialect.name)) is None:
            known[connection.dialect.name] = _noted(connection, lambda: migrate(session))
        else:
            for statement, parameters in statements:
                connection.exec_driver_sql(statement, parameters)

    schema._migrate = repeat
    try:
        yield
    finally:
        schema._migrate = migrate


@contextmanager
def unsynced_files() -> Iterator[None]:
    """SQLite leaves it to the system when to write: only a machine that loses its power could lose what was stored."""

    def configure(connection: Any, _record: object) -> None:
        if isinstance(connection, sqlite3.Connection):
            connection.execute("PRAGMA synchronous = OFF")

    event.listen(Engine, "connect", configure)
    try:
        yield
    finally:
        event.remove(Engine, "connect", configure)


def _noted(connection: Connection, action: Callable[[], None]) -> list[_Statement]:
    """What an action writes through a connection."""
    statements: list[_Statement] = []

    def note(_connection: Any, _cursor: Any, statement: str, parameters: Any, _context: Any, _many: bool) -> None:
        if not statement.lstrip().startswith(_READS):
            statements.append((statement, parameters))

    event.listen(connection, "before_cursor_execute", note)
    try:
        action()
    finally:
        event.remove(connection, "before_cursor_execute", note)
    return statements
