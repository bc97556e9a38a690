"""A PostgreSQL server of the tests' own, from the programs that the package `pgserver` brings, or those on the path."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any, Self

_PATIENCE_SECONDS = 20.0
_SUPERUSER = "zoobench"
_KEEPER = """exec 3<&0
( "$@" >>log 2>&1 3<&- & read -r _ <&3; kill -INT $!; wait $! ) &"""
"""Runs the server as nobody's child, for tests count their children, until the pipe from the tests is closed."""


class ServerError(Exception):
    """There is no server, and why."""


class Server:
    """Listens on a socket in its folder, and believes everybody who they say they are."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._numbers = count()
        self._keeper: subprocess.Popen[bytes] | None = None
        self._programs = _programs(folder)
        self._as_user: dict[str, Any] = {"cwd": folder}
        if os.geteuid() == 0:  # PostgreSQL refuses to run as root
            import pwd  # of POSIX alone

            nobody = pwd.getpwnam("nobody")
            self._as_user |= {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}
            os.chown(folder, nobody.pw_uid, nobody.pw_gid)

    @classmethod
    @contextmanager
    def running(cls) -> Iterator[Self]:
        """A new server, and nothing of it afterwards.

        Raises:
            ServerError: it is not installed or cannot be started here.
        """
        with tempfile.TemporaryDirectory(prefix="zoobench-postgres-") as folder:
            try:
                server = cls(Path(folder))
                server._create()
            except (OSError, KeyError) as error:
                raise ServerError(f"PostgreSQL cannot be started: {error}") from error
            try:
                server.start()
                yield server
            finally:
                server.stop()

    def start(self) -> None:
        """Start it and wait until it answers."""
        import psycopg

        options = ["-k", str(self._folder), "-c", "listen_addresses=", "-c", "fsync=off"]
        self._keeper = subprocess.Popen(
            ["sh", "-c", _KEEPER, "sh", self._programs / "postgres", "-D", self._folder / "data", *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            **self._as_user,
        )
        self._keeper.wait()
        deadline = time.monotonic() + _PATIENCE_SECONDS
        while True:
            try:
                self.execute("SELECT 1")
            except psycopg.OperationalError as error:
                if time.monotonic() > deadline:
                    raise ServerError(f"PostgreSQL did not start: {(self._folder / 'log').read_text()}") from error
                time.sleep(0.02)
            else:
                return

    def stop(self) -> None:
        """Throw all clients out and end."""
        assert self._keeper is not None
        self._keeper.communicate()

    def new_database(self) -> str:
        """The URL of an empty place for tables: a schema, which is made in no time."""
        name = f"zoo{next(self._numbers)}"
        self.execute(f"CREATE SCHEMA {name}")
        return self.url(name)

    def url(self, name: str, user: str = _SUPERUSER) -> str:
        """The URL of the schema of that name; the password is not asked for."""
        return f"postgresql+psycopg://{user}:secret@/postgres?host={self._folder}&options=-csearch_path%3D{name}"

    def execute(self, statement: str) -> None:
        """Carry out a statement as the one who may do everything."""
        import psycopg

        where = f"host={self._folder} user={_SUPERUSER} dbname=postgres"
        with psycopg.connect(where, autocommit=True) as connection:
            connection.execute(statement.encode())

    def _create(self) -> None:
        words = ["-D", self._folder / "data", "-U", _SUPERUSER, "--auth=trust", "--encoding=UTF8", "--no-locale", "-N"]
        done = subprocess.run(
            [self._programs / "initdb", *words], capture_output=True, text=True, check=False, **self._as_user
        )
        if done.returncode:
            raise ServerError(f"initdb: {done.stderr.strip()}")


def _programs(folder: Path) -> Path:
    """Where they are; those of the package are copied, for its place may be closed to the user who runs them."""
    if sys.platform != "linux" or find_spec("psycopg") is None:
        raise ServerError("PostgreSQL is tried on Linux, with psycopg installed.")
    package = find_spec("pgserver")
    if package is not None and package.origin is not None:
        home = Path(package.origin).parent
        for part in (home, home.with_name("pgserver.libs")):
            shutil.copytree(part, folder / part.name)
        return folder / "pgserver" / "pginstall" / "bin"
    found = shutil.which("initdb")
    if found is None:
        raise ServerError("There is no PostgreSQL here; `pip install pgserver` brings one for some machines.")
    return Path(found).parent
