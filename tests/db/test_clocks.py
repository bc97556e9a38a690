"""Clocks that are set, machines that sleep and workers that are stopped: who lives is not lost."""

from collections.abc import Iterator

import pytest

from tests.db.fake_clock import FakeClock
from tests.harness.helpers import spec
from zoobench.db.lifecycle import LEASE_SECONDS, SILENT_SECONDS
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Claim, Ending, RunState
from zoobench.db.store import Store

ME = Owner.current()
ELSEWHERE = Owner("another-host", "another-place", 1, 1, 0)
JUMPS = ([90.0], [86_400.0], [-300.0], [90.0, -3_600.0, 86_400.0, -90.0, 120.0])


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    """A store with two queued runs."""
    with Store(location) as store:
        store.enqueue([spec(0), spec(1)])
        yield store


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> FakeClock:
    """Clocks that stand still."""
    return FakeClock(monkeypatch)


def _claim(store: Store, owner: Owner) -> Claim:
    claim = store.claim(owner, provenance={})
    assert claim is not None
    return claim


@pytest.mark.parametrize("jumps", [JUMPS[0], *(pytest.param(each, marks=pytest.mark.slow) for each in JUMPS[1:])])
@pytest.mark.parametrize("renews", [pytest.param(1.0, marks=pytest.mark.slow), 5.0])
def test_a_clock_that_is_set_loses_nobody(store: Store, clock: FakeClock, jumps: list[float], renews: float) -> None:
    """Neither who is seen here nor who renews a lease elsewhere; and durations are those that have passed."""
    here, there = _claim(store, ME), _claim(store, ELSEWHERE)
    for jump in jumps:
        clock.set_by(jump)
        for second in range(30):
            assert store.recover() == []
            clock.go_on(1.0)
            if second % renews == 0:
                store.commit(there, Batch())
    store.finish(here, Ending(RunState.DONE), Batch())
    store.finish(there, Ending(RunState.DONE), Batch())
    for claim in (here, there):
        assert [row.wall_seconds for row in store.attempts(claim.run_id)] == [pytest.approx(30.0 * len(jumps))]


def test_a_worker_that_is_seen_here_needs_no_lease(store: Store, clock: FakeClock) -> None:
    """It may be stopped for longer than anybody elsewhere: nobody takes its run, and it goes on."""
    claim = _claim(store, ME)
    for _ in range(int(2.0 * (LEASE_SECONDS + SILENT_SECONDS))):
        clock.go_on(1.0)
        assert not store.has_overdue()
    assert store.recover() == []
    store.commit(claim, Batch())


@pytest.mark.parametrize("sleep", [66.0, 3600.0])
def test_a_machine_that_sleeps_loses_nobody(store: Store, clock: FakeClock, sleep: float) -> None:
    """Who looks has slept, too, and gives the other the time to renew its lease."""
    claim = _claim(store, ELSEWHERE)
    for _ in range(3):
        clock.go_on(LEASE_SECONDS + 1.0)
        assert store.recover() == []
        clock.go_on(sleep)
        assert store.recover() == []
        clock.go_on(1.0)
        store.commit(claim, Batch())
    assert len(store.attempts(claim.run_id)) == 1


def test_a_silent_worker_elsewhere_is_lost_soon_after_its_lease(store: Store, clock: FakeClock) -> None:
    """What has passed before somebody looks does not count; until then there is something to wait for."""
    claim = _claim(store, ELSEWHERE)
    clock.go_on(LEASE_SECONDS - 1.0)
    assert not store.has_overdue()
    clock.go_on(2.0)
    for _ in range(int(SILENT_SECONDS)):
        assert store.recover() == []
        assert store.has_overdue()
        clock.go_on(1.0)
    assert store.recover() == [claim.run_id]
    assert not store.has_overdue()


@pytest.mark.parametrize("jump", [86_400.0, -300.0])
def test_a_lost_attempt_took_what_its_worker_stored_last(store: Store, clock: FakeClock, jump: float) -> None:
    """Its worker is gone, and the clock was set: nobody else knows how long it took."""
    claim = _claim(store, Owner(ME.host, ME.place, ME.pid, ME.thread, ME.start - 1))
    clock.go_on(20.0)
    store.commit(claim, Batch())
    clock.set_by(jump)
    assert store.recover() == [claim.run_id]
    assert store.attempts(claim.run_id)[0].wall_seconds == pytest.approx(20.0)
    assert store.run(str(claim.run_id)).seconds == pytest.approx(20.0)
