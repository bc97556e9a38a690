"""Reference scores that runs share, with real workers and children that compute none."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.harness.helpers import enqueue, fake, launch_fakes
from zoobench.db.owner import Owner
from zoobench.db.rows import Claim, RunState
from zoobench.db.store import Store
from zoobench.harness import supervise
from zoobench.harness.process import ChildProcess, StartedProcess

REFERS = fake("refers", iterations=2)


def _finals(store: Store, run_id: int) -> dict[str, float]:
    return {final.name: final.value for final in store.finals(run_id)}


@pytest.mark.slow
def test_of_runs_that_need_a_reference_at_once_one_computes_it(tmp_path: Path) -> None:
    """The others wait for it, and those that come later find it."""
    path = tmp_path / "zoo.db"
    rows = launch_fakes(path, 3, child=REFERS)
    assert [row.state for row in rows] == [RunState.DONE] * 3
    with Store(path) as store:
        finals = [_finals(store, row.id) for row in rows]
    assert sum(each["computed"] for each in finals) == 1.0
    assert len({each["reference"] for each in finals}) == 1


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[tuple[Store, Claim]]:
    """A store with two claims, and the second of them: the first is to compute the reference, and never does."""
    enqueue(tmp_path / "zoo.db", 2)
    with Store(tmp_path / "zoo.db") as store:
        first, second = (store.claim(Owner.current(), provenance={}) for _ in range(2))
        assert first is not None
        assert second is not None
        assert store.reference(first, "a reference").is_ours
        yield store, second


def test_nobody_waits_for_ever(pair: tuple[Store, Claim], monkeypatch: pytest.MonkeyPatch) -> None:
    """After a while a run computes it though another is at it."""
    monkeypatch.setattr(supervise, "REFERENCE_SECONDS", 0.3)
    store, claim = pair
    child = ChildProcess(StartedProcess(REFERS))
    assert supervise.supervise(store, claim, child, stop=threading.Event()) is RunState.DONE
    child.end()
    assert _finals(store, claim.run_id)["computed"] == 1.0


@pytest.mark.slow
def test_a_run_that_waits_can_be_stopped(pair: tuple[Store, Claim]) -> None:
    """It ends by itself, and is not killed."""
    store, claim = pair
    stop = threading.Event()

    def interrupt() -> None:
        while store.runs(ids=[claim.run_id])[0].fraction < 1.0:
            time.sleep(0.05)
        time.sleep(0.5)
        stop.set()

    threading.Thread(target=interrupt).start()
    child = ChildProcess(StartedProcess(REFERS))
    assert supervise.supervise(store, claim, child, stop=stop) is RunState.CANCELLED
    (attempt,) = store.attempts(claim.run_id)
    assert (attempt.outcome, attempt.exit_code, attempt.signal) == (RunState.CANCELLED, 0, None)
