"""Opening a database and its transactions; the one module that knows which database it is.

SQLite: write-ahead log, write lock from the start of every writing transaction (a deferred one fails with
"database is locked" under contention, whatever the timeout), 30 s of patience. PostgreSQL opens by its URL.
"""

import shutil
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil
from sqlalchemy import URL, ColumnElement, Connection, bindparam, create_engine, event, make_url
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError
from sqlalchemy.orm import InstrumentedAttribute, Session

from zoobench.db.models import Base
from zoobench.errors import StorageError, StorageFullError

BUSY_SECONDS = 30.0
_NETWORK_FILE_SYSTEMS = frozenset(
    {"afs", "beegfs", "ceph", "cifs", "fuse.sshfs", "gpfs", "lustre", "nfs", "nfs4", "smb3", "smbfs"}
)
_NEARLY_FULL = 1 << 20  # [bytes]


class Database:
    """An open database: `read` and `write` give a session; every error of it becomes a StorageError.

    `location` is a path to an SQLite file or a URL. With `create` a missing file is made, without it refused.

    Raises:
        StorageError: the path cannot be used, as the message explains.
    """

    def __init__(self, location: str | Path, *, create: bool = True) -> None:
        self.location = str(location)
        self._path: Path | None = None
        if "://" not in self.location:
            self._path = Path(location)
            _check_path(self._path, create)
        with self._translated():
            self.engine = create_engine(_url(self.location))
        if self._path is not None:
            event.listen(self.engine, "connect", _configure_sqlite)
            event.listen(self.engine, "begin", _begin_sqlite)
        self._writing = self.engine.execution_options(zoobench_begin="BEGIN IMMEDIATE")

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session that sees one consistent state and writes nothing.

        Raises:
            StorageError: the database cannot be read.
        """
        with self._translated(), Session(self.engine) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """A session that holds the write lock; committed at the end, rolled back on any error.

        Raises:
            StorageFullError: the disk is full; nothing of this transaction is stored, all earlier ones are.
            StorageError: the database cannot be written.
        """
        with self._translated(), Session(self._writing) as session, session.begin():
            yield session

    def use_log(self) -> None:
        """Switch an SQLite file to a write-ahead log, for good: only once it is known to be ours.

        Raises:
            StorageError: the database cannot be written.
        """
        if self._path is None:
            return
        outside = self.engine.execution_options(zoobench_begin="")  # within a transaction the mode cannot change
        with self._translated(), outside.connect() as connection:
            connection.exec_driver_sql("PRAGMA journal_mode = WAL")

    def insert(self, table: type[Base]) -> Any:
        """An INSERT that offers `on_conflict_do_nothing` and `on_conflict_do_update`."""
        if self.engine.dialect.name == "postgresql":
            return postgresql.insert(table)
        return sqlite.insert(table)

    def check(self) -> list[str]:
        """What the database's own integrity check complains about; empty if nothing, or if it has none."""
        if self._path is None:
            return []
        with self.read() as session:
            complaints = [row[0] for row in session.connection().exec_driver_sql("PRAGMA integrity_check")]
        return [text for text in complaints if text != "ok"]

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            raise _explain(self.location, self._path, error) from error
        except (ArgumentError, NoSuchModuleError, ModuleNotFoundError) as error:
            raise StorageError(
                f"Cannot open the database {self.location!r}: {error}. Give a path, or a URL "
                "postgresql+psycopg://... after installing zoobench[postgres]."
            ) from error


def among(column: InstrumentedAttribute[int], ids: Collection[int]) -> ColumnElement[bool]:
    """`column IN ids`, with the ids in the text since databases limit the number of parameters."""
    values = sorted(int(value) for value in ids)
    return column.in_(bindparam("ids", values, unique=True, expanding=True, literal_execute=True))


def _url(location: str) -> URL:
    if "://" not in location:
        return URL.create("sqlite", database=location)
    url = make_url(location)
    if url.get_backend_name() != "postgresql":  # an SQLite URL would go round all that a path is prepared with
        raise ArgumentError(f"{url.get_backend_name()} is not supported as a URL")
    return url


def _check_path(path: Path, create: bool) -> None:
    try:
        exists, is_file, folder_exists = path.exists(), path.is_file(), path.parent.is_dir()
    except OSError as error:
        raise StorageError(f"Cannot look at {path}: {error.strerror}. Give another path with --db.") from error
    if not folder_exists:
        raise StorageError(f"There is no folder {path.parent}. Make it, or give another path with --db.")
    if exists and not is_file:
        raise StorageError(f"{path} is not a regular file, so no database. Give the path of a file with --db.")
    if not exists and not create:
        raise StorageError(f"There is no database {path}. Start one with `zoobench run`, or name one with --db.")
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


def _begin_sqlite(connection: Connection) -> None:
    begin = connection.get_execution_options().get("zoobench_begin", "BEGIN")
    if begin:
        connection.exec_driver_sql(begin)


def _explain(location: str, path: Path | None, error: DBAPIError) -> StorageError:
    name = getattr(error.orig, "sqlite_errorname", "")
    if name == "SQLITE_FULL" or (name.startswith("SQLITE_IOERR") and path and _is_disk_full(path)):
        return StorageFullError(
            f"The disk that holds {location} is full. What was stored is safe: free some space and type the "
            "same command again."
        )
    if name in ("SQLITE_NOTADB", "SQLITE_CORRUPT"):
        return StorageError(f"{location} is not an SQLite database, or a damaged one. Give another with --db.")
    if name.startswith(("SQLITE_CANTOPEN", "SQLITE_READONLY", "SQLITE_PERM", "SQLITE_AUTH")):
        return StorageError(f"No permission to open {location} for writing. The file and its folder must be writable.")
    if name.startswith("SQLITE_BUSY"):
        return StorageError(
            f"{location} has been locked by another program for {BUSY_SECONDS:.0f} s. End it, then try again."
        )
    return StorageError(f"The database {location} refuses: {error.orig}. `zoobench doctor` checks it.")


def _is_disk_full(path: Path) -> bool:
    # SQLite reports a full disk as an input/output error when it cannot extend its shared memory file.
    return shutil.disk_usage(path.parent).free < _NEARLY_FULL
