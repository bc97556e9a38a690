"""Runs, evaluations and films from Python: `zoobench.run(...)`, with the words and refusals of the command line."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.errors import UsageError

if TYPE_CHECKING:
    import pandas as pd

    from zoobench.db.frames import Frames
    from zoobench.db.rows import RunRow
    from zoobench.spec import Ref, Scalar

Names = str | Sequence[str]
"""Components as `--env` takes them, in one text or in several: `"desert,ice"`, `["desert", "ground[friction=0.2]"]`."""


def run(
    env: Names = "",
    task: Names = "",
    *,
    design: Names = "",
    controller: Names = "",
    method: Names = "",
    fidelity: str = "",
    seeds: int | str | Sequence[int] | None = None,
    budget: int | str | None = None,
    frames: int | None = None,
    suite: str = "",
    preset: str = "",
    smoke: bool = False,
    tolerance: float | None = None,
    decide: float | None = None,
    device: str = "",
    db: str | Path = "zoobench.db",
    jobs: int | None = None,
    timeout: float | None = None,
    retry: str = "",
    progress: "Callable[[RunRow], None] | None" = None,
) -> "pd.DataFrame":
    """Do every combination that is not done yet, as `zoobench run` does, and give the results of all of them.

    Called again after an interruption it goes on where it stopped. A run that does not succeed is a row with its state
    and reason, and raises nothing.

    Args:
        env, task, design, controller, method, fidelity, suite, preset, smoke, tolerance, decide, device, frames: as
            the options of the command.
        seeds: how many, or which.
        budget: in substeps, or a text as `"60 seconds"`.
        db: the database, a path or a PostgreSQL URL; it is made if it is not there.
        jobs: runs at a time; None for two, with `smoke` for one.
        timeout: wall time that one attempt may take [s].
        retry: state of earlier runs to try again: failed, diverged, timeout, cancelled or all.
        progress: called about twice a second with each run that has moved on, in place of the display.

    Returns:
        a row per run, see `Frames.tidy`.

    Raises:
        UsageError: the command would refuse these arguments; nothing was queued.
        StorageError: the database refuses.
        KeyboardInterrupt: results up to there are kept.
    """
    from zoobench.cell.loading import check_devices
    from zoobench.cli.options import coarsest_fidelity
    from zoobench.cli.output import say
    from zoobench.cli.progress import display
    from zoobench.cli.run import Retry, queue
    from zoobench.harness.grid import Skip
    from zoobench.harness.request import RunRequest
    from zoobench.harness.suites import spec_of
    from zoobench.harness.worker_pool import run_all
    from zoobench.spec import RunSelection

    if retry and retry not in list(Retry):
        raise UsageError(f"{retry!r} is no state to try again. Choose from {', '.join(Retry)}.")
    chosen = RunSelection(_text(env), _text(task), _text(design), _text(controller), _text(method), fidelity)
    amount = None if budget is None else str(budget)
    asked = RunRequest(chosen, _seeds(seeds), suite, preset, smoke, amount, frames, tolerance, decide, device)
    cells = asked.cells(str(db), coarsest_fidelity, say)
    check_devices(map(spec_of, cells))
    queued = queue(cells, str(db), retry=Retry(retry) if retry else None)
    workers = asked.workers if jobs is None else jobs
    if queued.todo and progress is not None:
        run_all(db, queued.todo, jobs=workers, timeout=timeout, on_update=lambda rows: _tell(progress, rows))
    elif queued.todo:
        with display(queued.todo) as shown:
            run_all(db, queued.todo, jobs=workers, timeout=timeout, on_update=shown.update)
    with load(db) as database:
        return database.tidy(keys={cell.key() for cell in cells if not isinstance(cell, Skip)})


def load(location: str | Path) -> "Frames":
    """The results in a database, a path or a PostgreSQL URL, as data frames: `load("zoobench.db").tidy()`.

    Raises:
        StorageError: there is no such database, or it cannot be read.
    """
    from zoobench import registry
    from zoobench.db.frames import Frames
    from zoobench.registry import KINDS

    def defaults(axis: str, ref: "Ref") -> "Mapping[str, Scalar]":
        try:
            return registry.get(KINDS[axis], ref.name, ref.version).stated(ref)
        except UsageError:  # of a version, or of a plug-in, that is gone
            return {}

    return Frames(location, defaults)


def evaluate(
    run: int | str, *, env: Names = "", task: Names = "", fidelity: Names = "", db: str | Path = "zoobench.db"
) -> "pd.DataFrame":
    """Evaluate a stored or published solution elsewhere, as `zoobench evaluate` does; nothing is stored.

    Args:
        run: its number, the start of its key, or `"best:ENV/TASK/DESIGN"`.
        env, task, fidelity: where; the run's own if not given.

    Returns:
        a row per episode, with the columns of `TransferRow`: score is None where the simulation diverged.

    Raises:
        UsageError: there is no such run, or it cannot be evaluated there.
        StorageError: the database cannot be read.
    """
    import pandas as pd

    from zoobench.cell.loading import check_devices
    from zoobench.cli.evaluate import targets_of
    from zoobench.cli.solutions import solution_named
    from zoobench.studies.transfer_study import transfer, transfer_fault

    found = solution_named(str(run), str(db))
    targets = targets_of(_text(env), _text(task), _text(fidelity))
    episodes = list(targets.of(found.spec))
    check_devices(episodes)
    name = found.name if found.run is None else found.run.id
    for cell in episodes:
        if fault := transfer_fault(name, found.spec, found.params, cell):
            raise UsageError(fault)
    return pd.DataFrame([asdict(row) for row in transfer(name, found.spec, found.params, targets)])


def film(
    run: int | str, path: str | Path, *, every: int = 1, width: int | None = None, db: str | Path = "zoobench.db"
) -> Path:
    """Film the best episode of a stored or published solution, simulated again, as `zoobench render` does.

    Args:
        run: its number, the start of its key, or `"best:ENV/TASK/DESIGN"`.
        path: of the file: .mp4, .gif, .png (a sheet), .npz or .pvd.
        every: which control frames are kept.
        width: of the picture [pixels].

    Raises:
        UsageError: there is no such run, or the extra `render` is missing.
    """
    from zoobench.cli.solutions import solution_named
    from zoobench.render.film import film as simulated
    from zoobench.render.film_files import check_tools, moments_of, write
    from zoobench.render.formats import destination

    target = destination(Path(path), None)
    check_tools(target.form)
    found = solution_named(str(run), str(db))
    moments = moments_of(target.form, found.spec.frames, every)
    episode = simulated(found.spec, found.params, moments=moments)
    write(episode, target, title=f"{found.name}: {found.spec}", width=width)
    return target.path


def _text(names: Names) -> str:
    return names if isinstance(names, str) else ",".join(names)


def _seeds(seeds: int | str | Sequence[int] | None) -> str | None:
    if seeds is None or isinstance(seeds, str | int):
        return None if seeds is None else str(seeds)
    return "".join(f"{seed}," for seed in seeds)


def _tell(progress: "Callable[[RunRow], None]", rows: "list[RunRow]") -> None:
    for row in rows:
        progress(row)
