"""The rows that go into a database and come out of it, as frozen values: no SQL and no SQLAlchemy here."""

import json
import math
import struct
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from zoobench.inputs import Start
from zoobench.spec import RunSpec


class RunState(StrEnum):
    """Where a run stands, and how an attempt ended. Each way of not succeeding is a state of its own."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"  # an exception, or the retries after losses are used up
    DIVERGED = "diverged"  # the physics left its bounds
    TIMEOUT = "timeout"
    LOST = "lost"  # of an attempt only: its worker or child died; the run itself is queued again
    CANCELLED = "cancelled"  # of an attempt: interrupted, and the run is queued again; of a run: by `zoobench cancel`
    SKIPPED = "skipped"  # the cell cannot be run; the reason says why

    @classmethod
    def stored(cls, text: str) -> "RunState":
        """The state that a database holds; a damaged one counts as no result."""
        return cls(text) if text in list(cls) else cls.FAILED


OPEN_STATES = (RunState.QUEUED, RunState.RUNNING)
UNSUCCESSFUL_STATES = (RunState.FAILED, RunState.DIVERGED, RunState.TIMEOUT, RunState.CANCELLED)


class ValueKind(StrEnum):
    """Which number a stored value is: databases keep no NaN and no infinity."""

    FINITE = "finite"
    NAN = "nan"
    PLUS_INFINITY = "+inf"
    MINUS_INFINITY = "-inf"


def encode_value(value: float) -> tuple[float | None, ValueKind]:
    """A number as the nullable value and the kind that are stored; the sign of zero is not kept, as SQLite does not."""
    if math.isfinite(value):
        return value + 0.0, ValueKind.FINITE
    if math.isnan(value):
        return None, ValueKind.NAN
    return None, ValueKind.PLUS_INFINITY if value > 0 else ValueKind.MINUS_INFINITY


def decode_value(value: float | None, kind: str) -> float:
    """The inverse of `encode_value`; NaN for a damaged value."""
    try:
        return float(kind if value is None else value)
    except ValueError:
        return math.nan


def storable(text: str | None) -> str | None:
    """The text with a question mark for whatever is no text in some database: NUL, and bytes that were no UTF-8."""
    return None if text is None else text.replace("\0", "?").encode(errors="replace").decode()


def encode_params(params: Sequence[float]) -> bytes:
    """Numbers as they are stored where there are many: in double precision, the lowest byte first."""
    return struct.pack(f"<{len(params)}d", *params)


def decode_params(data: bytes) -> tuple[float, ...]:
    """The inverse of `encode_params`."""
    return struct.unpack(f"<{len(data) // 8}d", data[: len(data) // 8 * 8])


def document_of(text: str) -> Mapping[str, Any]:
    """The document in a column of JSON; empty if it is damaged, which a run's digest tells."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


@dataclass(frozen=True)
class FinalRow:
    """One final result of a run; `unit` is empty for a pure number."""

    name: str
    value: float
    unit: str = ""


@dataclass(frozen=True)
class MetricRow:
    """One point of a learning curve; `attempt` is the one that wrote it."""

    name: str
    step: int
    value: float
    attempt: int = 0


@dataclass(frozen=True)
class SharedScore:
    """A reference score as one of the runs that share it finds it.

    Attributes:
        value: None where it is still to be computed.
        is_ours: whether that is the turn of the run that has asked; if not, another is at it.
    """

    value: float | None = None
    unit: str = ""
    is_ours: bool = False


@dataclass(frozen=True)
class MilestoneRow:
    """The best parameters of a run after `step` iterations, and their score."""

    step: int
    score: float
    params: tuple[float, ...]


@dataclass(frozen=True)
class LogRow:
    """One line that a run's child process printed; `at` in seconds since the epoch."""

    attempt: int
    at: float
    text: str


@dataclass(frozen=True)
class RunRow:
    """One run as `status` shows it. Times are seconds since the epoch.

    Attributes:
        attempt: the number of the newest attempt, 0 before the first.
        first_attempt: the one that the present result began with; above 1 if the run was done before and is done again.
        owner: the worker that holds it, as text of `zoobench.db.owner.Owner`.
        fraction: how much of its budget is used, 0 to 1.
        score: of the incumbent, None before the first and for a diverged one.
        seconds: wall time of all attempts together since `first_attempt` [s].
        progress_at: when it last reported anything; None before.
    """

    id: int
    key: str
    spec: RunSpec
    state: RunState
    attempt: int
    first_attempt: int
    seconds: float
    reason: str | None = None
    owner: str | None = None
    created_at: float = 0.0
    started_at: float | None = None
    finished_at: float | None = None
    progress_at: float | None = None
    lease_until: float | None = None
    fraction: float = 0.0
    score: float | None = None

    @property
    def has_ended(self) -> bool:
        """Whether nothing of the run is still to be done."""
        return self.state not in OPEN_STATES

    @property
    def seconds_left(self) -> float | None:
        """Time left at the rate so far [s]; None before the first progress."""
        if self.state is not RunState.RUNNING or self.fraction <= 0.0:
            return None
        return max(self.seconds * (1.0 - self.fraction) / self.fraction, 0.0)


@dataclass(frozen=True)
class AttemptRow:
    """One attempt at a run, kept for ever.

    Attributes:
        outcome: RUNNING until it ends.
        signal: the number of the signal that killed the child, if one did.
        resumed: whether it started from a checkpoint of an earlier attempt.
        progressed: whether it stored a new checkpoint.
        peak_memory: of the child [bytes], if it could tell.
        provenance: commit, versions and machine, as `zoobench.harness.provenance.gather` gives them.
    """

    number: int
    outcome: RunState
    owner: str
    host: str
    started_at: float
    ended_at: float | None
    wall_seconds: float | None
    exit_code: int | None
    signal: int | None
    reason: str | None
    traceback: str | None
    resumed: bool
    progressed: bool
    peak_memory: int | None
    provenance: Mapping[str, Any]


@dataclass(frozen=True)
class StudyRow:
    """The result of a study in one case.

    Attributes:
        case: its name.
        verdict: one word.
        document: all measurements, as JSON data; a number that is not finite is stored as `nan`, `+inf` or `-inf`.
        finished_at: when it was stored; 0 before.
    """

    case: str
    verdict: str
    document: Mapping[str, Any]
    finished_at: float = 0.0


TRANSFER = "transfer"
"""The study of solutions evaluated elsewhere than where they were found."""

LASTING = "lasting"
"""The study of solutions evaluated over more frames than their own."""


@dataclass(frozen=True)
class StudyRun:
    """One time that a study was carried out. Times are seconds since the epoch.

    Attributes:
        finished_at: None if it was interrupted or is under way: then `rows` are those done so far.
        provenance: commit, versions and machine.
    """

    id: int
    name: str
    started_at: float
    finished_at: float | None
    provenance: Mapping[str, Any]
    rows: tuple[StudyRow, ...]


@dataclass(frozen=True)
class EnqueueReport:
    """The runs of the specs handed to `Store.enqueue`, by their ids."""

    new: tuple[int, ...] = ()
    existing_done: tuple[int, ...] = ()
    existing_open: tuple[int, ...] = ()
    existing_failed: tuple[int, ...] = ()
    skipped: tuple[int, ...] = ()

    @property
    def open(self) -> tuple[int, ...]:
        """The runs that are still to be done, old and new, for `run_all`."""
        return tuple(sorted(self.new + self.existing_open))


@dataclass(frozen=True)
class Claim:
    """The right to work on a run. Owner and attempt together are the fencing token of every write.

    `stored` are the solutions that the spec names, as a start, gait or body, as far as the database has them; `since`
    is when it was taken, of the monotonic clock [s].
    """

    run_id: int
    spec: RunSpec
    owner: str
    attempt: int
    checkpoint: bytes | None
    stored: tuple[Start, ...] = ()
    since: float = 0.0


@dataclass
class Batch:
    """The messages of a child since the last commit; written in one transaction, in any order."""

    metrics: dict[tuple[str, int], float] = field(default_factory=dict)
    milestones: dict[int, MilestoneRow] = field(default_factory=dict)
    logs: list[tuple[float, str]] = field(default_factory=list)
    checkpoint: bytes | None = None
    fraction: float | None = None
    score: float | None = None

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to write but the lease."""
        contents = (self.metrics, self.milestones, self.logs)
        return not any(contents) and self.checkpoint is None and self.fraction is None

    def log(self, text: str) -> None:
        """Add one line with the present time."""
        self.logs.append((time.time(), text))


@dataclass(frozen=True)
class Ending:
    """The ending of an attempt.

    LOST and CANCELLED put the run back into the queue, the other outcomes end it. Only DONE has finals, `params`,
    the best parameters that were found, empty where there are none to find, and if the method keeps one an `archive`
    of other solutions. Of one that is LOST, `died_alone` tells that the process of its run ended while its parent lived
    on.
    """

    outcome: RunState
    reason: str | None = None
    finals: tuple[FinalRow, ...] = ()
    params: tuple[float, ...] | None = None
    archive: bytes | None = None
    traceback: str | None = None
    died_alone: bool = False
    exit_code: int | None = None
    signal: int | None = None
    peak_memory: int | None = None
