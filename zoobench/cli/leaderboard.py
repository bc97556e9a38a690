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
    Argument(help="A suite: its name (`zoobench list suites`) or a .yaml.", autocompletion=completion.suites),
]

leaderboard = App(no_args_is_help=True, help="Show, publish and check the results of whole suites.")


@leaderboard.command("show")
def show(suite: SuiteArgument, db: DatabaseOption = DEFAULT_DATABASE, form: FormatOption = Format.TABLE) -> None:
    """Print the tables of a suite, with its missing runs."""
    from zoobench.report.footer import footer
    from zoobench.report.leaderboard_pages import tables_of, without_empty_rows

    board = _board_of(suite, db)
    every = tables_of(board)
    tables = without_empty_rows(every)
    command = ["zoobench", "leaderboard", "show", suite, "--format", str(form)]
    origins = board.attempts(run for table in tables for run in table.runs)
    print_tables(tables, footer(tables, origins, command), form, TableStyle())
    left_out = sum(len(table.rows) for table in every) - sum(len(table.rows) for table in tables)
    say(f"{len(board.missing()):,} runs of the suite are missing; {left_out:,} rows without any run are not shown.")


@leaderboard.command("confirm")
def confirm(
    suite: SuiteArgument,
    db: DatabaseOption = DEFAULT_DATABASE,
    folder: Annotated[
        Path | None,
        Option("--from", help="Lengthen the best solutions of this folder's export instead, and write its pages anew."),
    ] = None,
) -> None:
    """Evaluate the best solutions two fidelities finer, and over three times their frames.

    An episode of each for every row and method; the scores are stored, and a publication tells in which rows the order
    of the methods stands on the finer grid, and which gaits last. What diverges is done again with 27 particles per
    cell, what has a score there is not. Bodies whose parameters belong to a grid, those of `particle`, have none on a
    finer one. A suite's export holds the best solution of a row alone, and tells nothing of finer grids.
    """
    if folder is not None:
        _lengthen_published(suite, folder)
        return
    _refine(suite, db)
    _lengthen(suite, db)
    say("Everything was evaluated; `zoobench leaderboard publish` tells what stands and what lasts.")


def _lengthen(suite: str, db: str) -> None:
    """Simulate the best solutions of a suite's rows and methods over more frames, as far as that was not done."""
    from zoobench.db.rows import LASTING
    from zoobench.db.store import Store
    from zoobench.harness.starts import look_in, solution_of
    from zoobench.report.lasting import TIMES
    from zoobench.report.leaderboard import best_of_rows
    from zoobench.verify.lasting_study import LastingRow, lasting, stored

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
    from zoobench.report import leaderboard_files
    from zoobench.report.lasting import TIMES, Lasting
    from zoobench.verify.lasting_study import lasting

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
            leaderboard_files.write(board, folder)
            steps.end(f"{where} over {found.frames} frames: {found.result}")
    _note_report(folder)


def _refine(suite: str, db: str) -> None:
    """Evaluate the best solutions of a suite's rows and methods on finer grids, as far as that was not done."""
    from zoobench.db.rows import TRANSFER
    from zoobench.db.store import Store
    from zoobench.harness.starts import solution_of
    from zoobench.spec import Ref
    from zoobench.verify.transfer_study import MisfitError, TransferRow, TransferTargets, stored, transfer

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
    from zoobench.report.leaderboard import best_of_rows
    from zoobench.verify.accuracy.plan import next_finer

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
    folder: Annotated[Path, Argument(help="The folder of the leaderboards.")] = FOLDER,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write the leaderboard of a suite into a folder.

    Or add to the one that is there. The .json is the export of all results; the pages .csv and .md are made from it
    alone. Runs that only an earlier export has stay.
    """
    from zoobench.report import leaderboard_files

    written = leaderboard_files.publish(_board_of(suite, db), folder)
    if count := written.left_out:
        runs = "1 run" if count == 1 else f"{count:,} runs"
        say(f"Left out: {runs} of the earlier export, which the suite does not ask for any more")
    for path in written.paths:
        say(f"Written: {path}")
    _note_report(folder)


@leaderboard.command("check")
def check(folder: Annotated[Path, Argument(help="The folder of the leaderboards.")] = FOLDER) -> None:
    """Compare pages with their exports.

    Every page is rebuilt from its export and compared byte for byte; of index.html only where it comes from. Exit
    code 1 if something differs; the first differing line of every file is printed.
    """
    from zoobench.report.leaderboard_files import differences, exports_of

    found = differences(folder)
    for difference in found:
        say(difference)
    if found:
        raise Exit(1)
    say(f"Every page is what its export makes of it: {', '.join(path.stem for path in exports_of(folder))}")


@leaderboard.command("rebuild")
def rebuild(folder: Annotated[Path, Argument(help="The folder of the leaderboards.")] = FOLDER) -> None:
    """Write pages anew from their exports.

    For pages of an earlier zoobench, which wrote them in another form; no result changes.
    """
    from zoobench.report import leaderboard_files

    written = leaderboard_files.rebuild(folder)
    for path in written:
        say(f"Written: {path}")
    if not written:
        say("Every page is what its export makes of it; nothing was written.")
    _note_report(folder)


def _note_report(folder: Path) -> None:
    """Say how the report of a folder is made anew, where it has one of other results."""
    from zoobench.report.leaderboard_files import INDEX, index_command, is_behind

    if is_behind(folder):
        say(f"{folder / INDEX} shows earlier results. To write it anew: {index_command(folder)}")


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
