"""`zoobench accuracy`: error of each fidelity to a converged simulation, and its cost."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Exit, Option, Typer

from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    EnvOption,
    FormatOption,
    TaskOption,
    WorkersOption,
    command_text,
    parse_counts,
    parse_names,
)
from zoobench.cli.output import Format, choose, emit_several, listing_of, say
from zoobench.cli.studies import save_each
from zoobench.errors import UsageError
from zoobench.report.listing import Listing

if TYPE_CHECKING:
    from zoobench.spec import RunSpec
    from zoobench.verify.accuracy.analyse import Analysis
    from zoobench.verify.accuracy.analytic import AnalyticRow
    from zoobench.verify.accuracy.plan import StudyPlan
    from zoobench.verify.accuracy.records import Measurements
    from zoobench.verify.accuracy.verdicts import EnergyRow

EXACT_STUDY = "accuracy-exact"

accuracy = Typer(no_args_is_help=True, help="Measure the error and cost of fidelities.")


@accuracy.callback()
def _group() -> None:
    """Measure the error and cost of fidelities."""


@accuracy.command("run")
def run(
    env: EnvOption = "*",
    task: Annotated[str, Option("--task", help="Tasks, likewise; gradients are those of the first.")] = (
        "movement-speed,turning"
    ),
    levels: Annotated[str, Option("--levels", help="From coarse to fine, with commas.")] = "draft,standard,paper",
    draws: Annotated[str, Option("--draws", help="Controllers at every level: one number, or one each.")] = "12",
    around: Annotated[str, Option("--around", help="Level at which knobs are turned; empty: none.")] = "draft",
    close: Annotated[
        int, Option("--close", min=0, help="Controllers whose trajectory, shape and gradient are recorded.")
    ] = 2,
    frames: Annotated[int, Option("--frames", min=1, help="Length of an episode in control frames.")] = 100,
    quick: Annotated[bool, Option("--quick", help="Two levels and a few frames, as a check.")] = False,
    repeats: Annotated[int, Option("--repeats", min=0, help="Timings of each simulation in turn; 0: none.")] = 3,
    jobs: WorkersOption = 2,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Carry out what is not done yet of the study.

    The same random controllers are simulated at every level, and at one of them with each knob turned alone: a
    parameter of the fidelity, such as the time step or the transfer. Then the energy of a short episode is followed
    through every substep, and each simulation is timed alone. Interrupted, it goes on where it stopped when the same
    command is typed again.
    """
    from zoobench.harness.grid import parse_selector
    from zoobench.registry import Kind
    from zoobench.verify.accuracy.plan import QUICK, specs

    plan = QUICK if quick else _plan(levels, draws, around, close, frames)
    wanted = specs(parse_selector(env, Kind.ENV), parse_selector(task, Kind.TASK), plan)
    _run(wanted, db, jobs)
    _keep_rest(wanted, db, repeats)
    say(f"Next: {command_text('accuracy', 'show', *([] if env == '*' else ['--env', env]), db=db)}")


@accuracy.command("show")
def show(
    env: EnvOption = "*",
    task: TaskOption = "*",
    table: Annotated[str, Option("--table", help="references, levels, steps, knobs, choices, energy or all.")] = "all",
    source: Annotated[Path | None, Option("--from", help="A file of --export instead of the database.")] = None,
    export: Annotated[Path | None, Option("--export", help="Write the measurements to this file.")] = None,
    publish: Annotated[
        Path | None, Option("--publish", help="Write the levels' errors and costs, by which --tolerance chooses.")
    ] = None,
    plots: Annotated[Path | None, Option("--plots", help="Draw a plot of every environment into this folder.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Show errors, costs and losses of energy.

    Scores, trajectories, shapes and gradients are compared with the limit of the finest levels; costs are wall times
    per simulated second. Nothing is simulated.
    """
    from zoobench.harness import presets
    from zoobench.harness.grid import parse_selector
    from zoobench.registry import Kind
    from zoobench.verify.accuracy import tolerance
    from zoobench.verify.accuracy.accuracy_plots import draw, draw_energy
    from zoobench.verify.accuracy.accuracy_tables import TABLES
    from zoobench.verify.accuracy.analyse import analyse
    from zoobench.verify.accuracy.records import read, write
    from zoobench.verify.accuracy.verdicts import energies

    wanted = choose(table, tuple(TABLES), form)
    envs = [ref.name for ref in parse_selector(env, Kind.ENV)]
    tasks = [ref.name for ref in parse_selector(task, Kind.TASK)]
    measured = _stored(db) if source is None else read(source)
    analysis = analyse(measured, envs, tasks)
    energy = list(energies(measured, envs))
    if export is not None:
        write(measured, export)
    if publish is not None:
        tolerance.publish(measured, publish)
    if plots is not None:
        if energy:
            say(f"drawn: {draw_energy(energy, plots)}")
        for path in draw(analysis, plots, default=presets.get(presets.DEFAULT).fidelity.name):
            say(f"drawn: {path}")
    _print(analysis, energy, wanted, form)


@accuracy.command("exact")
def exact(
    quick: Annotated[bool, Option("--quick", help="Two grids of each case.")] = False,
    only_read: Annotated[bool, Option("--stored", help="Simulate nothing: judge what the database holds.")] = False,
    plots: Annotated[Path | None, Option("--plots", help="Draw error against time into this folder.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Compare with exact answers on finer and finer grids.

    Errors and times of cases of `validate` that have a closed form, and the observed order of accuracy beside that of
    the theory. Exit code 1 if an order is missed.
    """
    from zoobench.verify.accuracy.analytic import AnalyticRow, AnalyticSummary, figure, summarise
    from zoobench.verify.comparison_figure import draw

    rows = _stored_rows(db) if only_read else list(_measure_rows(db, levels=2 if quick else None))
    summaries = summarise(rows)
    if plots is not None:
        draw(figure(rows), plots / "accuracy-exact.png")
        say(f"drawn: {plots / 'accuracy-exact.png'}")
    emit_several({"rows": listing_of(AnalyticRow, rows), "orders": listing_of(AnalyticSummary, summaries)}, form)
    if any(summary.verdict == "missed" for summary in summaries):
        raise Exit(1)


def _plan(levels: str, draws: str, around: str, close: int, frames: int) -> "StudyPlan":
    from zoobench.verify.accuracy.plan import StudyPlan

    names, counts = tuple(parse_names(levels)), tuple(parse_counts(draws, "numbers of draws"))
    draws_of = counts * len(names) if len(counts) == 1 else counts
    return StudyPlan(levels=names, around=around, draws=draws_of, close=close, frames=frames)


def _run(wanted: "list[RunSpec]", db: str, jobs: int) -> None:
    from zoobench.cli.progress import carry_out
    from zoobench.db.store import Store

    with Store(db) as store:
        report = store.enqueue(wanted)
    say(f"{len(report.new)} new, {len(report.existing_done)} done already")
    for row in carry_out(db, sorted(report.open), jobs=jobs):
        if row.reason:
            say(f"  run {row.id} {row.state}: {row.reason}")


def _keep_rest(wanted: "list[RunSpec]", db: str, repeats: int) -> None:
    """Follow the energy and measure times where that is not done yet, and store both."""
    from zoobench.db.store import Store
    from zoobench.verify.accuracy.costs import costs
    from zoobench.verify.accuracy.energy_audit import balances
    from zoobench.verify.accuracy.records import COST_STUDY, ENERGY_STUDY, Balance, FidelityCost, from_reader, stored

    def rest(known: Sequence[FidelityCost | Balance]) -> "list[RunSpec]":
        done = {(item.env, item.fidelity) for item in known}
        return [spec for spec in wanted if (spec.env, spec.fidelity) not in done]

    with Store(db) as store:
        known = from_reader(store)
    found = balances(rest(known.balances), on_case=lambda case: say(f"following the energy of {case}"))
    deque(save_each(db, ENERGY_STUDY, found, stored), maxlen=0)
    if repeats:
        timed = costs(rest(known.costs), repeats=repeats, on_case=lambda case: say(f"timing {case}"))
        deque(save_each(db, COST_STUDY, timed, stored), maxlen=0)


def _stored(db: str) -> "Measurements":
    """The measurements in a database.

    Raises:
        UsageError: there are none.
    """
    from zoobench.db.store import Store
    from zoobench.verify.accuracy.records import from_reader

    with Store(db, create=False) as store:
        measured = from_reader(store)
    if not measured.samples:
        raise UsageError(f"{store.name} holds no run of the accuracy study. Use `zoobench accuracy run` first.")
    return measured


def _print(analysis: "Analysis", energy: "list[EnergyRow]", wanted: list[str], form: Format) -> None:
    """Print tables with every field for programs, with a choice of them for people."""
    from zoobench.verify.accuracy.accuracy_tables import TABLES
    from zoobench.verify.accuracy.verdicts import knobs, steps

    turned = list(knobs(analysis))
    found: list[Sequence[Any]]
    found = [analysis.references, analysis.levels, list(steps(analysis)), turned, turned, energy]
    listings = {}
    for name, rows in zip(TABLES, found, strict=True):
        kind, table = TABLES[name]
        if form in (Format.CSV, Format.JSON) and kind is not None:
            listings[name] = listing_of(kind, rows)
        else:
            columns, cells = table(rows)
            listings[name] = Listing(columns, tuple(cells))
    emit_several({name: listings[name] for name in wanted}, form)


def _measure_rows(db: str, levels: int | None) -> "Iterator[AnalyticRow]":
    from zoobench.db.rows import StudyRow
    from zoobench.verify.accuracy.analytic import analytic

    def stored(row: "AnalyticRow") -> StudyRow:
        return StudyRow(f"{row.case} {row.cells} {row.quantity}", "measured", asdict(row))

    for row in save_each(db, EXACT_STUDY, analytic(levels=levels), stored):
        say(f"{row.case}, {row.cells} cells: {row.quantity} off by {row.error:.2g}, {row.slowdown:.2g} s per second")
        yield row


def _stored_rows(db: str) -> "list[AnalyticRow]":
    from zoobench.db.store import Store
    from zoobench.verify.accuracy.analytic import AnalyticRow

    with Store(db, create=False) as store:
        study = store.study(EXACT_STUDY)
    if study is None:
        raise UsageError(f"{store.name} holds no errors against exact answers. Leave --stored out to measure them.")
    documents = [{**row.document, "settings": tuple(map(tuple, row.document["settings"]))} for row in study.rows]
    return [AnalyticRow(**document) for document in documents]
