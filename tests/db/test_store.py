"""The store's contract: queue, claims, what a claim may write, endings, recovery."""

import math
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import text

from tests.db.fake_clock import FakeClock
from tests.harness.helpers import spec
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Claim, Ending, FinalRow, MilestoneRow, RunState
from zoobench.db.store import ClaimLostError, Store
from zoobench.errors import UsageError
from zoobench.spec import Ref

ME = Owner.current()
DEAD = replace(ME, start=ME.start - 1000)  # this process's number, borne by an earlier one
ELSEWHERE = Owner("another-host", "another-place", 1, 1, 0)
DONE = Ending(RunState.DONE, finals=(FinalRow("score", 1.5, "m/s"), FinalRow("height", math.nan, "m")))


@pytest.fixture(params=["sqlite", "postgresql"])
def location(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """A new database of each kind, in fast tests, too: every statement of the queue is made here."""
    if request.param == "sqlite":
        return str(tmp_path / "zoo.db")
    return str(request.getfixturevalue("postgres").new_database())


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    """An empty store."""
    with Store(location) as store:
        yield store


def _claim(store: Store, owner: Owner = ME) -> Claim:
    claim = store.claim(owner, provenance={"machine": "test"})
    assert claim is not None
    return claim


def test_a_spec_is_queued_once(store: Store) -> None:
    """Typing the same grid again adds nothing, and says what is open, done and failed."""
    first = store.enqueue([spec(0), spec(1), spec(2)])
    assert first.new == first.open
    assert len(first.new) == 3
    store.finish(_claim(store), DONE, Batch())
    store.finish(_claim(store), Ending(RunState.DIVERGED, "blew up"), Batch())
    again = store.enqueue([spec(0), spec(1), spec(2), spec(3)])
    done, failed, queued = ((run_id,) for run_id in first.new)
    assert (again.existing_done, again.existing_failed, again.existing_open) == (done, failed, queued)
    assert len(again.new) == 1


def test_asking_again_uses_up_no_numbers(store: Store) -> None:
    """The runs of a database are counted without gaps, however often their grid was typed."""
    for _ in range(3):
        store.enqueue([spec(0), spec(1)])
    assert store.enqueue([spec(0), spec(1), spec(2)]).new == (3,)


def test_a_spec_may_be_long(store: Store) -> None:
    """A mesh in a deep folder, and the largest seed."""
    mesh = Ref("mesh", 1, (("path", "deep/" * 100 + "body.stl"),))
    long = replace(spec(2**31 - 1), design=mesh)
    store.enqueue([long])
    assert _claim(store).spec == long


def test_a_skip_is_stored_with_its_reason_and_never_claimed(store: Store) -> None:
    """A cell that cannot be run is a row with a reason; once it can be run it is queued."""
    report = store.enqueue([], skips=[(spec(0), "no gradient")])
    assert store.runs()[0].state is RunState.SKIPPED
    assert store.runs()[0].reason == "no gradient"
    assert store.claim(ME, provenance={}) is None
    assert store.enqueue([spec(0)]).new == report.skipped
    assert _claim(store).spec == spec(0)


def test_runs_are_claimed_in_order_each_once(store: Store) -> None:
    """The oldest queued run comes first, restricted to the ids asked for, and none comes twice."""
    ids = store.enqueue(spec(seed) for seed in range(3)).new
    assert store.claim(ME, provenance={}, ids=ids[2:]).run_id == ids[2]  # type: ignore[union-attr]
    assert [_claim(store).run_id, _claim(store).run_id] == list(ids[:2])
    assert store.claim(ME, provenance={}) is None


def test_a_spec_survives_the_database(store: Store) -> None:
    """What is claimed is what was queued, with the same key."""
    store.enqueue([spec(7)])
    claim = _claim(store)
    assert claim.spec == spec(7)
    assert store.runs()[0].key == spec(7).key()


def test_every_number_comes_back_as_it_was(store: Store) -> None:
    """Finite values keep every bit, and NaN and both infinities are themselves again."""
    store.enqueue([spec()])
    claim = _claim(store)
    values = [0.1 + 0.2, 0.0, sys.float_info.min, 1.7976931348623157e308, math.nan, math.inf, -math.inf]
    store.commit(claim, Batch(metrics={("loss", step): value for step, value in enumerate(values)}))
    read = [row.value for row in store.metrics(claim.run_id, "loss")]
    assert [value.hex() for value in read] == [value.hex() for value in values]


def test_a_point_that_is_reported_again_replaces_the_earlier_one(store: Store) -> None:
    """A resumed run's curve has no duplicates."""
    store.enqueue([spec()])
    claim = _claim(store)
    store.commit(claim, Batch(metrics={("loss", 0): 1.0, ("loss", 1): 2.0}))
    store.commit(claim, Batch(metrics={("loss", 1): 3.0}))
    assert [(row.step, row.value) for row in store.metrics(claim.run_id)] == [(0, 1.0), (1, 3.0)]


def test_a_commit_shows_progress_and_renews_the_lease(store: Store) -> None:
    """`status` sees fraction, score, log and time of the last word; a silent commit renews the lease only."""
    store.enqueue([spec()])
    claim = _claim(store)
    batch = Batch(fraction=0.25, score=3.0)
    batch.log("hello")
    store.commit(claim, batch)
    run = store.runs()[0]
    assert (run.state, run.fraction, run.score) == (RunState.RUNNING, 0.25, 3.0)
    assert [row.text for row in store.logs(run.id)] == ["hello"]
    store.commit(claim, Batch())
    later = store.runs()[0]
    assert later.progress_at == run.progress_at
    assert later.lease_until > run.lease_until  # type: ignore[operator]
    assert later.seconds_left == pytest.approx(3 * later.seconds)


def test_every_text_is_kept_as_far_as_it_can_be_written(store: Store) -> None:
    """What a program prints, or an exception tells, may hold what is no text in any database."""
    store.enqueue([spec()])
    claim = _claim(store)
    batch = Batch()
    batch.log("a\0b\udcffc ü")
    store.finish(claim, Ending(RunState.FAILED, "why\0", traceback="where\udcff"), batch)
    assert [row.text for row in store.logs(claim.run_id)] == ["a?b?c ü"]
    (attempt,) = store.attempts(claim.run_id)
    assert (store.runs()[0].reason, attempt.reason, attempt.traceback) == ("why?", "why?", "where?")


def test_a_checkpoint_may_be_large(store: Store) -> None:
    """Ten megabytes come back byte for byte to whom takes the run over."""
    store.enqueue([spec()])
    data = bytes(range(256)) * (10 * 2**20 // 256)
    store.finish(_claim(store), Ending(RunState.CANCELLED), Batch(checkpoint=data))
    assert _claim(store).checkpoint == data


def test_a_done_run_has_its_finals_and_no_checkpoint(store: Store) -> None:
    """Finals, state and the end of the attempt come together."""
    store.enqueue([spec()])
    claim = _claim(store)
    store.commit(claim, Batch(checkpoint=b"state"))
    store.finish(claim, DONE, Batch(metrics={("loss", 9): 9.0}))
    run = store.runs()[0]
    assert (run.state, run.fraction, run.owner) == (RunState.DONE, 1.0, None)
    finals = store.finals(run.id)
    assert [(row.name, row.unit) for row in finals] == [("height", "m"), ("score", "m/s")]
    assert math.isnan(finals[0].value)
    assert [row.step for row in store.metrics(run.id)] == [9]
    attempt = store.attempts(run.id)[0]
    assert attempt.outcome is RunState.DONE
    assert attempt.wall_seconds == pytest.approx(run.seconds)
    assert attempt.provenance == {"machine": "test"}
    with store._database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM checkpoints")) == 0


def test_a_done_run_has_its_solution_to_the_last_bit(store: Store) -> None:
    """The parameters come back as they were; a run that is done again has none meanwhile, and then the new ones."""
    store.enqueue([spec()])
    claim = _claim(store)
    assert store.solution(claim.run_id) is None
    params = (0.1 + 0.2, -1e-300, sys.float_info.max, 3.0)
    store.finish(claim, replace(DONE, params=params), Batch())
    found = store.solution(claim.run_id)
    assert found is not None
    assert [value.hex() for value in found] == [value.hex() for value in params]
    store.retry([claim.run_id], states=[RunState.DONE])
    assert store.solution(claim.run_id) is None
    store.finish(_claim(store), replace(DONE, params=(2.5,)), Batch())
    assert store.solution(claim.run_id) == (2.5,)


def test_a_solution_without_parameters_is_one(store: Store) -> None:
    """Of a run with a fixed gait on a given body: it can be filmed and evaluated. Unlike none at all."""
    for seed, params in enumerate([(), None]):
        store.enqueue([spec(seed)])
        claim = _claim(store)
        store.finish(claim, replace(DONE, params=params), Batch())
        assert store.solution(claim.run_id) == params


@pytest.mark.parametrize("outcome", [RunState.FAILED, RunState.DIVERGED, RunState.TIMEOUT])
def test_a_failure_is_no_success_and_keeps_its_traceback(store: Store, outcome: RunState) -> None:
    """A run that did not succeed ends in its own state, without finals, with its reason and traceback."""
    store.enqueue([spec()])
    claim = _claim(store)
    store.finish(claim, Ending(outcome, "why", traceback="Traceback ...", exit_code=3), Batch())
    run, attempt = store.runs()[0], store.attempts(claim.run_id)[0]
    assert (run.state, run.reason) == (outcome, "why")
    assert (attempt.outcome, attempt.traceback, attempt.exit_code) == (outcome, "Traceback ...", 3)
    assert store.finals(run.id) == []


def test_an_interrupted_run_goes_on_from_its_checkpoint(store: Store) -> None:
    """CANCELLED puts the run back; the next attempt gets the newest checkpoint and the first one stays recorded."""
    store.enqueue([spec()])
    first = _claim(store)
    store.commit(first, Batch(checkpoint=b"one"))
    store.commit(first, Batch(checkpoint=b"two"))
    store.finish(first, Ending(RunState.CANCELLED, "interrupted"), Batch())
    second = _claim(store)
    assert (first.checkpoint, second.checkpoint, second.attempt) == (None, b"two", 2)
    assert [(row.outcome, row.resumed, row.progressed) for row in store.attempts(first.run_id)] == [
        (RunState.CANCELLED, False, True),
        (RunState.RUNNING, True, False),
    ]


def test_a_stale_claim_writes_nothing(store: Store) -> None:
    """A worker that was given up for dead is fenced off from the run that another has taken over."""
    store.enqueue([spec()])
    stale = _claim(store, DEAD)
    assert store.recover() == [stale.run_id]
    fresh = _claim(store)
    for write in (store.commit, lambda claim, batch: store.finish(claim, DONE, batch)):
        with pytest.raises(ClaimLostError):
            write(stale, Batch(metrics={("loss", 0): 1.0}, checkpoint=b"stale"))
    assert store.metrics(stale.run_id) == []
    store.finish(fresh, DONE, Batch())
    with pytest.raises(ClaimLostError):
        store.finish(fresh, DONE, Batch())
    assert len(store.finals(fresh.run_id)) == 2


def test_a_dead_worker_on_this_host_is_recognised_at_once(store: Store) -> None:
    """Its attempt is LOST and the run queued again; a living worker's run is left alone."""
    store.enqueue([spec(0), spec(1)])
    lost, held = _claim(store, DEAD), _claim(store, ME)
    assert store.recover() == [lost.run_id]
    assert [run.state for run in store.runs()] == [RunState.QUEUED, RunState.RUNNING]
    assert store.attempts(lost.run_id)[0].outcome is RunState.LOST
    store.commit(held, Batch())


def test_a_lost_attempt_ended_when_its_worker_was_last_heard_of(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """The night between the crash and the next command is no time that the run took."""
    store.enqueue([spec()])
    claim = _claim(store, DEAD)
    morning = time.time() + 36_000.0
    monkeypatch.setattr(time, "time", lambda: morning)
    store.recover()
    (attempt,) = store.attempts(claim.run_id)
    assert attempt.wall_seconds is not None
    assert 0.0 <= attempt.wall_seconds < 60.0
    assert store.runs()[0].seconds < 60.0


@pytest.mark.parametrize(("died_alone", "losses"), [(True, 3), pytest.param(False, 30, marks=pytest.mark.slow)])
def test_a_run_that_is_lost_again_and_again_is_given_up(store: Store, died_alone: bool, losses: int) -> None:
    """Losses without progress end in FAILED with the reason, those of the child alone soon; a checkpoint forgives."""
    store.enqueue([spec()])
    lost = Ending(RunState.LOST, "signal 9", died_alone=died_alone)
    for _ in range(losses - 1):
        store.finish(_claim(store), lost, Batch())
    store.finish(_claim(store), lost, Batch(checkpoint=b"further"))
    for _ in range(losses):
        assert store.runs()[0].state is RunState.QUEUED
        store.finish(_claim(store), lost, Batch())
    run = store.runs()[0]
    assert run.state is RunState.FAILED
    assert run.reason == "Given up, as attempts were lost again and again without progress. signal 9"
    assert len(store.attempts(run.id)) == 2 * losses


def test_the_death_of_a_worker_hardly_counts(store: Store) -> None:
    """It was ended with its machine or by its user: not for what the run does."""
    store.enqueue([spec()])
    for _ in range(29):
        claim = _claim(store, DEAD)
        assert store.recover() == [claim.run_id]
    assert store.runs()[0].state is RunState.QUEUED
    _claim(store, DEAD)
    store.recover()
    assert store.runs()[0].state is RunState.FAILED


def test_a_failed_run_is_done_again_when_asked(store: Store) -> None:
    """`retry` queues runs in the named states only, and keeps what was recorded."""
    store.enqueue([spec(0), spec(1)])
    for ending in (DONE, Ending(RunState.FAILED, "why")):
        store.finish(_claim(store), ending, Batch())
    ids = [run.id for run in store.runs()]
    assert store.retry(ids, states=[RunState.DIVERGED]) == []
    assert store.retry(ids) == ids[1:]
    assert _claim(store).attempt == 2


def test_a_run_that_is_done_again_has_no_result_meanwhile(store: Store) -> None:
    """Neither in the queue nor after a failure does it show the score that it had before."""
    store.enqueue([spec()])
    store.finish(_claim(store), DONE, Batch())
    (run,) = store.runs()
    store.retry([run.id], states=[RunState.DONE])
    assert store.finals(run.id) == []
    store.finish(_claim(store), Ending(RunState.FAILED, "why"), Batch())
    assert store.all_finals([run.id]) == {}


def test_a_run_that_is_done_again_takes_its_own_time_only(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the time left nor that of the whole run counts what it took the time before."""
    clock = FakeClock(monkeypatch)
    store.enqueue([spec()])
    claim = _claim(store)
    clock.go_on(100.0)
    store.finish(claim, DONE, Batch())
    assert store.runs()[0].seconds == pytest.approx(100.0)
    store.retry([claim.run_id], states=[RunState.DONE])
    assert store.runs()[0].seconds == 0.0
    again = _claim(store)
    clock.go_on(10.0)
    store.commit(again, Batch(fraction=0.5, checkpoint=b"half"))
    (run,) = store.runs()
    assert (run.first_attempt, run.seconds_left) == (2, pytest.approx(10.0))
    store.finish(again, Ending(RunState.CANCELLED, "interrupted"), Batch())
    last = _claim(store)
    clock.go_on(5.0)
    store.finish(last, DONE, Batch())
    (run,) = store.runs()
    assert (run.first_attempt, run.attempt, run.seconds) == (2, 3, pytest.approx(15.0))


def test_a_curve_that_is_done_again_ends_where_it_ended(store: Store) -> None:
    """No point of the former curve stands beyond the new one's last, neither on the way nor at the end."""
    store.enqueue([spec()])
    claim = _claim(store)
    store.finish(claim, DONE, Batch(metrics={("loss", step): 1.0 for step in range(5)}))
    assert [row.step for row in store.metrics(claim.run_id, "loss")] == [0, 1, 2, 3, 4]
    store.retry([claim.run_id], states=[RunState.DONE])
    assert store.metrics(claim.run_id) == []
    again = _claim(store)
    store.commit(again, Batch(metrics={("loss", 0): 2.0}, checkpoint=b"half"))
    store.finish(again, Ending(RunState.CANCELLED, "interrupted"), Batch())
    last = _claim(store)
    store.commit(last, Batch(metrics={("loss", 1): 3.0}))
    assert [(row.step, row.value) for row in store.metrics(claim.run_id)] == [(0, 2.0), (1, 3.0)]
    store.finish(last, DONE, Batch())
    assert [(row.step, row.value) for row in store.metrics(claim.run_id)] == [(0, 2.0), (1, 3.0)]


def test_a_done_run_has_its_archive_if_it_kept_one(store: Store) -> None:
    """Byte for byte; a run that is done again replaces it, also by none."""
    store.enqueue([spec()])
    claim = _claim(store)
    assert store.archive(claim.run_id) is None
    store.finish(claim, replace(DONE, archive=b"\x00elites\xff"), Batch())
    assert store.archive(claim.run_id) == b"\x00elites\xff"
    store.retry([claim.run_id], states=[RunState.DONE])
    assert store.archive(claim.run_id) is None
    store.finish(_claim(store), DONE, Batch())
    assert store.archive(claim.run_id) is None


def test_runs_can_be_asked_for_by_id_state_and_key(store: Store) -> None:
    """The readers' filters narrow the choice; a key's beginning is enough for one run."""
    ids = store.enqueue(spec(seed) for seed in range(4)).new
    _claim(store)
    assert [run.id for run in store.runs(states=[RunState.QUEUED])] == list(ids[1:])
    assert [run.id for run in store.runs(ids=[ids[3], ids[1]])] == [ids[1], ids[3]]
    assert store.counts() == {RunState.RUNNING: 1, RunState.QUEUED: 3}
    assert store.run(str(ids[2])).id == ids[2]
    assert store.run(spec(2).key()[:12]).id == ids[2]
    for given in ("ab", "zzzz", "99"):
        with pytest.raises(UsageError):
            store.run(given)


def test_a_grid_may_have_more_runs_than_a_statement_has_parameters(store: Store) -> None:
    """Filters by id work for a hundred thousand ids."""
    ids = store.enqueue([spec()]).new
    assert [run.id for run in store.runs(ids=range(100_000))] == list(ids)


def test_provenance_is_stored_once(store: Store) -> None:
    """Attempts of the same code on the same machine share one row."""
    store.enqueue([spec(0), spec(1)])
    _claim(store)
    _claim(store)
    with store._database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM provenance")) == 1


def test_what_was_found_on_the_way_is_kept(store: Store) -> None:
    """To the last bit, by iteration; reported again by a resumed run it is replaced, and done again it begins anew."""
    early, late, better = (
        MilestoneRow(step, score, (score / 3, -0.0)) for step, score in ((1, 0.1), (8, 0.2), (8, 0.3))
    )
    store.enqueue([spec()])
    claim = _claim(store)
    store.commit(claim, Batch(milestones={late.step: late, early.step: early}))
    store.commit(claim, Batch(milestones={better.step: better}))
    assert store.milestones(claim.run_id) == [early, better]
    store.finish(claim, Ending(RunState.DONE, params=(1.0, 2.0)), Batch())
    assert store.milestones(claim.run_id) == [early, better]
    found = store.stored(spec().key())
    assert found is not None
    assert found.milestones == (early.params, better.params)
    store.retry([claim.run_id], states=[RunState.DONE])
    assert store.milestones(claim.run_id) == []
    again = _claim(store)
    store.finish(again, Ending(RunState.DONE), Batch(milestones={early.step: early}))
    assert store.milestones(claim.run_id) == [early]


def test_runs_of_a_higher_priority_are_taken_first(location: str) -> None:
    """Of equal ones the oldest; a run that is not queued any more keeps its place in the record."""
    with Store(location) as store:
        ids = store.enqueue(spec(seed) for seed in range(4)).new
        store.prioritise(ids[2:], 5)
        store.prioritise(ids[:1], -1)
        taken = [store.claim(Owner.current(), provenance={}) for _ in ids]
        assert [claim.run_id for claim in taken if claim] == [ids[2], ids[3], ids[1], ids[0]]
