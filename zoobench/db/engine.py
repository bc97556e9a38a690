"""Opening a database and its transactions; the one module that depends on which database it is.

SQLite: write-ahead log, write lock from the start of every writing transaction (a deferred one fails with
"database is locked" under contention, whatever the timeout), 30 s of patience, and more while a worker may live.
On a read-only medium it is read as it is, without the files that SQLite keeps next to it. PostgreSQL opens by its URL:
readers see one snapshot, writers lock the rows that they write, with the same patience.
"""

import logging
import os
import random
import re
import shutil
import sqlite3
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

import psutil
from sqlalchemy import URL, ColumnElement, Connection, bindparam, create_engine, event, make_url, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, OperationalError
from sqlalchemy.orm import InstrumentedAttribute, Session

from zoobench.db.models import Base, RunRecord
from zoobench.db.owner import Owner
from zoobench.db.rows import RunState
from zoobench.errors import StorageError, StorageFullError, reason

_LOG = logging.getLogger(__name__)

BUSY_SECONDS = 30.0
AT_ONCE = 1_000  # values in a statement, whose length databases limit
T = TypeVar("T")

_NETWORK_FILE_SYSTEMS = frozenset(
    {"afs", "beegfs", "ceph", "cifs", "fuse.sshfs", "gpfs", "lustre", "nfs", "nfs4", "smb3", "smbfs"}
)
_NEARLY_FULL = 1 << 20  # [bytes]
_DRIVERS = ("postgresql", "postgresql+psycopg")
_ALONE = "SELECT pg_advisory_xact_lock(2053074530)"  # any number, the same for every zoobench
_LIBPQ_PATIENCE = {"connect_timeout": "10", "keepalives_idle": "30", "tcp_user_timeout": "30000"}  # [s], [s], [ms]


class Database:
    """An open database: `read` and `write` give a session; every error of it becomes a StorageError.

    `location` is a path to an SQLite file or a URL, `name` the same without a password, for messages, `path` the path
    or None. With `create` a missing file is made, without it refused; `is_read_only` tells of a file that this process
    cannot change.

    Raises:
        StorageError: the path cannot be used, as the message explains.
    """

    def __init__(self, location: str | Path, *, create: bool = True) -> None:
        self.name = without_password(str(location))
        self.path: Path | None = None
        self.is_read_only = False
        if "://" not in self.name:
            self.path = Path(location)
            _check_path(self.path, create)
            self.is_read_only = self.path.exists() and not _is_writable(self.path)
        with self._translated():
            self._engine = create_engine(_read_only_url(Path(location)) if self.is_read_only else _url(str(location)))
        if self.path is None:
            event.listen(self._engine, "connect", _configure_postgresql)
            self._reading = self._engine.execution_options(isolation_level="REPEATABLE READ", postgresql_readonly=True)
            self._writing = self._engine.execution_options(isolation_level="READ COMMITTED")
            self._alone = self._writing.execution_options(zoobench_begin=_ALONE)
        else:
            event.listen(self._engine, "connect", _configure_sqlite)
            self._reading = self._engine.execution_options(zoobench_begin="BEGIN")
            self._writing = self._alone = self._engine.execution_options(zoobench_begin="BEGIN IMMEDIATE")
        event.listen(self._engine, "begin", self._begin)

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session that sees one consistent state and writes nothing.

        Raises:
            StorageError: the database cannot be read.
        """
        with self._translated(), Session(self._reading) as session:
            yield session

    @contextmanager
    def write(self, *, alone: bool = False) -> Iterator[Session]:
        """A session whose changes are committed at the end, and rolled back on any error.

        In SQLite it holds the write lock. In PostgreSQL it locks the rows that it writes; those that write many runs,
        or several rows that others may be adding too, must ask to be `alone` among their kind, lest they wait for each
        other.

        Raises:
            StorageFullError: the disk is full; nothing of this transaction is stored, all earlier ones are.
            StorageError: the database cannot be written.
        """
        with self._translated(), Session(self._alone if alone else self._writing) as session, session.begin():
            yield session

    def use_log(self) -> None:
        """Switch an SQLite file to a write-ahead log, for good: only once it is known to be ours.

        Raises:
            StorageError: the database cannot be written.
        """
        if self.path is None or self.is_read_only:
            return
        deadline = time.monotonic() + BUSY_SECONDS
        with self._translated(), self._engine.connect() as connection:  # the mode cannot change within a transaction
            while True:
                try:
                    connection.exec_driver_sql("PRAGMA journal_mode = WAL")
                    return
                except OperationalError as error:
                    # SQLite does not wait where two switch at once, as one would wait for the other for ever
                    if not _is_busy(error) or time.monotonic() > deadline:
                        raise
                time.sleep(random.uniform(0.01, 0.1))

    def insert(self, table: type[Base]) -> Any:
        """An INSERT that offers `on_conflict_do_nothing` and `on_conflict_do_update`."""
        return sqlite.insert(table) if self.path else postgresql.insert(table)

    def alphabetical(self, column: InstrumentedAttribute[str]) -> ColumnElement[str]:
        """A column to order by that gives the same order everywhere, whatever a server's language is."""
        return column.collate("BINARY" if self.path else "C")

    def copy_to(self, path: Path) -> None:
        """Write an SQLite file as it is now, without unfinished writes of others, to a new one.

        Raises:
            StorageError: it cannot be written.
        """
        with self._translated(), self._engine.connect() as connection:
            connection.exec_driver_sql("VACUUM INTO ?", (str(path),))

    @property
    def size(self) -> int:
        """Size of an SQLite file [bytes]; 0 for a server's database."""
        return 0 if self.path is None else self.path.stat().st_size

    def check(self) -> list[str]:
        """The findings of the database's own integrity check; empty if there are none, or no such check."""
        if self.path is None:
            return []
        with self.read() as session:
            complaints = [row[0] for row in session.connection().exec_driver_sql("PRAGMA integrity_check")]
        return [text for text in complaints if text != "ok"]

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    def _begin(self, connection: Connection) -> None:
        begin = connection.get_execution_options().get("zoobench_begin")
        if begin and self.path is None:
            connection.exec_driver_sql(begin)
        elif begin:
            self._begin_sqlite(connection, begin)

    def _begin_sqlite(self, connection: Connection, begin: str) -> None:
        """Begin a transaction; wait for another writer for as long as there is a worker that may live."""
        is_told = False
        while True:
            try:
                connection.connection.dbapi_connection.execute(begin)  # type: ignore[union-attr]
                return
            except sqlite3.OperationalError as error:
                refusal = OperationalError(begin, None, error)
                if not _is_busy(refusal) or not self._has_worker():
                    raise refusal from error
            if not is_told:
                _LOG.warning("%s is locked by another zoobench, which is at work. Waiting for it.", self.name)
            is_told = True

    def _has_worker(self) -> bool:
        running = select(RunRecord).where(RunRecord.state == RunState.RUNNING)
        try:
            with Session(self._reading) as session:
                return any(map(_may_hold_lock, session.scalars(running)))
        except DBAPIError:  # it cannot be read either, or is being made
            return False

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            raise _explain(self.name, self.path, error) from error
        except (ArgumentError, NoSuchModuleError, ModuleNotFoundError) as error:
            raise StorageError(
                f"Cannot open the database {self.name!r}: {error}. Give a path, or a URL "
                "postgresql+psycopg://... after installing zoobench[postgres]."
            ) from error


def without_password(location: str) -> str:
    """The path or URL as it may be shown and stored."""
    hidden = re.sub(r"(?<=://)([^:/]*):.*@", r"\1:***@", location)
    return re.sub(r"(?<=password=)[^&]*", "***", hidden) if "://" in location else location


def among(column: InstrumentedAttribute[int], ids: Collection[int]) -> ColumnElement[bool]:
    """`column IN ids`, with the ids in the text since databases limit the number of parameters."""
    values = sorted(int(value) for value in ids)
    return column.in_(bindparam("ids", values, unique=True, expanding=True, literal_execute=True))


def batched(values: Iterable[T], size: int = AT_ONCE) -> Iterator[tuple[T, ...]]:
    """The values in groups, by default of as many as a statement can name."""
    rest = iter(values)
    while some := tuple(islice(rest, size)):
        yield some


def _url(location: str) -> URL:
    if "://" not in location:
        return URL.create("sqlite", database=location)
    try:
        url = make_url(location)
    except ValueError as error:
        raise ArgumentError("its port is not a number") from error
    if url.drivername not in _DRIVERS:  # an SQLite URL would go round all that a path is prepared with
        raise ArgumentError(f"{url.drivername} is not supported as a URL")
    if "@" in (url.host or ""):
        raise ArgumentError("an @ within a password is written %40")
    return url.update_query_dict({**_LIBPQ_PATIENCE, **url.query})


def _is_writable(path: Path) -> bool:
    """Whether a file can be changed, and others be made in its folder, as SQLite does."""
    as_effective = {"effective_ids": True} if os.access in os.supports_effective_ids else {}
    return all(os.access(place, os.W_OK, **as_effective) for place in (path, path.absolute().parent))


def _read_only_url(path: Path) -> URL:
    """The URL of a file that cannot be changed: its write-ahead log is read, too, if there is one."""
    how = {"mode": "ro"} if _has_log(path) else {"mode": "ro", "immutable": "1"}
    return URL.create("sqlite", database=path.absolute().as_uri(), query={**how, "uri": "true"})


def _has_log(path: Path) -> bool:
    log = path.with_name(f"{path.name}-wal")
    return log.exists() and log.stat().st_size > 0


def _check_path(path: Path, create: bool) -> None:
    try:
        exists, is_file, folder_exists = path.exists(), path.is_file(), path.parent.is_dir()
    except OSError as error:
        raise StorageError(f"Cannot look at {path}: {reason(error)}. Give another path with --db.") from error
    if not folder_exists:
        raise StorageError(f"There is no folder {path.parent}. Make it, or give another path with --db.")
    if exists and not is_file:
        raise StorageError(f"{path} is not a regular file, so no database. Give the path of a file with --db.")
    if not exists and not create:
        raise StorageError(f"There is no database {path}. Start one with `zoobench run`, or name one with --db.")
    if exists and not create and not path.stat().st_size and not _has_log(path):
        raise StorageError(f"{path} is empty, so no database. Start one with `zoobench run`, or name one with --db.")
    file_system = _file_system(path)
    if file_system in _NETWORK_FILE_SYSTEMS:
        raise StorageError(
            f"{path} is on a network file system ({file_system}), where SQLite loses data. "
            "Give a path on a local disk, or a PostgreSQL URL."
        )


def _file_system(path: Path) -> str:
    """The type of the file system that holds the path, as the operating system names it; empty if unknown."""
    folder = path.resolve().parent
    mounts = {Path(mount.mountpoint): mount.fstype for mount in psutil.disk_partitions(all=True)}
    return next((mounts[place] for place in (folder, *folder.parents) if place in mounts), "")


def _configure_sqlite(connection: sqlite3.Connection, _record: object) -> None:
    connection.isolation_level = None  # SQLAlchemy's `begin` event below starts the transactions
    connection.execute(f"PRAGMA busy_timeout = {int(BUSY_SECONDS * 1000)}")
    connection.execute("PRAGMA foreign_keys = ON")
    connection.execute("PRAGMA trusted_schema = OFF")  # a file of strangers calls no function with side effects


def _configure_postgresql(connection: DBAPIConnection, _record: object) -> None:
    cursor = connection.cursor()
    cursor.execute("SET client_encoding = 'UTF8'")
    cursor.execute(f"SET lock_timeout = {BUSY_SECONDS * 1000:.0f}")
    # of a machine that went to sleep or off the network with locks in its hands
    cursor.execute(f"SET idle_in_transaction_session_timeout = {BUSY_SECONDS * 1000:.0f}")
    cursor.close()
    connection.commit()


def _explain(name: str, path: Path | None, error: DBAPIError) -> StorageError:
    code = getattr(error.orig, "sqlite_errorname", "") or getattr(error.orig, "sqlstate", "") or ""
    said = " ".join(str(error.orig).split())
    if code in ("SQLITE_FULL", "53100") or (code.startswith("SQLITE_IOERR") and path and _is_disk_full(path)):
        return StorageFullError(
            f"The disk that holds {name} is full. Stored data is safe: free some space and type the same command again."
        )
    if code in ("SQLITE_NOTADB", "SQLITE_CORRUPT"):
        return StorageError(f"{name} is not an SQLite database, or a damaged one. Give another with --db.")
    if code.startswith(("SQLITE_CANTOPEN", "SQLITE_READONLY", "SQLITE_PERM", "SQLITE_AUTH")):
        if path and os.access(path, os.R_OK) and not _is_writable(path) and _has_log(path):
            return StorageError(
                f"{name} cannot be read where it is: its newest content is in {name}-wal, and the place is read-only. "
                "Copy both files to a writable place, and name the copy with --db."
            )
        return StorageError(f"No permission to open {name} for writing. The file and its folder must be writable.")
    if _is_busy(error) or code == "55P03":
        return StorageError(
            f"{name} has been locked for {BUSY_SECONDS:.0f} s, by another zoobench or another program. Wait for it or "
            "end it, then try again."
        )
    if code in ("42501", "25006"):
        return StorageError(f"No permission to write to {name}: {said}. Ask for it, or give another URL with --db.")
    if path is None and (error.connection_invalidated or (isinstance(error, OperationalError) and not code)):
        return StorageError(
            f"No connection to the database {name}: {said.rstrip('.?')}. Stored data is safe: see that the server "
            "is up, that the database exists and that it lets you in, then type the same command again."
        )
    return StorageError(f"The database {name} refuses: {said}. `zoobench doctor` checks it.")


def _may_hold_lock(run: RunRecord) -> bool:
    """Whether the worker of a RUNNING run may be another writer: it is seen alive, or its lease lives."""
    owner = Owner.parse(run.owner or "")
    is_other = owner.is_known_alive and not owner.is_of_this_process
    return is_other or (run.lease_until is not None and run.lease_until > time.time())


def _is_busy(error: DBAPIError) -> bool:
    return str(getattr(error.orig, "sqlite_errorname", "")).startswith("SQLITE_BUSY")


def _is_disk_full(path: Path) -> bool:
    # SQLite reports a full disk as an input/output error when it cannot extend its shared memory file.
    return shutil.disk_usage(path.parent).free < _NEARLY_FULL
