"""Supervision of one attempt: the child's messages are stored, and its outcome is determined."""

import signal
import threading
import time
from dataclasses import dataclass
from typing import Any

from zoobench.db.rows import Batch, Claim, Ending, FinalRow, MilestoneRow, RunState, decode_params
from zoobench.db.store import ClaimLostError, Store
from zoobench.errors import StorageError
from zoobench.harness.messages import (
    CheckpointMessage,
    DivergedMessage,
    DoneMessage,
    FailedMessage,
    LastWord,
    MetricMessage,
    MilestoneMessage,
    ProgressMessage,
    ReferenceMessage,
    ReferenceWantedMessage,
)
from zoobench.harness.process import (
    EXIT_SECONDS,
    GRACE_SECONDS,
    MOST_LOG_LINES,
    ChildProcess,
    End,
    Event,
    Idle,
    LogLine,
    Refused,
)

COMMIT_SECONDS = 1.0
CHECKPOINT_SECONDS = 0.5  # between commits that a checkpoint asks for: iterations of a second are stored one by one
REFERENCE_SECONDS = 600.0  # that a run waits for a reference score which another computes, before it does so itself
_POLL_SECONDS = 0.1
_MEMORY_SECONDS = 0.5  # between two looks at the memory of a child
_MOST_LOOK_SECONDS = 1.0  # between looks whether another run has computed it; the first come sooner


@dataclass(frozen=True)
class Limits:
    """The limits of one attempt; None for no limit.

    Attributes:
        timeout: wall time after which it ends as TIMEOUT [s].
        memory: resident memory of its processes, above which it ends as FAILED [bytes].
        ask_at: when it is asked to stop at a checkpoint and to be queued again; of the monotonic clock [s].
        end_at: when it is killed if it has not obeyed; of the monotonic clock [s].
        note: first line of its log, such as the place of another log; empty for none.
    """

    timeout: float | None = None
    memory: int | None = None
    ask_at: float = float("inf")
    end_at: float = float("inf")
    note: str = ""


NO_LIMITS = Limits()


def supervise(
    store: Store,
    claim: Claim,
    child: ChildProcess,
    *,
    stop: threading.Event,
    limits: Limits = NO_LIMITS,
) -> RunState:
    """Run one attempt in a child that is idle and record all of it; `stop` interrupts it.

    Returns its outcome. The child is idle again, or it has ended.

    Raises:
        ClaimLostError: another worker has taken the run over, or it was cancelled; the child is stopped.
        StorageError: the database refuses; the child is stopped and the run goes on from what is stored.
    """
    child.begin(claim)
    try:
        return _Supervisor(store, claim, child, limits, stop).run()
    except ClaimLostError:
        raise
    except StorageError as error:
        child.close()
        _hand_back(store, claim, str(error))
        raise
    finally:
        if not child.is_idle:
            child.close()


def _hand_back(store: Store, claim: Claim, reason: str) -> None:
    """Queue the run again if the database lets us; else `recover` does it when this worker is gone."""
    try:
        store.finish(claim, Ending(RunState.CANCELLED, reason), Batch())
    except StorageError:
        return


@dataclass
class _Wanted:
    """A reference score that the child waits for; times of the monotonic clock [s]."""

    key: str
    since: float
    look_at: float


class _Supervisor:
    def __init__(
        self,
        store: Store,
        claim: Claim,
        child: ChildProcess,
        limits: Limits,
        stop: threading.Event,
    ) -> None:
        self._store = store
        self._claim = claim
        self._child = child
        self._limits = limits
        self._stop = stop
        self._started = self._committed = time.monotonic()
        self._memory_at = self._started
        self._batch = Batch()
        self._log_lines = 0
        self._last_log = ""
        self._last_word: LastWord | None = None
        self._refused = ""
        self._halted: tuple[RunState, str] | None = None
        self._kill_at = float("inf")
        self._wanted: _Wanted | None = None
        if limits.note:
            self._batch.log(limits.note)

    def run(self) -> RunState:
        while not isinstance(event := self._child.next(_POLL_SECONDS), Idle | End):
            if event is not None:
                self._take(event)
            now = time.monotonic()
            patience = COMMIT_SECONDS if self._batch.checkpoint is None else CHECKPOINT_SECONDS
            if now - self._committed >= patience:
                self._store.commit(self._claim, self._batch)
                self._batch = Batch()
                self._committed = now
            self._answer(now)
            self._enforce(now)
        ending = self._judge(self._child.wait() if isinstance(event, End) else None)
        self._store.finish(self._claim, ending, self._batch)
        return ending.outcome

    def _take(self, event: Event) -> None:
        match event:
            case LogLine(text):
                self._log(text)
            case Refused(reason):
                self._refused = self._refused or reason
                self._child.kill()
            case MetricMessage(step=step, values=values):
                self._batch.metrics.update({(name, step): value for name, value in values.items()})
            case MilestoneMessage(step=step, score=score, params=params):
                self._batch.milestones[step] = MilestoneRow(step, score, decode_params(params))
            case CheckpointMessage(data=data):
                self._batch.checkpoint = data
            case ProgressMessage(fraction=fraction, score=score):
                self._batch.fraction, self._batch.score = fraction, score
            case ReferenceWantedMessage(key=key):
                now = time.monotonic()
                self._wanted = _Wanted(key, since=now, look_at=now)
            case ReferenceMessage(key=key, value=value, unit=unit):
                self._store.keep_reference(self._claim, key, value, unit)
            case LastWord():
                self._last_word = event
                self._kill_at = min(self._kill_at, time.monotonic() + EXIT_SECONDS)

    def _answer(self, now: float) -> None:
        """Tell the child the reference score that it wants, or that it is to compute it; not while another does."""
        wanted = self._wanted
        if wanted is None or now < wanted.look_at:
            return
        found = self._store.reference(self._claim, wanted.key)
        if found.value is None and not found.is_ours and now - wanted.since < REFERENCE_SECONDS:
            wanted.look_at = now + min(_MOST_LOOK_SECONDS, _POLL_SECONDS + 0.2 * (now - wanted.since))
            return
        self._child.answer(found.value, found.unit)
        self._wanted = None

    def _log(self, text: str) -> None:
        self._log_lines += 1
        self._last_log = text or self._last_log
        if self._log_lines < MOST_LOG_LINES:
            self._batch.log(text)
        elif self._log_lines == MOST_LOG_LINES:
            self._batch.log("(more lines were printed; they are not kept)")

    def _enforce(self, now: float) -> None:
        """Interrupt the child when asked to or when a limit is reached; kill it when it does not obey."""
        if self._last_word is None:
            if self._stop.is_set():
                self._halt(RunState.CANCELLED, "Interrupted; it goes on from its checkpoint.", now + GRACE_SECONDS)
            elif self._limits.timeout is not None and now - self._started > self._limits.timeout:
                reason = f"Stopped after {self._limits.timeout:g} s, its time limit."
                self._halt(RunState.TIMEOUT, reason, now + GRACE_SECONDS)
            elif now > self._limits.ask_at:
                reason = "Handed back, as the time of its worker was over; it goes on from its checkpoint."
                self._halt(RunState.CANCELLED, reason, self._limits.end_at)
            self._check_memory(now)
        if now > self._kill_at:
            self._child.kill()

    def _check_memory(self, now: float) -> None:
        allowed = self._limits.memory
        if allowed is None or self._refused or now - self._memory_at < _MEMORY_SECONDS:
            return
        self._memory_at = now
        used = self._child.memory()
        if used > allowed:
            self._refused = (
                f"Its process took {used / 1e6:,.0f} MB of memory, and --memory allows {allowed / 1e6:,.0f} MB. "
                "Allow more, or ask for a coarser fidelity or fewer frames."
            )
            self._child.kill()

    def _halt(self, outcome: RunState, reason: str, kill_at: float) -> None:
        """Ask the child to stop, to be killed at `kill_at`; the first reason counts, and the earliest time."""
        if self._halted is None:
            self._halted = (outcome, reason)
            self._child.ask_to_stop()
        self._kill_at = min(self._kill_at, kill_at)

    def _judge(self, code: int | None) -> Ending:
        """The ending of the attempt, by the child's last message; without one, by how the process ended if it has."""
        exit_facts: dict[str, Any] = {}
        if code is not None:
            exit_facts = {"exit_code": code} if code >= 0 else {"signal": -code}
        if self._refused:
            return Ending(RunState.FAILED, self._refused, **exit_facts)
        word = self._last_word
        if word is not None:
            exit_facts["peak_memory"] = word.peak_memory
        match word:
            case DoneMessage(finals=finals, params=params, archive=archive):
                rows = tuple(FinalRow(*final) for final in finals)
                return Ending(RunState.DONE, finals=rows, params=tuple(params), archive=archive, **exit_facts)
            case DivergedMessage(reason=reason):
                return Ending(RunState.DIVERGED, reason, **exit_facts)
            case FailedMessage(reason=reason, traceback=trace):
                return Ending(RunState.FAILED, reason, traceback=trace, **exit_facts)
        if self._halted is not None:
            return Ending(*self._halted, **exit_facts)
        died_alone = self._child.died_alone
        return Ending(RunState.LOST, self._describe_death(code or 0), died_alone=died_alone, **exit_facts)

    def _describe_death(self, code: int) -> str:
        last = f" Its last line: {self._last_log}" if self._last_log else ""
        if code >= 0:
            return f"Its process ended with exit code {code} and said nothing.{last}"
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = "an unknown signal"
        return f"Its process was killed by signal {-code} ({name}).{last}"
