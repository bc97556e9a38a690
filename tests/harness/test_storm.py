"""A storm of signals on launchers, fork servers and children, and restarts of the database's server."""

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

from tests.harness.helpers import fake, numbers, spec, work_on_fakes
from tests.postgres import Server
from zoobench.db.rows import OPEN_STATES, RunState
from zoobench.db.store import Store

SIGNALS = 1000
_RESTARTS = 10  # of the database's server
_FEWEST = 8  # open runs, before more are queued
_CHILD = fake(iterations=200, pause=0.01)
_CALM = fake(iterations=200, pause=0.0)
_LAUNCH = """
import sys
from zoobench.db.rows import UNSUCCESSFUL_STATES
from zoobench.db.store import Store
from zoobench.harness import worker_pool
location, forks, *child = sys.argv[1:]
if forks == "forks":
    worker_pool.CHILD_COMMAND = tuple(child)
with Store(location, create=False) as store:
    ids = [row.id for row in store.runs()]
    store.retry(ids)  # those that were given up: more than three attempts in a row met a signal at once
worker_pool.run_all(location, ids, child=child)
"""
_KINDS = (signal.SIGKILL, signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGSTOP)

_SHARES = (4, 1, 8)  # of the signals, to launchers, fork servers and children


class _Storm:
    """Two launchers of the same runs, started again whenever they end, and what befalls them."""

    def __init__(self, location: str, seed: str) -> None:
        self._location, self._random = location, random.Random(seed)
        self._launchers: dict[str, subprocess.Popen[bytes]] = {}
        self.sent: Counter[str] = Counter()

    def keep_launching(self) -> None:
        for how in ("forks", "starts"):
            launcher = self._launchers.get(how)
            if launcher is None or launcher.poll() is not None:
                command = [sys.executable, "-c", _LAUNCH, self._location, how, *_CHILD]
                self._launchers[how] = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)

    def strike(self) -> None:
        """One signal to a random process, if there is one of the kind that chance has chosen."""
        with suppress(psutil.NoSuchProcess):
            how = self._random.choice(list(self._launchers))
            launcher = psutil.Process(self._launchers[how].pid)
            servers = launcher.children() if how == "forks" else []
            children = [child for parent in servers or [launcher] for child in parent.children()]
            families = {"launcher": [launcher], "server": servers, "child": children}
            (place,) = self._random.choices(list(families), _SHARES)
            if not families[place]:
                return
            victim, kind = self._random.choice(families[place]), self._random.choice(_KINDS)
            victim.send_signal(kind)
            self.sent[place] += 1
            if kind == signal.SIGSTOP:
                time.sleep(self._random.uniform(0.1, 1.0))
                victim.send_signal(signal.SIGCONT)

    def pause(self) -> None:
        time.sleep(self._random.uniform(0.05, 0.6))

    def end(self) -> None:
        for launcher in self._launchers.values():
            with suppress(psutil.NoSuchProcess):
                for process in psutil.Process(launcher.pid).children(recursive=True):
                    process.kill()
            launcher.kill()
            launcher.wait()


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
    assert min(storm.sent[place] for place in ("launcher", "server", "child")) > SIGNALS // 40
    calm = str(tmp_path / "calm.db")
    work_on_fakes(calm, count, child=_CALM)
    with Store(location) as store:
        assert (store.check(), store.damage(), store.unsealed()) == ([], [], 0)
        assert sum(len(store.attempts(run_id)) for run_id in range(1, count + 1)) > count
        numbers_of = {row.spec: numbers(location, row.id) for row in store.runs()}
    with Store(calm) as store:
        assert {row.spec: numbers(calm, row.id) for row in store.runs()} == numbers_of
