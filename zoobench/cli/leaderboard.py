"""`zoobench leaderboard`: the results of suites, from a database to committed files."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option

from zoobench.cli import completion
from zoobench.cli.app import App
from zoobench.cli.listings import TableStyle, print_tables
from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption
from zoobench.cli.output import Format, say
from zoobench.cli.steps import Steps
from zoobench.cli.studies import save_each
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.db.rows import RunRow
    from zoobench.report.leaderboard import Leaderboard
    from zoobench.spec import Ref, RunSpec

FOLDER = Path("leaderboards")

SuiteArgument = Annotated[
    str,
    Argument(help="Suite: a name from `zoobench list suites`, or a .yaml file.", autocompletion=completion.suites),
]

leaderboard = App(no_args_is_help=True, help="Show, publish and check the results of whole suites.")


@leaderboard.command("show")
def show(suite: SuiteArgument, db: DatabaseOption = DEFAULT_DATABASE, form: FormatOption = Format.TABLE) -> None:
    """Print the tables of a suite and the number of its missing runs."""
    from zoobench.accuracy.tolerance import orders
    from zoobench.report.footer import footer
    from zoobench.report.leaderboard_pages import judged, tables_of
    from zoobench.report.undecided import footnotes

    board = _board_of(suite, db)
    every = tables_of(board)
    tables = judged(every, orders)
    command = ["zoobench", "leaderboard", "show", suite, "--format", str(form)]
    origins = board.attempts(run for table in tables for run in table.runs)
    foot = replace(footer(tables, origins, command), undecided=footnotes(tables, orders))
    print_tables(tables, foot, form, TableStyle())
    left_out = sum(len(table.rows) for table in every) - sum(len(table.rows) for table in tables)
    say(f"{len(board.missing()):,} runs of the suite are missing; {left_out:,} rows without any run are not shown.")


@leaderboard.command("confirm")
def confirm(
    suite: SuiteArgument,
    db: DatabaseOption = DEFAULT_DATABASE,
    folder: Annotated[
        Path | None,
        Option("--from", help="Only run the longer episodes, for the solutions in this folder, and update its pages."),
    ] = None,
) -> None:
    """Verify the best solutions on a finer grid and in longer episodes.

    The best solution of each row and method is simulated two fidelities finer, and over three times its frames. The
    scores are stored. `leaderboard publish` then marks the rows whose ranking agrees on the finer grid, and the gaits
    that last. A simulation that diverges is repeated with 27 particles per cell. Bodies of the design space `particle`
    cannot be simulated on a finer grid. With --from, only the longer episodes are run.
    """
    if folder is not None:
        _lengthen_published(suite, folder)
        return
    _refine(suite, db)
    _lengthen(suite, db)
    say("All evaluations are done. Next: zoobench leaderboard publish")


def _lengthen(suite: str, db: str) -> None:
    """Simulate the best solutions of a suite's rows and methods over more frames, as far as that was not done."""
    from zoobench.db.rows import LASTING
    from zoobench.db.store import Store
    from zoobench.harness.starts import look_in, solution_of
    from zoobench.report.lasting import TIMES
    from zoobench.report.leaderboard import best_of_rows
    from zoobench.studies.lasting_study import LastingRow, lasting, stored

    look_in(db)
    specs = [row.spec for row in best_of_rows(_board_of(suite, db).rows, by_method=True) if row.lasting is None]
    with Store(db, create=False) as store:
        runs = [store.run(spec.key()) for spec in specs]
        chosen = [(run, solution_of(store, run)) for run in runs]

    def lengthened() -> "Iterator[LastingRow]":
        for run, params in chosen:
            try:
                yield lasting(run.id, run.spec, params, TIMES)
            except UsageError as error:
                say(f"Left out: run {run.id}: {error}")

    with Steps(len(chosen)) as steps:
        for row in save_each(db, LASTING, lengthened(), stored):
            steps.end(f"{row.title} over {row.frames} frames: {row.result}")


def _lengthen_published(suite: str, folder: Path) -> None:
    """The same with the solutions that the folder's export of a suite holds, whose pages are written anew."""
    from zoobench.accuracy.tolerance import orders
    from zoobench.report import leaderboard_files
    from zoobench.report.lasting import TIMES, Lasting
    from zoobench.studies.lasting_study import lasting

    board = leaderboard_files.read_export(folder, suite)
    chosen = [row for row in board.rows if row.solution is not None and row.lasting is None]
    with Steps(len(chosen)) as steps:
        for row in chosen:
            where = " x ".join(getattr(row.spec, axis).name for axis in ("env", "task", "design", "controller"))
            try:
                found = lasting(where, row.spec, row.solution or (), TIMES)
            except UsageError as error:
                steps.end(f"Left out: {where}: {error}")
                continue
            board = board.with_row(replace(row, lasting=Lasting.from_document(asdict(found))))
            leaderboard_files.write(board, folder, orders)
            steps.end(f"{where} over {found.frames} frames: {found.result}")
    _note_report(folder)


def _refine(suite: str, db: str) -> None:
    """Evaluate the best solutions of a suite's rows and methods on finer grids, as far as that was not done."""
    from zoobench.db.rows import TRANSFER
    from zoobench.db.store import Store
    from zoobench.harness.starts import solution_of
    from zoobench.spec import Ref
    from zoobench.studies.transfer_study import MisfitError, TransferRow, TransferTargets, stored, transfer

    misfits: set[RunSpec] = set()

    def scores(run: "RunRow", params: Sequence[float], fidelity: Ref) -> Iterator[TransferRow]:
        try:
            yield from transfer(run.id, run.spec, params, TransferTargets(fidelities=[fidelity]))
        except MisfitError as error:
            misfits.add(run.spec)
            say(f"Left out: {error}")

    while unconfirmed := [pair for pair in _unconfirmed(_board_of(suite, db)) if pair[0] not in misfits]:
        with Store(db, create=False) as store:
            runs = [(store.run(spec.key()), fidelity) for spec, fidelity in unconfirmed]
            chosen = [(run, solution_of(store, run), fidelity) for run, fidelity in runs]
        rows = (row for each in chosen for row in scores(*each))
        with Steps(len(chosen)) as steps:
            for row in save_each(db, TRANSFER, rows, stored):
                steps.end(f"{row.title} at {Ref.parse(row.fidelity).name}: {row.result}")


def _unconfirmed(board: "Leaderboard") -> "list[tuple[RunSpec, Ref]]":
    """The best runs of the board's rows and methods without a finer score, each with where to evaluate it next."""
    from zoobench.accuracy.ladder import next_finer
    from zoobench.report.leaderboard import best_of_rows

    found = []
    for row in best_of_rows(board.rows, by_method=True):
        tried = None if row.finer is None else row.finer.fidelity
        is_open = row.finer is None or row.finer.score is None
        if is_open and (fidelity := next_finer(row.spec.fidelity, tried)):
            found.append((row.spec, fidelity))
    return found


@leaderboard.command("publish")
def publish(
    suite: SuiteArgument,
    folder: Annotated[Path, Argument(help="Folder of the leaderboards.")] = FOLDER,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write the leaderboard of a suite into a folder.

    An existing leaderboard is updated: runs that only its earlier export has are kept. The .json file is the export of
    all results. The .csv and .md pages are generated from it.
    """
    from zoobench.accuracy.tolerance import orders
    from zoobench.report import leaderboard_files

    written = leaderboard_files.publish(_board_of(suite, db), folder, orders)
    if count := written.left_out:
        runs = "1 run" if count == 1 else f"{count:,} runs"
        say(f"Left out: {runs} of the earlier export, no longer part of the suite")
    for path in written.paths:
        say(f"Written: {path}")
    _note_report(folder)


@leaderboard.command("check")
def check(folder: Annotated[Path, Argument(help="Folder of the leaderboards.")] = FOLDER) -> None:
    """Check that the pages match their exports.

    Every page is generated again from its export and compared byte for byte; of index.html only the source is compared.
    The first differing line of each file is printed. Exit code 1 if a file differs.
    """
    from zoobench.accuracy.tolerance import orders
    from zoobench.report.leaderboard_files import differences, exports_of

    found = differences(folder, orders)
    for difference in found:
        say(difference)
    if found:
        raise Exit(1)
    say(f"All pages match their exports: {', '.join(path.stem for path in exports_of(folder))}")


@leaderboard.command("rebuild")
def rebuild(folder: Annotated[Path, Argument(help="Folder of the leaderboards.")] = FOLDER) -> None:
    """Generate the pages again from their exports.

    Use it after an update of zoobench that changes the pages. No result changes.
    """
    from zoobench.accuracy.tolerance import orders
    from zoobench.report import leaderboard_files

    written = leaderboard_files.rebuild(folder, orders)
    for path in written:
        say(f"Written: {path}")
    if not written:
        say("All pages match their exports; nothing was written.")
    _note_report(folder)


def _note_report(folder: Path) -> None:
    """Say how the report of a folder is made anew, where it has one of other results."""
    from zoobench.report.leaderboard_files import INDEX, index_command, is_behind

    if is_behind(folder):
        say(f"{folder / INDEX} shows earlier results. To update it: {index_command(folder)}")


def _board_of(suite: str, db: str) -> "Leaderboard":
    """The results that a database has of a suite.

    Raises:
        UsageError: there is no such suite, or it is for smoke runs only.
        StorageError: the database cannot be read.
    """
    from zoobench.db.store import Store
    from zoobench.harness import suites
    from zoobench.harness.grid import Skip
    from zoobench.report.leaderboard import gather

    found = suites.load(suite)
    asked = [(cell.spec, cell.reason) if isinstance(cell, Skip) else (cell, None) for cell in found.cells]
    with Store(db, create=False) as store:
        return gather(store, found.name, found.source, found.summary, asked)
