"""The tables, with the meaning of every column. A change here needs a migration after the initial one."""

from sqlalchemy import BigInteger, ForeignKey, Index, LargeBinary, String, Text, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class Base(DeclarativeBase):
    """Declarative base of all tables."""


class SpecRecord(Base):
    """The settings of a run; `document` is its canonical JSON, the other columns are for searching."""

    __tablename__ = "specs"

    key: Mapped[str] = mapped_column(
        String(64), primary_key=True, doc="sha256 of the canonical settings: the identity of the run in every database"
    )
    document: Mapped[str] = mapped_column(Text, doc="all settings as canonical JSON")
    env: Mapped[str] = mapped_column(String(200), index=True, doc="the environment with version and parameters")
    task: Mapped[str] = mapped_column(String(200), index=True, doc="the task with version and parameters")
    design: Mapped[str] = mapped_column(String(200), index=True, doc="the design with version and parameters")
    controller: Mapped[str] = mapped_column(String(200), index=True, doc="the controller with version and parameters")
    method: Mapped[str] = mapped_column(String(200), index=True, doc="the method with version and parameters")
    fidelity: Mapped[str] = mapped_column(String(200), index=True, doc="the fidelity with version and parameters")
    seed: Mapped[int] = mapped_column(doc="of the method")
    frames: Mapped[int] = mapped_column(doc="length of an episode [control frames]")
    budget_kind: Mapped[str] = mapped_column(
        String(20), doc="unit of the budget: substeps, episodes, iterations or seconds"
    )
    budget_amount: Mapped[float] = mapped_column(doc="how many of them")


class RunRecord(Base):
    """One run of one spec. `(id, owner, attempt)` is the fencing token of its worker.

    `lease_until` shows whether its worker is alive, `progress_at` whether it makes progress; `strikes` counts
    the attempts lost in a row without a new checkpoint. Of those that are queued the one of the lowest `rank`, minus
    its priority, and of these the oldest is taken first. `digest` is that of a run that has ended, see
    `zoobench.db.digests`; those that an earlier zoobench ended have none.
    """

    __tablename__ = "runs"
    __table_args__ = (Index("ix_runs_state_id", "state", "id"), Index("ix_runs_queue", "state", "rank", "id"))

    id: Mapped[int] = mapped_column(primary_key=True, doc="the number by which commands name the run")
    spec_key: Mapped[str] = mapped_column(ForeignKey("specs.key"), unique=True, doc="its settings")
    state: Mapped[str] = mapped_column(
        String(12), doc="queued, running, done, failed, diverged, timeout, cancelled or skipped"
    )
    attempt: Mapped[int] = mapped_column(default=0, doc="number of the newest attempt, 0 before the first")
    strikes: Mapped[int] = mapped_column(default=0, doc="deaths of its process in a row without a new checkpoint")
    owner: Mapped[str | None] = mapped_column(String(300), doc="the worker that holds it")
    lease_until: Mapped[float | None] = mapped_column(doc="until when its worker is taken to be alive [s]")
    progress_at: Mapped[float | None] = mapped_column(doc="when it last reported anything [s]")
    fraction: Mapped[float] = mapped_column(default=0.0, doc="share of its budget that is used, 0 to 1")
    score: Mapped[float | None] = mapped_column(doc="of the best solution so far")
    reason: Mapped[str | None] = mapped_column(Text, doc="why it did not succeed")
    created_at: Mapped[float] = mapped_column(doc="when it was queued [s]")
    started_at: Mapped[float | None] = mapped_column(doc="when it first began [s]")
    finished_at: Mapped[float | None] = mapped_column(index=True, doc="when it ended [s]")
    digest: Mapped[str | None] = mapped_column(String(64), doc="sha256 of all that is stored of a run that has ended")
    rank: Mapped[int] = mapped_column(
        default=0, server_default="0", doc="minus its priority: the lowest is taken first"
    )


class SweepRecord(Base):
    """The runs that one launcher was asked to have done: those of `sweep_runs`."""

    __tablename__ = "sweeps"

    id: Mapped[int] = mapped_column(primary_key=True, doc="the number of the launch")
    created_at: Mapped[float] = mapped_column(doc="when it was launched [s]")


class SweepRunRecord(Base):
    """A run of a sweep; a run may be in several, as several launchers may be asked for it."""

    __tablename__ = "sweep_runs"

    sweep_id: Mapped[int] = mapped_column(ForeignKey("sweeps.id"), primary_key=True, doc="the launch")
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True, doc="the run")


class ProvenanceRecord(Base):
    """Code, packages and machine, stored once for all attempts that share them."""

    __tablename__ = "provenance"

    hash: Mapped[str] = mapped_column(String(64), primary_key=True, doc="sha256 of the document")
    document: Mapped[str] = mapped_column(Text, doc="commit, packages, machine and settings as JSON")


class AttemptRecord(Base):
    """One attempt at a run; its time so far, `wall_seconds`, is written with every renewal of its lease."""

    __tablename__ = "attempts"
    __table_args__ = (UniqueConstraint("run_id", "number"),)

    id: Mapped[int] = mapped_column(primary_key=True, doc="the number of the row")
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), doc="the run")
    number: Mapped[int] = mapped_column(doc="of the attempt at it, from 1")
    outcome: Mapped[str] = mapped_column(String(12), doc="how it ended, as a state of runs, or lost")
    owner: Mapped[str] = mapped_column(String(300), doc="the worker that made it")
    host: Mapped[str] = mapped_column(String(255), doc="the machine")
    provenance_hash: Mapped[str] = mapped_column(ForeignKey("provenance.hash"), doc="code, packages and machine")
    started_at: Mapped[float] = mapped_column(doc="when it began [s]")
    ended_at: Mapped[float | None] = mapped_column(doc="when it ended [s]")
    wall_seconds: Mapped[float | None] = mapped_column(doc="wall time that it took so far [s]")
    exit_code: Mapped[int | None] = mapped_column(doc="of its process, if it ended by itself")
    signal: Mapped[int | None] = mapped_column(doc="that ended its process")
    reason: Mapped[str | None] = mapped_column(Text, doc="why it did not succeed")
    traceback: Mapped[str | None] = mapped_column(Text, doc="of the exception that ended it")
    resumed: Mapped[bool] = mapped_column(doc="whether it went on from a checkpoint")
    progressed: Mapped[bool] = mapped_column(default=False, doc="whether it wrote a checkpoint of its own")
    peak_memory: Mapped[int | None] = mapped_column(BigInteger, doc="most memory that it took [bytes]")


class MetricRecord(Base):
    """One point of a learning curve; a resumed run overwrites the points that it computes again."""

    __tablename__ = "metrics"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True, doc="the run")
    name: Mapped[str] = mapped_column(String(100), primary_key=True, doc="of the curve, such as score")
    step: Mapped[int] = mapped_column(primary_key=True, doc="iteration of the method")
    attempt: Mapped[int] = mapped_column(doc="that wrote the point")
    value: Mapped[float | None] = mapped_column(doc="empty where it is not finite")
    kind: Mapped[str] = mapped_column(String(8), doc="finite, nan, +inf or -inf")


class FinalRecord(Base):
    """One final result, written in the transaction that ends the run as DONE."""

    __tablename__ = "finals"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True, doc="the run")
    name: Mapped[str] = mapped_column(String(100), primary_key=True, doc="of the result, such as score or energy")
    value: Mapped[float | None] = mapped_column(doc="empty where it is not finite")
    kind: Mapped[str] = mapped_column(String(8), doc="finite, nan, +inf or -inf")
    unit: Mapped[str] = mapped_column(String(30), doc="empty for a pure number")


class SolutionRecord(Base):
    """The best parameters that a run has found, written with its finals."""

    __tablename__ = "solutions"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True, doc="the run")
    params: Mapped[bytes] = mapped_column(LargeBinary, doc="of controller and design: doubles, the lowest byte first")


class ArchiveRecord(Base):
    """The archive of a run, if its method keeps one; `data` as the child process sent it."""

    __tablename__ = "archives"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True, doc="the run")
    data: Mapped[bytes] = mapped_column(LargeBinary, doc="the archive in the form of its method")


class MilestoneRecord(Base):
    """The best parameters after some iterations of a run, and their score.

    An iteration without a row, between two that have one, found nothing better than the one before.
    """

    __tablename__ = "milestones"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True, doc="the run")
    step: Mapped[int] = mapped_column(primary_key=True, doc="iteration of the method")
    attempt: Mapped[int] = mapped_column(doc="that wrote it")
    score: Mapped[float] = mapped_column(doc="of the parameters")
    params: Mapped[bytes] = mapped_column(LargeBinary, doc="doubles, the lowest byte first")


class CheckpointRecord(Base):
    """The newest state from which a run can go on; removed when the run is done."""

    __tablename__ = "checkpoints"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True, doc="the run")
    attempt: Mapped[int] = mapped_column(doc="that wrote it")
    saved_at: Mapped[float] = mapped_column(doc="when it was written [s]")
    data: Mapped[bytes] = mapped_column(LargeBinary, doc="the state in the form of its method")


class ReferenceRecord(Base):
    """A reference score under the key of all that decides it; without `kind` while run and attempt compute it."""

    __tablename__ = "reference_scores"

    key: Mapped[str] = mapped_column(String(64), primary_key=True, doc="sha256 of all that decides the score")
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), doc="the run that has computed it, or does")
    attempt: Mapped[int] = mapped_column(doc="of that run")
    value: Mapped[float | None] = mapped_column(doc="empty where it is not finite, or not known yet")
    kind: Mapped[str | None] = mapped_column(String(8), doc="finite, nan, +inf or -inf; empty while it is computed")
    unit: Mapped[str | None] = mapped_column(String(30), doc="of the score")


class LogRecord(Base):
    """One line that a child process printed."""

    __tablename__ = "logs"

    id: Mapped[int] = mapped_column(
        primary_key=True, doc="the number of the line, in the order in which lines were written"
    )
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), index=True, doc="the run")
    attempt: Mapped[int] = mapped_column(doc="that printed it")
    at: Mapped[float] = mapped_column(doc="when it was printed [s]")
    text: Mapped[str] = mapped_column(Text, doc="of the line")


class StudyRecord(Base):
    """One time that a study was carried out; one without `finished_at` was interrupted, or is under way."""

    __tablename__ = "studies"

    id: Mapped[int] = mapped_column(primary_key=True, doc="the number of the study")
    name: Mapped[str] = mapped_column(String(40), index=True, doc="of the study's command")
    provenance_hash: Mapped[str] = mapped_column(ForeignKey("provenance.hash"), doc="code, packages and machine")
    started_at: Mapped[float] = mapped_column(doc="when it began [s]")
    finished_at: Mapped[float | None] = mapped_column(doc="when it was complete [s]")


class StudyRowRecord(Base):
    """The result of a study in one case, in the order in which the cases were done; `document` is JSON."""

    __tablename__ = "study_rows"

    study_id: Mapped[int] = mapped_column(ForeignKey("studies.id"), primary_key=True, doc="the study")
    number: Mapped[int] = mapped_column(primary_key=True, doc="of the case, in the order in which they were done")
    case_name: Mapped[str] = mapped_column(String(200), doc="the case")
    verdict: Mapped[str] = mapped_column(String(12), doc="the verdict, in a word")
    document: Mapped[str] = mapped_column(Text, doc="the measured values, as JSON")
    finished_at: Mapped[float] = mapped_column(doc="when it was done [s]")
