"""`zoobench run`: do the runs that are asked for and not done yet."""

from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from fnmatch import fnmatchcase
from functools import partial
from typing import TYPE_CHECKING, Annotated, NamedTuple

from typer import Exit, Option

from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    MemoryOption,
    RunWorkersOption,
    TimeoutOption,
    coarsest_fidelity,
    command_text,
    parse_duration,
    request,
    takes,
)
from zoobench.cli.output import Format, say
from zoobench.cli.plan import check_anything_is_left, expected_memory, show_plan
from zoobench.errors import UsageError
from zoobench.spec import AXES

if TYPE_CHECKING:
    from zoobench.db.rows import EnqueueReport, RunRow
    from zoobench.db.store import Store
    from zoobench.harness.grid import Skip
    from zoobench.harness.request import RunRequest
    from zoobench.harness.worker import WorkerOrders
    from zoobench.harness.worker_pool import WorkerPool
    from zoobench.spec import RunSpec


class Retry(StrEnum):
    """Which unsuccessful runs to try again."""

    FAILED = "failed"
    DIVERGED = "diverged"
    TIMEOUT = "timeout"
    CANCELLED = "cancelled"
    ALL = "all"


@takes(request)
def run(
    asked: "RunRequest",
    jobs: RunWorkersOption = None,
    timeout: TimeoutOption = None,
    retry: Annotated[
        Retry | None, Option("--retry", help="Repeat runs of this command that ended in this state.")
    ] = None,
    rerun: Annotated[
        str, Option("--rerun", help="Repeat finished runs with a component whose name matches this glob.")
    ] = "",
    memory: MemoryOption = "",
    priority: Annotated[
        int | None, Option("--priority", help="Queue priority. Runs with a higher number start first; new runs have 0.")
    ] = None,
    on: Annotated[
        str,
        Option(
            "--on",
            help="Where to run: here; slurm, or 'slurm[partition=cpu,time=120]' with options of sbatch and the time in "
            "minutes; ray, or ray=ADDRESS for a Ray cluster. -j sets the number of parallel runs.",
        ),
    ] = "here",
    no_wait: Annotated[bool, Option("--no-wait", help="Only queue the runs. `zoobench work` executes them.")] = False,
    dry: Annotated[bool, Option("--dry-run", help="Show the runs and their time. Start and write nothing.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: Annotated[Format, Option("--format", "-f", help="Output format of --dry-run.")] = Format.TABLE,
) -> None:
    """Run every combination that has no result yet.

    After an interruption, the same command resumes every run from its last checkpoint. The preset or the suite sets
    the options that are not given. The time of --dry-run is estimated from finished runs in the database, or else from
    measured rates of the simulator; its last lines name the source, and the time of each part of a suite.
    """
    if dry:
        show_plan(asked, jobs or asked.workers, db, form)
        return
    if form is not Format.TABLE:
        raise UsageError(f"--format {form} is for --dry-run. `zoobench results --format {form}` prints what was run.")
    from zoobench.cell.loading import check_devices
    from zoobench.cell.memory import allow
    from zoobench.harness.engines import engine_named
    from zoobench.harness.grid import Skip
    from zoobench.harness.suites import spec_of

    if no_wait and (timeout is not None or memory):
        raise UsageError(
            "--timeout and --memory limit attempts, and --no-wait starts none. Give them to zoobench work."
        )
    engine: Callable[..., WorkerPool] | None = engine_named(on)
    limit = None if timeout is None else parse_duration(timeout)
    if memory:
        allow(memory)
    cells = asked.cells(db, coarsest_fidelity, say)
    if engine is None and not no_wait:
        check_devices(map(spec_of, cells))
    if engine is not None and on.startswith("ray"):
        engine = partial(engine, memory=expected_memory(cell for cell in cells if not isinstance(cell, Skip)))
    queued = queue(cells, db, retry=retry, rerun=rerun, priority=priority)
    check_anything_is_left(cells)
    if no_wait:
        _tell_sweep(queued, db)
    else:
        carry_through(queued, db, jobs=jobs or asked.workers, limit=limit, engine=engine)


class Queued(NamedTuple):
    """What a command has queued.

    Attributes:
        todo: ids of the runs to be done.
        failed_before: ids of those that had no success and are not tried again.
        is_smoke: whether all runs of the command are smoke runs.
    """

    todo: list[int]
    failed_before: set[int]
    is_smoke: bool


def queue(
    cells: "Sequence[RunSpec | Skip]",
    db: str,
    *,
    retry: Retry | None = None,
    rerun: str = "",
    priority: int | None = None,
) -> Queued:
    """Queue what is not done yet, as `run` says, and tell the plan."""
    from zoobench.db.store import Store
    from zoobench.harness.grid import Skip
    from zoobench.harness.provenance import changed_plugins
    from zoobench.harness.suites import spec_of
    from zoobench.spec import check_storable

    check_storable("priority", priority or 0)
    skips = [cell for cell in cells if isinstance(cell, Skip)]
    with Store(db) as store:
        report = store.enqueue(
            [cell for cell in cells if not isinstance(cell, Skip)],
            skips=[(skip.spec, skip.reason) for skip in skips],
        )
        again = _queue_again(store, report, retry, rerun)
        for note in changed_plugins((spec_of(cell) for cell in cells), store.plugins()):
            say(note)
        todo = sorted({*report.open, *again})
        if priority is not None:
            store.prioritise(todo, priority)
    _tell_plan(report, again, skips)
    is_smoke = all(spec_of(cell).fidelity.name == "smoke" for cell in cells)
    return Queued(todo, set(report.existing_failed) - set(again), is_smoke)


def carry_through(
    queued: Queued,
    db: str,
    *,
    jobs: int,
    limit: float | None = None,
    engine: "Callable[[WorkerOrders], WorkerPool] | None" = None,
) -> None:
    """Do what was queued, each attempt for at most `limit` [s], and tell how it ended."""
    from zoobench.cli.progress import carry_out

    rows = carry_out(db, queued.todo, jobs=jobs, timeout=limit, engine=engine)
    _conclude(rows, queued.failed_before, db, is_smoke=queued.is_smoke)


def _tell_sweep(queued: Queued, db: str) -> None:
    """Say by which command the queued runs will be done."""
    from zoobench.db.store import Store

    if not queued.todo:
        say("No run is left to do.")
        return
    with Store(db) as store:
        sweep = store.begin_sweep(queued.todo)
    say(f"Next: {command_text('work', '--sweep', str(sweep), db=db)}")


def _queue_again(store: "Store", report: "EnqueueReport", retry: Retry | None, rerun: str) -> list[int]:
    """Queue the runs of this command again that --retry and --rerun name; their ids."""
    from zoobench.db.rows import UNSUCCESSFUL_STATES, RunState

    again: list[int] = []
    if retry is not None:
        states = UNSUCCESSFUL_STATES if retry is Retry.ALL else (RunState(retry.value),)
        again += store.retry(report.existing_failed, states=states)
    if rerun:
        ended = store.runs(ids=[*report.existing_done, *report.existing_failed])
        named = [row.id for row in ended if any(fnmatchcase(getattr(row.spec, axis).name, rerun) for axis in AXES[:5])]
        again += store.retry(named, states=(RunState.DONE, *UNSUCCESSFUL_STATES))
        if not named:
            say(f"--rerun {rerun}: none of the finished runs has a component of that name.")
    return again


def _tell_plan(report: "EnqueueReport", again: list[int], skips: "Iterable[Skip]") -> None:
    groups = {
        "new": report.new,
        "in progress": report.existing_open,
        "to be repeated": again,
        "done already": set(report.existing_done) - set(again),
        "failed before (--retry all repeats them)": set(report.existing_failed) - set(again),
        "skipped": report.skipped,
    }
    always = ("new", "done already", "skipped")
    say(", ".join(f"{len(ids)} {name}" for name, ids in groups.items() if ids or name in always))
    for skip in skips:
        say(f"  skipped {skip.spec}: {skip.reason}")


def _conclude(rows: "list[RunRow]", failed_before: set[int], db: str, *, is_smoke: bool) -> None:
    """Print failed runs and the next command; the exit code is 1 if some run did not succeed."""
    from zoobench.db.rows import RunState
    from zoobench.report.views import counts_text

    failed = [row for row in rows if row.state is not RunState.DONE]
    if rows:
        states = [row.state for row in rows]
        say(counts_text({state: states.count(state) for state in states}))
    for row in failed:
        say(f"  why run {row.id} {row.state}: {command_text('show', str(row.id), '--log', db=db)}")
    say(f"Next: {command_text('results' if is_smoke else 'table', db=db)}")
    if failed or failed_before:
        raise Exit(1)
