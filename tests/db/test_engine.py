"""Every way in which a database can fail ends in a message that says what to do, and loses nothing."""

import os
import sqlite3
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from sqlalchemy import text

from tests.harness.helpers import spec
from zoobench.db import engine
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError, StorageFullError


def _refusal(location: Path | str, *, create: bool = True) -> str:
    with pytest.raises(StorageError) as caught:
        Store(location, create=create)
    assert caught.value.exit_code == 2
    return str(caught.value)


def test_a_file_that_is_no_database_is_refused_and_left_alone(tmp_path: Path) -> None:
    """A text file is not overwritten."""
    path = tmp_path / "notes.txt"
    path.write_text("These are notes, and they are dear to somebody.\n" * 40)
    before = path.read_bytes()
    assert "is not an SQLite database" in _refusal(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_another_programs_database_is_refused_and_left_alone(tmp_path: Path) -> None:
    """Tables that are not ours are not mixed with ours."""
    path = tmp_path / "photos.db"
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE photos (id INTEGER)")
    connection.close()
    before = path.read_bytes()
    assert "tables of another program" in _refusal(path)
    assert path.read_bytes() == before
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT name FROM sqlite_master").fetchall() == [("photos",)]
    connection.close()


def test_a_folder_is_refused(tmp_path: Path) -> None:
    """So is anything else that is no regular file."""
    assert "is not a regular file" in _refusal(tmp_path)
    assert "is not a regular file" in _refusal("/dev/full")


def test_a_path_that_leads_nowhere_is_refused(tmp_path: Path) -> None:
    """A missing folder, and a file where a folder should be."""
    (tmp_path / "file").write_text("")
    assert "There is no folder" in _refusal(tmp_path / "missing" / "zoo.db")
    assert "There is no folder" in _refusal(tmp_path / "file" / "zoo.db")


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="the superuser may read everything")
def test_a_file_without_permission_is_refused(tmp_path: Path) -> None:
    """The message speaks of permission."""
    path = tmp_path / "zoo.db"
    Store(path).close()
    path.chmod(0)
    assert "permission" in _refusal(path)


def test_reading_makes_no_database(tmp_path: Path) -> None:
    """A question about a missing database is answered by how to start one."""
    assert "Start one with `zoobench run`" in _refusal(tmp_path / "zoo.db", create=False)
    assert list(tmp_path.iterdir()) == []


def test_a_network_file_system_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SQLite loses data there."""
    mount = type("Mount", (), {"mountpoint": str(tmp_path), "fstype": "nfs4"})
    monkeypatch.setattr(psutil, "disk_partitions", lambda all: [mount])
    assert "network file system (nfs4)" in _refusal(tmp_path / "zoo.db")


@pytest.mark.parametrize(
    "url", ["nosuch://host/db", "://", "postgresql+psycopg://localhost:1/none", "sqlite:///zoo.db"]
)
def test_a_url_that_cannot_be_opened_is_refused(url: str) -> None:
    """SQLite by URL, unknown schemes, malformed URLs, missing drivers and silent servers are storage errors, too."""
    assert "database" in _refusal(url)


def test_a_newer_schema_is_refused_with_what_to_do(location: str) -> None:
    """A database from the future is not touched."""
    with Store(location) as store, store._database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    message = _refusal(location)
    assert "has schema 9999" in message
    assert "pip install --upgrade zoobench" in message


def test_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    """The transaction that does not fit is undone as a whole; what was stored before stays, and can go on."""
    path = tmp_path / "zoo.db"
    with Store(path) as store:
        store.enqueue([spec()])
        claim = store.claim(Owner.current(), provenance={})
        assert claim is not None
        store.commit(claim, Batch(metrics={("loss", 0): 1.0}, checkpoint=b"old"))
        with store._database.read() as session:
            pages = session.scalar(text("PRAGMA page_count"))
            session.execute(text(f"PRAGMA max_page_count = {pages}"))
        with pytest.raises(StorageFullError, match="is full"):
            store.commit(claim, Batch(metrics={("loss", 1): 2.0}, checkpoint=bytes(1 << 20)))
        assert StorageFullError.exit_code == 1
        assert [row.step for row in store.metrics(claim.run_id)] == [0]
        assert store.runs()[0].state is RunState.RUNNING
        with store._database.read() as session:
            session.execute(text("PRAGMA max_page_count = 1000000"))
        store.commit(claim, Batch(checkpoint=b"new"))
        assert store.check() == []


def test_a_writer_waits_for_another(location: str) -> None:
    """A write lock that is held for a moment is waited for, not an error."""
    import threading

    with Store(location) as first, Store(location) as second:
        with first._database.write(alone=True) as session:
            session.execute(text("UPDATE runs SET state = state"))
            waiting = threading.Thread(target=second.enqueue, args=([spec()],))
            waiting.start()
            waiting.join(timeout=0.3)
            assert waiting.is_alive()
        waiting.join(timeout=20.0)
        assert len(first.runs()) == 1


def test_a_new_database_waits_for_another_that_is_being_made(tmp_path: Path) -> None:
    """SQLite refuses at once to switch to a write-ahead log beside a writer, whatever its patience."""
    path = tmp_path / "zoo.db"
    other = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    other.execute("BEGIN IMMEDIATE")
    release = threading.Timer(0.3, other.execute, ["ROLLBACK"])
    release.start()
    with Store(path) as store:
        assert store.runs() == []
    release.join()
    other.close()


@contextmanager
def read_only(path: Path) -> Iterator[None]:
    """The folder and all that is in it cannot be written, and we are nobody special."""
    places = [path.parent, *path.parent.iterdir()]
    for place in places:
        place.chmod(0o555 if place.is_dir() else 0o444)
    is_root = os.geteuid() == 0
    if is_root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if is_root:
            os.seteuid(0)
        for place in places:
            place.chmod(0o755)


@pytest.fixture
def shelf() -> Iterator[Path]:
    """Where a database will be that everybody may read."""
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder) / "zoo 100%.db"


def test_a_read_only_medium_can_be_read(shelf: Path) -> None:
    """All questions are answered, and nothing can be stored there."""
    with Store(shelf) as store:
        store.enqueue([spec()])
    before = sorted(shelf.parent.iterdir())
    with read_only(shelf), Store(shelf, create=False) as store:
        assert [row.spec for row in store.runs()] == [spec()]
        assert store.check() == []
        with pytest.raises(StorageError, match="must be writable"):
            store.enqueue([spec(1)])
    assert sorted(shelf.parent.iterdir()) == before


def test_a_log_on_a_read_only_medium_is_not_forgotten(shelf: Path) -> None:
    """What a killed writer left in it is read where SQLite can; where not, the words say what to do."""
    with Store(shelf) as store:
        store.enqueue([spec()])
        copies = {path.name: path.read_bytes() for path in shelf.parent.iterdir()}
    assert set(copies) == {shelf.name, f"{shelf.name}-wal", f"{shelf.name}-shm"}
    for name, content in copies.items():
        shelf.with_name(name).write_bytes(content)
    with read_only(shelf), Store(shelf, create=False) as store:
        assert [row.spec for row in store.runs()] == [spec()]
    shelf.with_name(f"{shelf.name}-shm").unlink()
    with read_only(shelf):
        assert "Copy both files to a writable place" in _refusal(shelf, create=False)


def test_an_older_database_on_a_read_only_medium_is_refused_in_words(shelf: Path) -> None:
    """It would have to be changed first."""
    with Store(shelf) as store, store._database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '0006'"))
    with read_only(shelf):
        assert "Copy it to a writable place" in _refusal(shelf, create=False)


@pytest.fixture
def locked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, sqlite3.Connection]]:
    """A database with a run in another's hands, and a writer that has stopped within its transaction."""
    monkeypatch.setattr(engine, "BUSY_SECONDS", 0.2)
    path = tmp_path / "zoo.db"
    with Store(path) as store:
        store.enqueue([spec()])
        assert store.claim(Owner("another-host", "another-place", 1, 1, 0), provenance={}) is not None
    writer = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    writer.execute("BEGIN IMMEDIATE")
    yield path, writer
    writer.close()


def test_a_stopped_writer_is_waited_for_while_its_lease_lives(
    locked: tuple[Path, sqlite3.Connection], caplog: pytest.LogCaptureFixture
) -> None:
    """Far beyond the usual patience, with a word; what was to be stored is stored."""
    path, writer = locked
    release = threading.Timer(1.5, writer.execute, ["ROLLBACK"])
    release.start()
    with Store(path) as store:
        assert len(store.enqueue([spec(1)]).new) == 1
        assert len(store.runs()) == 2
    release.join()
    assert [record.message for record in caplog.records] == [
        f"{path} is locked by another zoobench, which is at work. Waiting for it."
    ]


def test_a_lock_that_nobody_alive_holds_is_not_waited_for(
    locked: tuple[Path, sqlite3.Connection], caplog: pytest.LogCaptureFixture
) -> None:
    """The patience is over when the last lease is."""
    path, writer = locked
    writer.execute("UPDATE runs SET lease_until = 1.0")
    writer.execute("COMMIT")
    writer.execute("BEGIN IMMEDIATE")
    with Store(path) as store, pytest.raises(StorageError, match="has been locked"):
        store.enqueue([spec(1)])
    assert caplog.records == []
