"""`zoobench results`, `table` and `logs`: what the database holds of finished and unfinished runs."""

import math
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from zoobench.cli.curves import Currency
from zoobench.cli.options import (
    DEFAULT_DATABASE,
    ChosenDesignOption,
    ChosenEnvOption,
    ChosenFidelityOption,
    ChosenMethodOption,
    ChosenTaskOption,
    DatabaseOption,
    FormatOption,
)
from zoobench.cli.output import Format, emit, say
from zoobench.errors import UsageError
from zoobench.spec import RunSelection

if TYPE_CHECKING:
    from zoobench.db.store import Store
    from zoobench.report.footer import Footer
    from zoobench.report.run_results import RunResult
    from zoobench.report.tables import Table


def results(
    env: ChosenEnvOption = "",
    task: ChosenTaskOption = "",
    design: ChosenDesignOption = "",
    method: ChosenMethodOption = "",
    fidelity: ChosenFidelityOption = "",
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Print one row per run.

    The table gives the score; csv, json and md give every final value and all settings.
    """
    from zoobench.db.store import Store
    from zoobench.report.run_results import choose_results
    from zoobench.report.views import results_listing, results_overview, results_records

    with Store(db, create=False) as store:
        found = choose_results(store, RunSelection(env, task, design, "", method, fidelity))
    listing = results_overview(found) if form is Format.TABLE else results_listing(found)
    emit(listing, form, records=results_records(found))
    if any(result.is_smoke for result in found):
        say("Runs of fidelity smoke test the machinery: their numbers mean nothing and no table shows them.")


def table(
    env: ChosenEnvOption = "",
    task: ChosenTaskOption = "",
    design: ChosenDesignOption = "",
    method: ChosenMethodOption = "",
    fidelity: ChosenFidelityOption = "",
    normalised: Annotated[
        bool, Option("--normalised", help="Also place each score between doing nothing (0) and the row's best (1).")
    ] = False,
    suite: Annotated[
        str,
        Option("--suite", help="Only the runs of a suite (`zoobench list suites`, or a .yaml), and what is missing."),
    ] = "",
    publish: Annotated[
        Path | None, Option("--publish", help="Write the suite's leaderboard (.json, .csv, .md) into this folder.")
    ] = None,
    check: Annotated[
        bool, Option("--check", help="Instead, compare published pages with what their exports make of them.")
    ] = False,
    folder: Annotated[
        Path | None, Argument(help="With --check: where the leaderboards are.", show_default="leaderboards")
    ] = None,
    transfer: Annotated[
        bool, Option("--transfer", help="Instead, what `zoobench evaluate` found of solutions in other environments.")
    ] = False,
    by: Annotated[
        Currency | None, Option("--by", help="Instead, scores when all runs of a row had spent the same of this.")
    ] = None,
    at: Annotated[
        float | None, Option("--at", help="With --by: how much; the most that all have reached if not given.")
    ] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Compare the methods, with 95 % intervals.

    Mean score over the seeds with its Student-t interval, a column per method, a table per fidelity, budget and
    episode length, and below it where the numbers come from; with --by, runs of all budgets stand in one, each with
    its best score at an equal amount spent. Smoke runs are left out. A normalised score is 0 where a
    method is no better than a robot at rest or the mean random controller, and 1 for the best mean of the row.
    """
    from zoobench.db.store import Store
    from zoobench.report.footer import footer
    from zoobench.report.run_results import choose_results, origins
    from zoobench.report.tables import score_tables

    choice = RunSelection(env, task, design, "", method, fidelity)
    flags = [*(["--normalised"] if normalised else []), *_spending_flags(by, at)]
    if suite or publish or check or folder:
        narrowed = [*choice.options(), *flags, *(["--transfer"] if transfer else [])]
        _leaderboard(suite, publish, check, folder, narrowed, db, form)
        return
    if transfer:
        _print_transfer(db, form, [*choice.options(), *flags])
        return
    with Store(db, create=False) as store:
        counted = [result for result in choose_results(store, choice) if not result.is_smoke]
        tables = score_tables(counted) if by is None else _spending_tables(store, counted, by, at)
        command = ["zoobench", "table", *choice.options(), *flags, "--format", str(form)]
        foot = footer(tables, origins(store, counted), command)
    _print_tables(tables, foot, form, normalised)
    if not tables:
        say("No run to compare yet. `zoobench run --env desert --task turning` makes some.")


def logs(
    run: Annotated[str, Argument(help="A run, by its number or the start of its key.")],
    attempt: Annotated[int | None, Option("--attempt", help="One attempt only.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Print what a run said, and its traceback."""
    from zoobench.db.store import Store

    with Store(db, create=False) as store:
        found = store.run(run)
        lines = store.logs(found.id, attempt=attempt)
        attempts = [item for item in store.attempts(found.id) if attempt in (None, item.number)]
    if attempt is not None and not attempts:
        raise UsageError(f"Run {found.id} has no attempt {attempt}. `zoobench show {found.id}` lists its attempts.")
    for item in attempts:
        say(f"attempt {item.number} of run {found.id}: {item.outcome}{f', {item.reason}' if item.reason else ''}")
        for line in lines:
            if line.attempt == item.number:
                print(f"{datetime.fromtimestamp(line.at):%H:%M:%S}  {line.text}")
        if item.traceback:
            print(item.traceback.rstrip())
    if not lines and not any(item.traceback for item in attempts):
        say(f"Run {found.id} is {found.state} and has said nothing.")


def _leaderboard(
    suite: str, folder: Path | None, check: bool, checked: Path | None, others: list[str], db: str, form: Format
) -> None:
    """Publish, check, or print a suite's leaderboard."""
    from zoobench.cli import leaderboard
    from zoobench.report.footer import footer
    from zoobench.report.leaderboard_pages import FOLDER, tables_of, without_empty_rows

    if others:
        raise UsageError(f"A leaderboard is that of a whole suite. Leave {' '.join(others)} out.")
    if check and (suite or folder):
        raise UsageError("--check compares what is published. Leave --suite and --publish out.")
    if check:
        leaderboard.check(checked or Path(FOLDER))
        return
    if checked is not None or not suite:
        raise UsageError("A folder goes with --check, and --publish with --suite NAME.")
    board = leaderboard.board_of(suite, db)
    if folder is not None:
        leaderboard.publish(board, folder)
        return
    every = tables_of(board)
    tables = without_empty_rows(every)
    command = ["zoobench", "table", "--suite", suite, "--format", str(form)]
    _print_tables(tables, footer(tables, board.attempts, command), form, normalised=False)
    left_out = sum(len(table.rows) for table in every) - sum(len(table.rows) for table in tables)
    say(f"{len(board.missing()):,} runs of the suite are missing; {left_out:,} rows without any run are not shown.")


def _spending_flags(by: Currency | None, at: float | None) -> list[str]:
    """--by and --at as they are typed.

    Raises:
        UsageError: an amount of nothing.
    """
    if at is not None and (by is None or not 0.0 < at < math.inf):
        raise UsageError(f"--at {at:g} is no amount spent. Give a positive number, and with --by of what.")
    return [*(["--by", by.value] if by else []), *(["--at", f"{at:.10g}"] if at is not None else [])]


def _spending_tables(store: "Store", results: "list[RunResult]", by: Currency, at: float | None) -> "list[Table]":
    from zoobench.report.learning_curves import curves, spending_tables

    return spending_tables(results, curves(store, results, by.value), by.value, at)


def _print_transfer(db: str, form: Format, others: list[str]) -> None:
    """The transfer matrix of all that was evaluated."""
    from zoobench.db.store import Store
    from zoobench.report.transfer_table import transfer_matrix
    from zoobench.verify.transfer_study import STUDY

    if others:
        raise UsageError(f"--transfer shows all that was evaluated. Leave {' '.join(others)} out.")
    with Store(db, create=False) as store:
        documents = [row.document for study in store.studies(STUDY) for row in study.rows]
        specs = {run.id: run.spec for run in store.runs(ids={document["run"] for document in documents})}
    found = transfer_matrix(
        {**document, "controller": str(spec.controller), "budget": str(spec.budget)}
        for document in documents
        for spec in [specs[document["run"]]]
    )
    emit(found, form)
    if not found.rows:
        say("Nothing was evaluated elsewhere yet. `zoobench evaluate RUN --env '*'` does.")
    elif form in (Format.TABLE, Format.MD):
        say("cells: mean over runs ± half of the 95 % Student-t interval; bold or *: where the solutions were found")


def _print_tables(tables: "list[Table]", foot: "Footer", form: Format, normalised: bool) -> None:
    from dataclasses import asdict

    from zoobench.report.listing import to_json
    from zoobench.report.tables import long_listing, table_listing

    if form is Format.JSON:
        print(to_json({"cells": long_listing(tables).records(), "provenance": asdict(foot)}))
    elif form is Format.CSV:
        emit(long_listing(tables), form)
        for line in foot.lines():
            say(line)
    else:
        mark = "### " if form is Format.MD else ""
        for item in tables:
            print(f"{mark}Score: {item.title}\n")
            emit(table_listing(item, normalised), form)
            print()
        for line in foot.lines() if tables else ():
            print(f"- {line}" if form is Format.MD else line)
