"""`kill -9` of launchers and children at random moments loses no run and changes no number."""

import random
import subprocess
import sys
import threading
from collections import Counter
from pathlib import Path

import psutil
import pytest

from tests.harness.helpers import fake, numbers, work_on_fakes
from zoobench.db.lifecycle import CHILD_STRIKES, MAX_STRIKES
from zoobench.db.rows import RunState
from zoobench.db.store import Store

_RUNS = 3
_LAUNCH = (
    "import sys; from tests.harness.helpers import *; "
    "launch_fakes(sys.argv[1], int(sys.argv[2]), child=tuple(sys.argv[3:]))"
)


class _Killer:
    """Kills a launcher, a child of it, or both, at random moments, until it is stopped."""

    def __init__(self, seed: int, kills: int) -> None:
        self._random = random.Random(seed)
        self._left = kills
        self._stopped = threading.Event()
        self.launcher: subprocess.Popen[bytes] | None = None
        self.done: Counter[str] = Counter()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> "_Killer":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self._thread.join()

    def _run(self) -> None:
        for kind in self._random.sample(("launcher", "child", "both") * self._left, self._left):
            if self._stopped.wait(self._random.uniform(0.4, 2.5)):
                return
            while not self._kill(kind):
                if self._stopped.wait(0.01):
                    return
            self.done[kind] += 1

    def _kill(self, kind: str) -> bool:
        if self.launcher is None:
            return False
        try:
            launcher = psutil.Process(self.launcher.pid)
            children = launcher.children(recursive=True)
            if not children:
                return False
            child = self._random.choice(children)
            for process in {"launcher": [launcher], "child": [child], "both": [launcher, child]}[kind]:
                process.kill()
        except psutil.NoSuchProcess:
            return False
        return True


def _survives(tmp_path: Path, seed: int, kills: int, iterations: int) -> None:
    child, quick = fake(iterations=iterations, pause=0.01), fake(iterations=iterations, pause=0.0)
    battered, calm = tmp_path / "battered.db", tmp_path / "calm.db"
    with _Killer(seed, kills) as killer:
        while killer.launcher is None or killer.launcher.wait():
            killer.launcher = subprocess.Popen([sys.executable, "-c", _LAUNCH, str(battered), str(_RUNS), *child])
    assert sum(killer.done.values()) == kills, "the runs ended before the killer was through"
    work_on_fakes(calm, _RUNS, child=quick)
    with Store(battered) as store:
        rows = store.runs()
        assert [row.state for row in rows] == [RunState.DONE] * _RUNS
        assert store.check() == []
        outcomes = [[attempt.outcome for attempt in store.attempts(row.id)] for row in rows]
    for row, outcome in zip(rows, outcomes, strict=True):
        assert outcome == [RunState.LOST] * (len(outcome) - 1) + [RunState.DONE]
        assert numbers(battered, row.id) == numbers(calm, row.id)
    assert sum(map(len, outcomes)) > _RUNS, "no kill hit an attempt"


@pytest.mark.slow
def test_a_few_kills_lose_nothing(tmp_path: Path) -> None:
    """Every run is done once, with the numbers of an undisturbed one.

    One kill fewer than a run bears: on a busy machine all may hit the same run before its first checkpoint.
    """
    _survives(tmp_path, seed=1, kills=MAX_STRIKES // CHILD_STRIKES - 1, iterations=300)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_many_kills_lose_nothing(tmp_path: Path, seed: int) -> None:
    """Twelve kills of all three kinds."""
    _survives(tmp_path, seed=seed, kills=12, iterations=900)
