"""A PostgreSQL server of the tests' own, from the programs that the package `pgserver` brings, or those on the path."""

import ctypes
import importlib.util
import os
import pwd
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any, Self

_PATIENCE_SECONDS = 30.0
_SUPERUSER = "zoobench"
_PR_SET_PDEATHSIG = 1


class ServerError(Exception):
    """There is no server, and why."""


class Server:
    """Listens on a socket in its folder, and believes everybody who they say they are."""

    def __init__(self, programs: Path, folder: Path) -> None:
        self._programs = programs
        self._folder = folder
        self._numbers = count()
        self._process: subprocess.Popen[bytes] | None = None
        self._as_user: dict[str, Any] = {"cwd": folder}
        if os.geteuid() == 0:  # PostgreSQL refuses to run as root
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
        programs = _programs()
        with tempfile.TemporaryDirectory(prefix="zoobench-postgres-") as folder:
            server = cls(programs, Path(folder))
            server._create()
            try:
                server.start()
                yield server
            finally:
                server.stop(signal.SIGQUIT)

    def start(self) -> None:
        """Start it and wait until it answers."""
        options = ["-k", str(self._folder), "-c", "listen_addresses=", "-c", "fsync=off"]
        with (self._folder / "log").open("ab") as log:
            self._process = subprocess.Popen(
                [self._programs / "postgres", "-D", self._folder / "data", *options],
                stdout=log,
                stderr=log,
                preexec_fn=_die_with_parent,
                **self._as_user,
            )
        import psycopg

        deadline = time.monotonic() + _PATIENCE_SECONDS
        while True:
            try:
                self.execute("SELECT 1")
            except psycopg.OperationalError as error:
                if self._process.poll() is not None or time.monotonic() > deadline:
                    raise ServerError(f"PostgreSQL did not start: {error}") from error
                time.sleep(0.02)
            else:
                return

    def stop(self, how: signal.Signals = signal.SIGINT) -> None:
        """Throw all clients out and end."""
        if self._process is not None:
            self._process.send_signal(how)
            self._process.wait(_PATIENCE_SECONDS)
            self._process = None

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


def _programs() -> Path:
    if sys.platform != "linux" or importlib.util.find_spec("psycopg") is None:
        raise ServerError("PostgreSQL is tried on Linux, with psycopg installed.")
    package = importlib.util.find_spec("pgserver")
    places = [f"{place}/pginstall/bin" for place in (package and package.submodule_search_locations) or ()]
    found = shutil.which("initdb", path=os.pathsep.join([*places, os.environ.get("PATH", "")]))
    if found is None:
        raise ServerError("There is no PostgreSQL here; `pip install pgserver` brings one.")
    return Path(found).parent


def _die_with_parent() -> None:
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGQUIT)
