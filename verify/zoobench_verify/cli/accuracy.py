"""`zoobench verify accuracy`: errors of gaits' scores at each fidelity against the finest, and costs."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Exit, Option

from zoobench.cli.app import App
from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    EnvOption,
    FormatOption,
    TaskOption,
    WorkersOption,
    command_text,
    component_option,
    parse_names,
    takes,
)
from zoobench.cli.output import Format, choose, emit_several, say
from zoobench.cli.plan import known_runs
from zoobench.cli.steps import Steps
from zoobench.cli.studies import save_each
from zoobench.errors import UsageError
from zoobench.report.listing import Listing, listing_of

if TYPE_CHECKING:
    from zoobench.accuracy.levels import LevelRow
    from zoobench.spec import Ref, RunSpec
    from zoobench_verify.accuracy.analytic import AnalyticRow
    from zoobench_verify.accuracy.plan import StudyPlan
    from zoobench_verify.accuracy.records import Measurements

EXACT_STUDY = "accuracy-exact"

accuracy = App(no_args_is_help=True, help="Measure the error and cost of fidelities.")


@accuracy.callback()
def _group() -> None:
    """Measure the error and cost of fidelities."""


def _plan(
    levels: Annotated[str, Option("--levels", help="Fidelities at which gaits are evaluated, separated by commas.")] = (
        "draft,standard,paper,fine"
    ),
    found: Annotated[str, Option("--train-at", help="Fidelities at which gaits are trained.")] = "draft,standard",
    seeds: Annotated[int, Option("--seeds", help="Training seeds per cell.")] = 2,
    iterations: Annotated[int, Option("--iterations", help="Optimiser iterations per training run.")] = 32,
    stages: Annotated[
        int,
        Option(
            "--stages", help="Gaits per training run: the final one, the best after half of the iterations, and so on."
        ),
    ] = 4,
    gradients: Annotated[
        str, Option("--gradients", help="Finest fidelity at which gradients are compared; empty: none.")
    ] = "paper",
    around: Annotated[
        str, Option("--vary-at", help="Fidelity whose numerical settings are varied one at a time; empty: none.")
    ] = "",
    draws: Annotated[int, Option("--draws", help="Number of random controllers, evaluated for comparison.")] = 0,
    frames: Annotated[int, Option("--frames", help="Episode length in control frames.")] = 100,
    beyond: Annotated[
        str, Option("--verify-at", help="Finer fidelity at which the finest of --levels is verified; empty: none.")
    ] = "",
    quick: Annotated[
        bool, Option("--quick", help="Use two fidelities and a few frames, to check that the study works.")
    ] = False,
) -> "StudyPlan":
    """The settings of the study."""
    from zoobench_verify.accuracy.plan import QUICK, StudyPlan

    at, home = (tuple(parse_names(text)) for text in (levels, found))
    return QUICK if quick else StudyPlan(at, home, seeds, iterations, stages, frames, gradients, around, draws, beyond)


@accuracy.command("run")
@takes(_plan)
def run(
    plan: "StudyPlan",
    env: EnvOption = "*",
    task: TaskOption = "movement-speed,turning",
    design: Annotated[
        str, component_option("designs", "--design", "Designs. Default: the animals of each environment.")
    ] = "",
    energy: Annotated[
        str, Option("--energy", help="Fidelities whose energy balance is computed; empty: none.")
    ] = "draft",
    dry: Annotated[bool, Option("--dry-run", help="Estimate the time and start nothing.")] = False,
    jobs: WorkersOption = 2,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Run the simulations that the accuracy study still needs.

    Gaits are trained by gradient at the fidelities of --train-at. Gaits from several stages of each training run are
    evaluated at every fidelity, at the finest also with a second transfer scheme. The energy balance of a short episode
    is computed substep by substep. After an interruption, the same command resumes the study.
    """
    from zoobench import registry
    from zoobench.harness.grid import parse_selector
    from zoobench.registry import Kind
    from zoobench.spec import Ref
    from zoobench_verify.accuracy.plan import draws, evaluations, trainings

    designs = parse_selector(design, Kind.DESIGN) if design else None
    axes = parse_selector(env, Kind.ENV), parse_selector(task, Kind.TASK), plan, designs
    trained = trainings(*axes)
    others = [*evaluations(trained, plan), *draws(*axes)]
    followed = [registry.resolve(Kind.FIDELITY, Ref.parse(level)) for level in parse_names(energy)] if energy else []
    _tell_cost([*trained, *others], db, jobs)
    if dry:
        return
    done = _run(trained, db, jobs)
    _run([*evaluations(done, plan), *draws(*axes)], db, jobs)
    _follow_energy(trained, followed, db)
    say(f"Next: {command_text('verify', 'accuracy', 'show', *([] if env == '*' else ['--env', env]), db=db)}")


@accuracy.command("show")
def show(
    env: EnvOption = "*",
    task: TaskOption = "*",
    table: Annotated[
        str, Option("--table", help="Table to print: short, levels, matrix, knobs, random, energy or all.")
    ] = "all",
    source: Annotated[
        Path | None, Option("--from", help="Read a file written by --export instead of the database.")
    ] = None,
    published: Annotated[
        bool, Option("--published", help="Show the results that come with zoobench and that --tolerance uses.")
    ] = False,
    export: Annotated[Path | None, Option("--export", help="Write the measurements to this file.")] = None,
    publish: Annotated[
        Path | None, Option("--publish", help="Write the rows that --tolerance and --decide use to this file.")
    ] = None,
    plots: Annotated[Path | None, Option("--plots", help="Draw scores and energy balances into this folder.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Show score errors, rankings, costs and energy balances.

    Scores are compared with those at the finest fidelity. Costs are CPU seconds per simulated second. Nothing is
    simulated. `--published` shows the study that comes with zoobench.
    """
    from zoobench.accuracy.tolerance import known_levels
    from zoobench.harness import presets
    from zoobench.harness.grid import parse_selector
    from zoobench.registry import Kind
    from zoobench_verify.accuracy.accuracy_plots import draw, draw_energy
    from zoobench_verify.accuracy.accuracy_tables import TABLES
    from zoobench_verify.accuracy.analyse import analyse
    from zoobench_verify.accuracy.energy_rows import energies
    from zoobench_verify.accuracy.publishing import write_levels
    from zoobench_verify.accuracy.records import Measurements, read, write

    wanted = choose(table, tuple(TABLES), form)
    places = parse_selector(env, Kind.ENV)
    envs = [ref.name for ref in places]
    tasks = [ref.name for ref in parse_selector(task, Kind.TASK)]
    if published and (source or export or publish):
        raise UsageError("--published has no single measurements. Leave out --from, --export and --publish.")
    measured = Measurements(()) if published else _stored(db) if source is None else read(source)
    analysis = analyse(measured, envs, tasks)
    if published:
        analysis = replace(analysis, levels=known_levels(places, tasks))
    balances = list(energies(measured, envs))
    if export is not None:
        write(measured, export)
    if publish is not None:
        write_levels(measured, publish)
    if plots is not None:
        say(f"drawn: {draw(analysis.levels, plots)}")
        if balances:
            say(f"drawn: {draw_energy(balances, plots, level=presets.get(presets.DEFAULT).fidelity.name)}")
    listings = {}
    for name in wanted:
        kind, text, rows_of = TABLES[name]
        rows: Sequence[Any] = balances if rows_of is None else rows_of(analysis)
        if form in (Format.CSV, Format.JSON):
            listings[name] = listing_of(kind, rows)
        elif rows or name == table:
            columns, cells = text(rows)
            listings[name] = Listing(columns, tuple(cells))
    emit_several(listings, form)


@accuracy.command("exact")
def exact(
    quick: Annotated[bool, Option("--quick", help="Use two grids per case.")] = False,
    only_read: Annotated[bool, Option("--stored", help="Simulate nothing; show the results in the database.")] = False,
    plots: Annotated[Path | None, Option("--plots", help="Draw error against time into this folder.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Measure the order of accuracy against exact solutions.

    Gives errors and times of the cases of `validate` with a closed form on successively finer grids, and the observed
    and the theoretical order of accuracy. Exit code 1 if an observed order is too low.
    """
    from zoobench_verify.accuracy.analytic import AnalyticRow, AnalyticSummary, figure, summarise
    from zoobench_verify.comparison_figure import draw

    rows = _stored_rows(db) if only_read else list(_measure_rows(db, levels=2 if quick else None))
    summaries = summarise(rows)
    if plots is not None:
        draw(figure(rows), plots / "accuracy-exact.png")
        say(f"drawn: {plots / 'accuracy-exact.png'}")
    emit_several({"rows": listing_of(AnalyticRow, rows), "orders": listing_of(AnalyticSummary, summaries)}, form)
    if any(summary.verdict == "missed" for summary in summaries):
        raise Exit(1)


def _tell_cost(wanted: "list[RunSpec]", db: str, jobs: int) -> None:
    """Print how long the runs that are not done will take."""
    from zoobench.accuracy.rates import origin
    from zoobench.db.rows import RunState
    from zoobench.report.estimate import basis_text, total_seconds
    from zoobench.report.views import duration

    states, estimator = known_runs(db, wanted, _level_rate)
    estimates = [estimator(spec) for spec in wanted if states.get(spec.key()) is not RunState.DONE]
    total = duration(total_seconds([each and each.seconds for each in estimates], jobs))
    say(f"{len(estimates)} runs to do of {len(wanted)}; estimated time with {jobs} in parallel: {total}")
    if estimates:
        say(f"Estimated: {basis_text(estimator, estimates, origin())}")


def _level_rate(env: "Ref", fidelity: "Ref") -> "LevelRow | None":
    """The measured rate of an environment, a turned knob counting as its level."""
    from zoobench import registry
    from zoobench.accuracy.rates import rate
    from zoobench.registry import Kind
    from zoobench.spec import Ref

    return rate(env, registry.resolve(Kind.FIDELITY, Ref(fidelity.name)))


def _run(wanted: "list[RunSpec]", db: str, jobs: int) -> "list[RunSpec]":
    """Execute the missing ones of these runs; returns those that are done then."""
    from zoobench.cli.progress import carry_out
    from zoobench.db.rows import RunState
    from zoobench.db.store import Store

    with Store(db) as store:
        report = store.enqueue(wanted)
    say(f"{len(report.new)} new, {len(report.existing_done)} done already")
    _, estimate = known_runs(db, wanted, _level_rate)
    with Store(db) as store:
        weights = {row.id: found.seconds for row in store.runs(ids=report.open) if (found := estimate(row.spec))}
    for row in carry_out(db, sorted(report.open), jobs=jobs, weights=weights):
        if row.reason:
            say(f"  run {row.id} {row.state}: {row.reason}")
    with Store(db) as store:
        states = store.states([spec.key() for spec in wanted])
    return [spec for spec in wanted if states.get(spec.key()) is RunState.DONE]


def _follow_energy(trained: "list[RunSpec]", fidelities: "list[Ref]", db: str) -> None:
    """Follow the energy of random controllers where that is not done yet, and store it."""
    from zoobench import registry
    from zoobench.db.store import Store
    from zoobench.registry import Kind
    from zoobench_verify.accuracy.energy_audit import balances
    from zoobench_verify.accuracy.plan import STRONG
    from zoobench_verify.accuracy.records import ENERGY_STUDY, from_reader, stored

    with Store(db) as store:
        known = {(balance.env, balance.fidelity) for balance in from_reader(store).balances}
    controller = registry.resolve(Kind.CONTROLLER, STRONG)
    cells = {(spec.env, fidelity): replace(spec, fidelity=fidelity, controller=controller)
             for spec in reversed(trained) for fidelity in fidelities}  # fmt: skip
    rest = [spec for place, spec in cells.items() if place not in known]
    with Steps(len(rest)) as steps:

        def tell(case: str) -> None:
            steps.begin(f"energy balance of {case}")
            say(f"computing the energy balance of {case}")

        for row in save_each(db, ENERGY_STUDY, balances(rest, on_case=tell), stored):
            steps.end(f"energy balance of {row.env} at {row.fidelity}: computed")


def _stored(db: str) -> "Measurements":
    """The measurements in a database.

    Raises:
        UsageError: there are none.
    """
    from zoobench.db.store import Store
    from zoobench_verify.accuracy.records import from_reader

    with Store(db, create=False) as store:
        measured = from_reader(store)
    if not measured.samples:
        raise UsageError(f"{store.name} holds no run of the accuracy study. Use `zoobench verify accuracy run` first.")
    return measured


def _measure_rows(db: str, levels: int | None) -> "Iterator[AnalyticRow]":
    from zoobench.db.rows import StudyRow
    from zoobench_verify.accuracy.analytic import analytic, case_names

    def stored(row: "AnalyticRow") -> StudyRow:
        return StudyRow(f"{row.case} {row.cells} {row.quantity}", "measured", asdict(row))

    names = case_names()
    with Steps(len(names)) as steps:

        def each() -> "Iterator[AnalyticRow]":
            for name in names:
                steps.begin(name)
                yield from analytic([name], levels=levels)
                steps.end(name)

        for row in save_each(db, EXACT_STUDY, each(), stored):
            say(f"  {row.cells} cells: {row.quantity} error {row.error:.2g}, {row.slowdown:.2g} s per simulated second")
            yield row


def _stored_rows(db: str) -> "list[AnalyticRow]":
    from zoobench.db.store import Store
    from zoobench_verify.accuracy.analytic import AnalyticRow

    with Store(db, create=False) as store:
        study = store.study(EXACT_STUDY)
    if study is None:
        raise UsageError(f"{store.name} holds no errors against exact solutions. Leave --stored out to measure them.")
    documents = [{**row.document, "settings": tuple(map(tuple, row.document["settings"]))} for row in study.rows]
    return [AnalyticRow(**document) for document in documents]
