"""Workers as jobs of Slurm, submitted by submitit; the extra `slurm`.

Each job is one worker that takes runs of the sweep from the database until none is queued or its time is nearly over;
another is submitted then. The database must be one that the nodes reach: that of a server, unless there is one node.
"""

import math
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from zoobench.cell.memory import allowed
from zoobench.db.rows import RunRow
from zoobench.errors import UsageError, ZoobenchError
from zoobench.harness.shift import shift_of, work_shift
from zoobench.harness.worker import WorkerOrders

FOLDER = Path("zoobench-slurm")
_MINUTES = 60
_LATEST_LINES = 20  # of the output of a job that failed, in the message
_EXIT_SECONDS = 30.0  # for jobs that were asked to end


@dataclass(frozen=True)
class SlurmSettings:
    """How the jobs are submitted.

    Attributes:
        options: of `sbatch`, such as `partition`, `account` or `qos`; `time` in minutes is the limit of a job.
        cluster: `slurm`, or `local` for processes of this machine that stand for jobs.
        folder: where the jobs write what they print.
    """

    options: Mapping[str, str | int]
    cluster: str = "slurm"
    folder: Path = FOLDER


class SlurmPool:
    """The jobs of one `run_all`, as its worker pool; leaving the context cancels those that are left.

    Raises:
        UsageError: there is no Slurm here, or an option is none.
    """

    def __init__(self, orders: WorkerOrders, settings: SlurmSettings) -> None:
        self._orders = orders
        self._executor = _executor(settings)
        self._seconds = _seconds(settings)
        self._jobs: list[Any] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for job in self._jobs:
            job.cancel()  # SIGTERM: the worker hands its run back
        deadline = time.monotonic() + _EXIT_SECONDS
        while not all(job.done(force_check=True) for job in self._jobs) and time.monotonic() < deadline:
            time.sleep(0.2)

    def is_elsewhere(self, row: RunRow) -> bool:
        """Whether the run is in the hands of a worker that is not one of these: of a job it cannot be told."""
        return False

    def tell_of_silence(self, rows: Iterable[RunRow], database: str) -> None:
        """Nothing: a job that cannot store anything says so in its own output."""

    def wait(self, timeout: float) -> None:
        """Wait so long [s]."""
        time.sleep(timeout)

    def keep_at_work(self, count: int) -> None:
        """Submit jobs in the place of those that have ended, so that there are `count`.

        Raises:
            ZoobenchError: a job failed; the message has the end of its output.
        """
        ended = [job for job in self._jobs if job.done()]
        self._jobs = [job for job in self._jobs if job not in ended]
        for job in ended:
            if (error := job.exception()) is not None:
                raise ZoobenchError(f"Slurm job {job.job_id} failed: {_end_of(job, error)}")
        for _ in range(count - len(self._jobs)):
            self._jobs.append(self._executor.submit(work_in_job, self._orders, self._seconds))


def work_in_job(orders: WorkerOrders, seconds: float) -> None:
    """Work within a job for so long [s]; the log of each run begins with where the job's own output is."""
    import submitit

    job = submitit.JobEnvironment()
    note = f"Slurm job {job.job_id}, whose own output is in {job.paths.stderr}"
    work_shift(replace(orders, note=note), shift_of(seconds))


def _executor(settings: SlurmSettings) -> Any:
    import submitit

    try:
        executor = submitit.AutoExecutor(folder=settings.folder.absolute(), cluster=settings.cluster)
    except RuntimeError as error:
        raise UsageError(f"There is no Slurm here: {error}. Type this where `sbatch` is, or leave --on out.") from None
    others = {f"slurm_{name}": value for name, value in settings.options.items() if name != "time"}
    memory = allowed()
    try:
        executor.update_parameters(
            name="zoobench",
            cpus_per_task=1,
            timeout_min=math.ceil(_seconds(settings) / _MINUTES),
            **({} if memory is None else {"mem_gb": memory / 2**30 + 1.0}),  # with the worker beside it
            **(others if settings.cluster == "slurm" else {}),
        )
    except (TypeError, ValueError, NameError) as error:
        raise UsageError(f"Slurm's options are refused: {error}. Write for example 'slurm[partition=cpu]'.") from None
    return executor


def _seconds(settings: SlurmSettings) -> float:
    """The time limit of a job [s]."""
    return float(settings.options.get("time", 24 * 60)) * _MINUTES


def _end_of(job: Any, error: BaseException) -> str:
    lines = (job.stderr() or str(error)).strip().splitlines()[-_LATEST_LINES:]
    return "\n".join([str(error).splitlines()[0] if str(error) else "no reason", *lines])
