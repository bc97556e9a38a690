"""What only a server can do to its clients: be away, forbid, be occupied by others, and have a password."""

import threading
from collections.abc import Iterator

import pytest
from sqlalchemy import text

from tests.harness.helpers import spec
from tests.postgres import Server
from zoobench.cli.options import command_text
from zoobench.db import engine
from zoobench.db.owner import Owner
from zoobench.db.query import Reader
from zoobench.db.rows import Batch, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError
from zoobench.harness.doctor import _check_database


def _refusal(location: str) -> str:
    with pytest.raises(StorageError) as caught:
        Store(location)
    assert "secret" not in str(caught.value)
    return str(caught.value)


@pytest.fixture
def url(postgres: Server) -> str:
    """The URL of an empty database, with a password in it."""
    return postgres.new_database()


@pytest.fixture
def store(url: str) -> Iterator[Store]:
    """An empty store."""
    with Store(url) as store:
        yield store


def test_another_programs_tables_are_left_alone(postgres: Server, url: str) -> None:
    """Ours are not put beside them."""
    postgres.execute(f"CREATE TABLE {_name(url)}.photos (id INTEGER)")
    assert "tables of another program" in _refusal(url)


def test_a_role_that_may_only_read_reads(postgres: Server, url: str, store: Store) -> None:
    """It sees the runs, and is told that it cannot queue any."""
    store.enqueue([spec()])
    name, empty = _name(url), _name(postgres.new_database())
    postgres.execute("CREATE ROLE guest LOGIN")
    postgres.execute(f"GRANT USAGE ON SCHEMA {name}, {empty} TO guest")
    postgres.execute(f"GRANT SELECT ON ALL TABLES IN SCHEMA {name} TO guest")
    with Store(postgres.url(name, "guest")) as guest:
        assert [run.spec for run in guest.runs()] == [spec()]
        with pytest.raises(StorageError, match="No permission to write"):
            guest.enqueue([spec(1)])
    assert "No permission to write" in _refusal(postgres.url(empty, "guest"))


def test_a_lock_that_is_held_too_long_is_told(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As of an SQLite file."""
    with Store(url) as first, first._database.write(alone=True) as session:
        session.execute(text("SELECT 1"))
        monkeypatch.setattr(engine, "BUSY_SECONDS", 0.2)
        with Store(url) as second, pytest.raises(StorageError, match="by another zoobench or another program"):
            second.enqueue([spec()])


def test_a_client_that_fell_asleep_holds_nobody_up(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The server takes its locks away, and what it began is undone."""

    def sleep_in_the_midst(store: Store) -> None:
        with store._database.write() as session:
            session.execute(text("LOCK TABLE specs"))
            patient.enqueue([spec()])
            session.execute(text("SELECT 1"))

    with Store(url) as patient:
        monkeypatch.setattr(engine, "BUSY_SECONDS", 0.2)
        with Store(url) as sleeper, pytest.raises(StorageError, match="Stored data is safe"):
            sleep_in_the_midst(sleeper)
        assert len(patient.runs()) == 1


def test_a_server_that_is_gone_is_told_and_has_lost_nothing(postgres: Server, store: Store) -> None:
    """In the midst of a run and at the start; when it is back, the run goes on."""
    store.enqueue([spec()])
    claim = store.claim(Owner.current(), provenance={})
    assert claim is not None
    store.commit(claim, Batch(metrics={("loss", 0): 1.0}, checkpoint=b"state"))
    postgres.stop()
    try:
        for _ in range(2):
            with pytest.raises(StorageError, match="Stored data is safe") as caught:
                store.commit(claim, Batch(metrics={("loss", 1): 2.0}))
            assert "secret" not in str(caught.value)
        assert "No connection" in _refusal(postgres.url("any"))
    finally:
        postgres.start()
    assert [row.step for row in store.metrics(claim.run_id)] == [0]
    assert store.runs()[0].state is RunState.RUNNING
    store.commit(claim, Batch(metrics={("loss", 1): 2.0}))
    assert [row.step for row in store.metrics(claim.run_id)] == [0, 1]


def test_a_reader_sees_one_state(url: str, store: Store) -> None:
    """What is written meanwhile comes after."""
    store.enqueue([spec()])
    with Reader(url)._database.read() as session:
        counts = text("SELECT count(*) FROM runs")
        assert session.scalar(counts) == 1
        store.enqueue([spec(1)])
        assert session.scalar(counts) == 1


def test_writers_of_different_runs_do_not_wait_for_each_other(store: Store) -> None:
    """Two workers commit side by side, and a third takes the next run."""
    store.enqueue(spec(seed) for seed in range(3))
    first, second = (store.claim(Owner.current(), provenance={}) for _ in range(2))
    assert first is not None
    assert second is not None
    with store._database.write() as session:
        store._hold(session, first)
        others = threading.Thread(target=store.commit, args=(second, Batch(checkpoint=b"state")))
        others.start()
        others.join(timeout=20.0)
        assert not others.is_alive()
        assert store.claim(Owner.current(), provenance={}) is not None


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://me:secret@localhost:1/none",
        "postgresql://me:sec@secret@localhost:1/none",
        "postgresql://me:se/cret:secret@localhost:1/none",
        "postgresql://localhost:1/none?user=me&password=secret",
        "postgresql://me:secret@localhost:port/none",
        "postgresql://me:secret@localhost:1/none?nosuch=option",
        "mysql://me:secret@localhost:1/none",
        "nosuch://me:secret@localhost:1/none",
    ],
)
def test_a_password_is_never_told(url: str) -> None:
    """Not in the messages about a URL that cannot be used, whatever is wrong with it."""
    assert "***" in _refusal(url)


def test_the_database_is_named_without_its_password(url: str, store: Store) -> None:
    """By commands that have nothing to complain about: `doctor`, and what `run` says to type next."""
    named = [store.name, _check_database(url, full=False).detail, command_text("table", db=url)]
    assert all("zoobench:***@" in words and "secret" not in words for words in named)


def test_a_url_is_shown_without_its_password() -> None:
    """And all else stays, paths too."""
    assert engine.without_password("postgresql://me:a:b@c/d@host/db") == "postgresql://me:***@host/db"
    assert (
        engine.without_password("postgresql://me@host/db?password=a&x=1") == "postgresql://me@host/db?password=***&x=1"
    )
    assert engine.without_password("postgresql://me@corp:secret@host/db") == "postgresql://me@corp:***@host/db"
    for harmless in ("postgresql://me@host:5432/db", "a:b@c.db", "/tmp/password=1"):
        assert engine.without_password(harmless) == harmless


def _name(url: str) -> str:
    return url.rpartition("%3D")[2]
