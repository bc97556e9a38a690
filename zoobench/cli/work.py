"""`zoobench work`: a worker for a batch job or a container, which takes runs from the queue."""

from typing import TYPE_CHECKING, Annotated

from typer import Exit, Option

from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    MemoryOption,
    TimeoutOption,
    command_text,
    parse_duration,
)
from zoobench.cli.output import say

if TYPE_CHECKING:
    from zoobench.db.rows import RunRow


def work(
    max_time: Annotated[
        str | None,
        Option(
            "--max-time", help="Stop after this time, as in 3h. The current run is queued again with its checkpoint."
        ),
    ] = None,
    max_runs: Annotated[int | None, Option("--max-runs", min=1, help="Stop after this number of runs.")] = None,
    sweep: Annotated[
        int | None, Option("--sweep", help="Only runs of this sweep. `zoobench run --no-wait` prints its number.")
    ] = None,
    timeout: TimeoutOption = None,
    memory: MemoryOption = "",
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Execute queued runs until none is left.

    Use it in batch jobs and containers. It executes one run at a time. Any number of workers can share a database. On
    SIGTERM or Ctrl-C the current run is queued again with its checkpoint, and the exit code is 130.
    """
    from zoobench.cell.memory import allow
    from zoobench.cli.progress import describe
    from zoobench.db.rows import RunState
    from zoobench.db.store import Store
    from zoobench.harness.provenance import changed_plugins
    from zoobench.harness.shift import shift_of, work_shift
    from zoobench.harness.worker import WorkerOrders

    limit = None if timeout is None else parse_duration(timeout)
    shift = shift_of(None if max_time is None else parse_duration(max_time), max_runs)
    if memory:
        allow(memory)
    seen: dict[int, RunRow] = {}
    with Store(db, create=False) as before:
        plugins = before.plugins()
    warned: set[str] = set()

    def tell(store: Store, run_id: int) -> None:
        (row,) = store.runs(ids=[run_id])
        for note in changed_plugins([row.spec] if plugins else [], plugins):
            if note not in warned:
                say(note)
            warned.add(note)
        seen[run_id] = row
        say(describe(row))

    is_stopped = work_shift(WorkerOrders(db, sweep, limit), shift, tell)
    if is_stopped:
        say("Stopped. The current run is queued again; the next worker resumes it.")
        raise Exit(130)
    states = [row.state for row in seen.values()]
    say(f"{states.count(RunState.DONE)} done of {len(states)} taken. Next: {command_text('status', db=db)}")
    if any(row.has_ended and row.state is not RunState.DONE for row in seen.values()):
        raise Exit(1)
