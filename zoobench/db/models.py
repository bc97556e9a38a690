"""The tables. Times are seconds since the epoch; a change here needs a migration beside the initial one."""

from sqlalchemy import BigInteger, ForeignKey, Index, LargeBinary, String, Text, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class Base(DeclarativeBase):
    """Declarative base of all tables."""


class SpecRecord(Base):
    """The settings of a run; `document` is its canonical JSON, the other columns are for searching."""

    __tablename__ = "specs"

    key: Mapped[str] = mapped_column(String(64), primary_key=True)
    document: Mapped[str] = mapped_column(Text)
    env: Mapped[str] = mapped_column(String(200), index=True)
    task: Mapped[str] = mapped_column(String(200), index=True)
    design: Mapped[str] = mapped_column(String(200), index=True)
    controller: Mapped[str] = mapped_column(String(200), index=True)
    method: Mapped[str] = mapped_column(String(200), index=True)
    fidelity: Mapped[str] = mapped_column(String(200), index=True)
    seed: Mapped[int]
    frames: Mapped[int]
    budget_kind: Mapped[str] = mapped_column(String(20))
    budget_amount: Mapped[float]


class RunRecord(Base):
    """One run of one spec. `(id, owner, attempt)` is the fencing token of its worker.

    `lease_until` shows whether its worker is alive, `progress_at` whether it makes progress; `strikes` counts
    the attempts lost in a row without a new checkpoint. Of those that are queued the one of the lowest `rank`, minus
    its priority, and of these the oldest is taken first. `digest` is that of a run that has ended, see
    `zoobench.db.digests`; those that an earlier zoobench ended have none.
    """

    __tablename__ = "runs"
    __table_args__ = (Index("ix_runs_state_id", "state", "id"), Index("ix_runs_queue", "state", "rank", "id"))

    id: Mapped[int] = mapped_column(primary_key=True)
    spec_key: Mapped[str] = mapped_column(ForeignKey("specs.key"), unique=True)
    state: Mapped[str] = mapped_column(String(12))
    attempt: Mapped[int] = mapped_column(default=0)
    strikes: Mapped[int] = mapped_column(default=0)
    owner: Mapped[str | None] = mapped_column(String(300))
    lease_until: Mapped[float | None]
    progress_at: Mapped[float | None]
    fraction: Mapped[float] = mapped_column(default=0.0)
    score: Mapped[float | None]
    reason: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[float]
    started_at: Mapped[float | None]
    finished_at: Mapped[float | None] = mapped_column(index=True)
    digest: Mapped[str | None] = mapped_column(String(64))
    rank: Mapped[int] = mapped_column(default=0, server_default="0")


class SweepRecord(Base):
    """What one launcher was asked to have done; its runs are those of `SweepRunRecord`."""

    __tablename__ = "sweeps"

    id: Mapped[int] = mapped_column(primary_key=True)
    created_at: Mapped[float]


class SweepRunRecord(Base):
    """A run of a sweep; a run may be in several, as several launchers may be asked for it."""

    __tablename__ = "sweep_runs"

    sweep_id: Mapped[int] = mapped_column(ForeignKey("sweeps.id"), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)


class ProvenanceRecord(Base):
    """Code, packages and machine, stored once for all attempts that share them."""

    __tablename__ = "provenance"

    hash: Mapped[str] = mapped_column(String(64), primary_key=True)
    document: Mapped[str] = mapped_column(Text)


class AttemptRecord(Base):
    """One attempt at a run; what it took so far, in `wall_seconds`, is written with every renewal of its lease."""

    __tablename__ = "attempts"
    __table_args__ = (UniqueConstraint("run_id", "number"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    number: Mapped[int]
    outcome: Mapped[str] = mapped_column(String(12))
    owner: Mapped[str] = mapped_column(String(300))
    host: Mapped[str] = mapped_column(String(255))
    provenance_hash: Mapped[str] = mapped_column(ForeignKey("provenance.hash"))
    started_at: Mapped[float]
    ended_at: Mapped[float | None]
    wall_seconds: Mapped[float | None]
    exit_code: Mapped[int | None]
    signal: Mapped[int | None]
    reason: Mapped[str | None] = mapped_column(Text)
    traceback: Mapped[str | None] = mapped_column(Text)
    resumed: Mapped[bool]
    progressed: Mapped[bool] = mapped_column(default=False)
    peak_memory: Mapped[int | None] = mapped_column(BigInteger)


class MetricRecord(Base):
    """One point of a learning curve; a resumed run overwrites the points that it computes again."""

    __tablename__ = "metrics"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    name: Mapped[str] = mapped_column(String(100), primary_key=True)
    step: Mapped[int] = mapped_column(primary_key=True)
    attempt: Mapped[int]
    value: Mapped[float | None]
    kind: Mapped[str] = mapped_column(String(8))


class FinalRecord(Base):
    """One final result, written in the transaction that ends the run as DONE."""

    __tablename__ = "finals"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    name: Mapped[str] = mapped_column(String(100), primary_key=True)
    value: Mapped[float | None]
    kind: Mapped[str] = mapped_column(String(8))
    unit: Mapped[str] = mapped_column(String(30))


class SolutionRecord(Base):
    """The best parameters that a run has found, written with its finals; `params` as `rows.encode_params` gives it."""

    __tablename__ = "solutions"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    params: Mapped[bytes] = mapped_column(LargeBinary)


class ArchiveRecord(Base):
    """The archive of a run, if its method keeps one; `data` as the child process sent it."""

    __tablename__ = "archives"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    data: Mapped[bytes] = mapped_column(LargeBinary)


class MilestoneRecord(Base):
    """The best parameters after some iterations of a run, and their score; `params` as `rows.encode_params` gives it.

    An iteration without a row, between two that have one, found nothing better than the one before.
    """

    __tablename__ = "milestones"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    step: Mapped[int] = mapped_column(primary_key=True)
    attempt: Mapped[int]
    score: Mapped[float]
    params: Mapped[bytes] = mapped_column(LargeBinary)


class CheckpointRecord(Base):
    """The newest state from which a run can go on; removed when the run is done."""

    __tablename__ = "checkpoints"

    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    attempt: Mapped[int]
    saved_at: Mapped[float]
    data: Mapped[bytes] = mapped_column(LargeBinary)


class ReferenceRecord(Base):
    """A reference score under the key of all that decides it; without `kind` while run and attempt compute it."""

    __tablename__ = "reference_scores"

    key: Mapped[str] = mapped_column(String(64), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"))
    attempt: Mapped[int]
    value: Mapped[float | None]
    kind: Mapped[str | None] = mapped_column(String(8))
    unit: Mapped[str | None] = mapped_column(String(30))


class LogRecord(Base):
    """One line that a child process printed."""

    __tablename__ = "logs"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("runs.id"), index=True)
    attempt: Mapped[int]
    at: Mapped[float]
    text: Mapped[str] = mapped_column(Text)


class StudyRecord(Base):
    """One time that a study was carried out; one without `finished_at` was interrupted, or is under way."""

    __tablename__ = "studies"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(40), index=True)
    provenance_hash: Mapped[str] = mapped_column(ForeignKey("provenance.hash"))
    started_at: Mapped[float]
    finished_at: Mapped[float | None]


class StudyRowRecord(Base):
    """The result of a study in one case, in the order in which the cases were done; `document` is JSON."""

    __tablename__ = "study_rows"

    study_id: Mapped[int] = mapped_column(ForeignKey("studies.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)
    case_name: Mapped[str] = mapped_column(String(200))
    verdict: Mapped[str] = mapped_column(String(12))
    document: Mapped[str] = mapped_column(Text)
    finished_at: Mapped[float]
