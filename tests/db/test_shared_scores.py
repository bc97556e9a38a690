"""Reference scores that runs share through the database."""

import math
import threading
from collections.abc import Iterator
from dataclasses import replace

import pytest

from tests.db.fake_clock import FakeClock
from tests.harness.helpers import spec
from zoobench.db.lifecycle import LEASE_SECONDS, SILENT_SECONDS
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Claim, Ending, RunState, SharedScore
from zoobench.db.store import Store

ME = Owner.current()
DEAD = replace(ME, start=ME.start - 1000)
ELSEWHERE = Owner("another-host", "another-place", 1, 1, 0)
KEY = "a" * 64
OURS, THEIRS = SharedScore(is_ours=True), SharedScore(is_ours=False)


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    """A store with three queued runs."""
    with Store(location) as store:
        store.enqueue(spec(seed) for seed in range(3))
        yield store


def _claim(store: Store, owner: Owner = ME) -> Claim:
    claim = store.claim(owner, provenance={"machine": "test"})
    assert claim is not None
    return claim


@pytest.mark.parametrize("value", [0.1 + 0.2, -1e-300, math.nan, -math.inf])
def test_the_first_computes_and_all_have_its_bits(store: Store, value: float) -> None:
    """Also where there is none, since nothing was finite; a second opinion changes nothing, another key is apart."""
    first, second = _claim(store), _claim(store)
    assert store.reference(first, KEY) == OURS
    assert store.reference(second, KEY) == THEIRS
    assert store.reference(first, KEY) == OURS
    store.keep_reference(first, KEY, value, "m/s")
    store.keep_reference(second, KEY, 7.0, "m")
    for claim in (first, second):
        found = store.reference(claim, KEY)
        assert found.value is not None
        assert found.value.hex() == value.hex()
        assert found.unit == "m/s"
    assert store.reference(second, "b" * 64) == OURS


def test_who_would_not_wait_may_store_it(store: Store) -> None:
    """One that computed it though another was at it."""
    first, second = _claim(store), _claim(store)
    assert store.reference(first, KEY) == OURS
    store.keep_reference(second, KEY, 1.5, "m")
    assert store.reference(first, KEY) == SharedScore(1.5, "m")


@pytest.mark.parametrize("outcome", [RunState.DONE, RunState.FAILED, RunState.CANCELLED, RunState.LOST])
def test_the_turn_passes_on_when_an_attempt_ends_without_it(store: Store, outcome: RunState) -> None:
    """However it ends; and a later attempt at the same run has no special right."""
    first, second = _claim(store), _claim(store)
    assert store.reference(first, KEY) == OURS
    store.finish(first, Ending(outcome), Batch())
    assert store.reference(second, KEY) == OURS
    again = _claim(store)
    assert store.reference(again, KEY) == THEIRS


@pytest.mark.parametrize("owner", [DEAD, ELSEWHERE])
def test_the_dead_are_not_waited_for(store: Store, owner: Owner, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a worker of this host that is gone nor one elsewhere whose lease has run out."""
    first, second = _claim(store, owner), _claim(store)
    assert store.reference(first, KEY) == OURS
    if owner is ELSEWHERE:
        assert store.reference(second, KEY) == THEIRS
        clock = FakeClock(monkeypatch)
        clock.go_on(LEASE_SECONDS + 1.0)
        for _ in range(int(SILENT_SECONDS)):
            assert store.reference(second, KEY) == THEIRS
            clock.go_on(1.0)
    assert store.reference(second, KEY) == OURS


def test_of_many_at_once_one_computes(location: str, store: Store) -> None:
    """Each with a connection of its own."""
    store.enqueue(spec(seed) for seed in range(8))
    claims = [_claim(store) for _ in range(8)]
    found: list[SharedScore] = []

    def ask(claim: Claim) -> None:
        with Store(location) as own:
            found.append(own.reference(claim, KEY))

    threads = [threading.Thread(target=ask, args=(claim,)) for claim in claims]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(row.is_ours for row in found) == [False] * 7 + [True]
