"""A storm of signals on launchers, guardians and children, and restarts of the database's server.

1,000 of them, or as many as the environment variable ZOOBENCH_STORM says; `pytest -m slow -rP` shows which they were.
"""

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from tests.harness.helpers import fake, launch_fakes, numbers, spec
from tests.postgres import Server
from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.db.store import Store

SIGNALS = int(os.environ.get("ZOOBENCH_STORM", "1000"))
_RESTARTS = 10  # of the database's server
_FEWEST = 8  # open runs, before more are queued
_CHILD = fake(iterations=200, pause=0.01)
_CALM = fake(iterations=200, pause=0.0)
_LAUNCH = """
import sys
from zoobench.db.rows import UNSUCCESSFUL_STATES
from zoobench.db.store import Store
from zoobench.harness.worker_pool import run_all
location, *child = sys.argv[1:]
with Store(location, create=False) as store:
    ids = [row.id for row in store.runs()]
    store.retry(ids)  # those that were given up: more than three attempts in a row met a signal at once
run_all(location, ids, child=child)
"""
_KINDS = (signal.SIGKILL, signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGSTOP)

_AIMS = {"launcher": 4, "guardian": 2, "child": 8}
"""How often a signal is meant for a launcher, a child or its guardian."""


class _Storm:
    """Two launchers of the same runs, started again whenever they end, and what befalls them."""

    def __init__(self, location: str, seed: str) -> None:
        self._location, self._random = location, random.Random(seed)
        self._launchers: dict[int, subprocess.Popen[bytes]] = {}
        self._aim = self._next_aim()
        self.sent: Counter[str] = Counter()

    def keep_launching(self) -> None:
        for number in range(2):
            launcher = self._launchers.get(number)
            if launcher is None or launcher.poll() is not None:
                command = [sys.executable, "-c", _LAUNCH, self._location, *_CHILD]
                quiet = {"stderr": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
                self._launchers[number] = subprocess.Popen(command, **quiet)

    def strike(self) -> None:
        """One signal to a process of the kind that chance has chosen; until there is one, the choice stands."""
        launcher, place = self._aim
        with suppress(psutil.NoSuchProcess):
            victims = _family(psutil.Process(self._launchers[launcher].pid))[place]
            if not victims:
                return
            victim, kind = self._random.choice(victims), self._random.choice(_KINDS)
            victim.send_signal(kind)
            self.sent[place] += 1
            self._aim = self._next_aim()
            if kind == signal.SIGSTOP:
                time.sleep(self._random.uniform(0.1, 1.0))
                victim.send_signal(signal.SIGCONT)

    def _next_aim(self) -> tuple[int, str]:
        (place,) = self._random.choices(list(_AIMS), list(_AIMS.values()))
        return self._random.randrange(2), place

    def pause(self) -> None:
        time.sleep(self._random.uniform(0.05, 0.6))

    def end(self) -> None:
        for launcher in self._launchers.values():
            with suppress(psutil.NoSuchProcess):
                for process in psutil.Process(launcher.pid).children(recursive=True):
                    process.kill()
            launcher.kill()
            launcher.wait()


def _family(launcher: psutil.Process) -> dict[str, list[psutil.Process]]:
    """The living processes of a launcher by what they are."""
    guardians = _living(launcher.children())
    children = [child for guardian in guardians for child in _living(guardian.children())]
    return {"launcher": _living([launcher]), "guardian": guardians, "child": children}


def _living(processes: list[psutil.Process]) -> list[psutil.Process]:
    return [process for process in processes if process.status() != psutil.STATUS_ZOMBIE]


@contextmanager
def _storm(location: str, seed: str) -> Iterator[_Storm]:
    storm = _Storm(location, seed)
    try:
        yield storm
    finally:
        storm.end()


def _queue_more(location: str) -> None:
    with Store(location) as store:
        count = sum(store.counts().values())
        if sum(store.counts().get(state, 0) for state in OPEN_STATES) < _FEWEST:
            store.enqueue(spec(seed) for seed in range(count, count + _FEWEST))


def _wait_for_all(location: str, storm: _Storm) -> int:
    """The number of runs, when all are done."""
    deadline = time.monotonic() + 600.0
    while time.monotonic() < deadline:
        storm.keep_launching()
        with Store(location) as store:
            counts = store.counts()
        if set(counts) == {RunState.DONE}:
            return counts[RunState.DONE]
        time.sleep(0.5)
    raise AssertionError(f"after ten quiet minutes the runs are {counts}")


@pytest.mark.slow
def test_a_storm_of_signals_changes_no_number(location: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """Every run is done, its results are sealed, and every number is that of an undisturbed database, bit for bit."""
    server: Server | None = request.getfixturevalue("postgres") if "://" in location else None
    _queue_more(location)
    restarts = 1
    with _storm(location, "storm") as storm:
        while storm.sent.total() < SIGNALS:
            storm.keep_launching()
            storm.pause()
            storm.strike()
            _queue_more(location)
            if server and storm.sent.total() >= restarts * SIGNALS // _RESTARTS:
                restarts += 1
                server.stop()
                storm.pause()
                server.start()
        count = _wait_for_all(location, storm)
    print(f"{storm.sent.total()} signals {dict(storm.sent)}, {restarts - 1} restarts of the server, {count} runs")
    assert min(storm.sent[place] for place in _AIMS) > SIGNALS // 40
    calm = str(tmp_path / "calm.db")
    launch_fakes(calm, count, child=_CALM)
    with Store(location) as store:
        assert (store.check(), store.damage(), store.unsealed()) == ([], [], 0)
        assert sum(len(store.attempts(run_id)) for run_id in range(1, count + 1)) > count
        numbers_of = {row.spec: numbers(location, row.id) for row in store.runs()}
    with Store(calm) as store:
        assert {row.spec: numbers(calm, row.id) for row in store.runs()} == numbers_of
