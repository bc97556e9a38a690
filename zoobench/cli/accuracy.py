"""`zoobench accuracy`: how far trained gaits' scores at each fidelity are from the finest, and what that costs."""

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
    from zoobench.spec import Ref, RunSpec
    from zoobench.verify.accuracy.analyse import LevelRow
    from zoobench.verify.accuracy.analytic import AnalyticRow
    from zoobench.verify.accuracy.plan import StudyPlan
    from zoobench.verify.accuracy.records import Measurements

EXACT_STUDY = "accuracy-exact"

accuracy = App(no_args_is_help=True, help="Measure the error and cost of fidelities.")


@accuracy.callback()
def _group() -> None:
    """Measure the error and cost of fidelities."""


def _plan(
    levels: Annotated[str, Option("--levels", help="Where gaits are evaluated, with commas.")] = (
        "draft,standard,paper,fine"
    ),
    found: Annotated[str, Option("--found", help="Levels at which gaits are trained.")] = "draft,standard",
    seeds: Annotated[int, Option("--seeds", help="Trainings of each.")] = 2,
    iterations: Annotated[int, Option("--iterations", help="Length of a training.")] = 32,
    stages: Annotated[int, Option("--stages", help="Gaits of a training: at its end, after half of it and so on.")] = 4,
    gradients: Annotated[str, Option("--gradients", help="Finest level with gradients; empty: none.")] = "paper",
    around: Annotated[str, Option("--around", help="Level at which knobs are turned; empty: none.")] = "",
    draws: Annotated[int, Option("--draws", help="Random controllers, for comparison.")] = 0,
    frames: Annotated[int, Option("--frames", help="Length of an episode in control frames.")] = 100,
    beyond: Annotated[
        str, Option("--beyond", help="Finer level at which solutions judge the finest of --levels; empty: none.")
    ] = "",
    quick: Annotated[bool, Option("--quick", help="Two levels and a few frames, as a check.")] = False,
) -> "StudyPlan":
    """The settings of the study."""
    from zoobench.verify.accuracy.plan import QUICK, StudyPlan

    at, home = (tuple(parse_names(text)) for text in (levels, found))
    return QUICK if quick else StudyPlan(at, home, seeds, iterations, stages, frames, gradients, around, draws, beyond)


@accuracy.command("run")
@takes(_plan)
def run(
    plan: "StudyPlan",
    env: EnvOption = "*",
    task: TaskOption = "movement-speed,turning",
    design: Annotated[
        str, component_option("designs", "--design", "Designs; animals that live there if not given.")
    ] = "",
    energy: Annotated[str, Option("--energy", help="Levels whose energy is followed; empty: none.")] = "draft",
    dry: Annotated[bool, Option("--dry-run", help="Only estimate the time.")] = False,
    jobs: WorkersOption = 2,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Carry out what is not done yet of the study.

    Gaits are trained by gradient at some levels, and those of several stages of a training are evaluated at every
    level, at the finest one with a second transfer too. Then the energy of a short episode is followed through every
    substep. Interrupted, it goes on where it stopped when the same command is typed again.
    """
    from zoobench import registry
    from zoobench.harness.grid import parse_selector
    from zoobench.registry import Kind
    from zoobench.spec import Ref
    from zoobench.verify.accuracy.plan import draws, evaluations, trainings

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
    say(f"Next: {command_text('accuracy', 'show', *([] if env == '*' else ['--env', env]), db=db)}")


@accuracy.command("show")
def show(
    env: EnvOption = "*",
    task: TaskOption = "*",
    table: Annotated[str, Option("--table", help="short, levels, matrix, knobs, random, energy or all.")] = "all",
    source: Annotated[Path | None, Option("--from", help="A file of --export instead of the database.")] = None,
    published: Annotated[
        bool, Option("--published", help="Levels that come with zoobench, by which --tolerance chooses.")
    ] = False,
    export: Annotated[Path | None, Option("--export", help="Write the measurements to this file.")] = None,
    publish: Annotated[
        Path | None, Option("--publish", help="Write the rows by which --tolerance and --decide choose.")
    ] = None,
    plots: Annotated[Path | None, Option("--plots", help="Draw scores and energy into this folder.")] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Show errors, what they decide, costs and losses of energy.

    Scores of gaits are compared with those at the finest level; costs are CPU times per simulated second. Nothing is
    simulated. Without a study of your own, `--published` shows the levels of the one that zoobench comes with.
    """
    from zoobench.harness import presets
    from zoobench.harness.grid import parse_selector
    from zoobench.registry import Kind
    from zoobench.verify.accuracy import tolerance
    from zoobench.verify.accuracy.accuracy_plots import draw, draw_energy
    from zoobench.verify.accuracy.accuracy_tables import TABLES
    from zoobench.verify.accuracy.analyse import analyse
    from zoobench.verify.accuracy.energy_rows import energies
    from zoobench.verify.accuracy.records import Measurements, read, write

    wanted = choose(table, tuple(TABLES), form)
    envs = [ref.name for ref in parse_selector(env, Kind.ENV)]
    tasks = [ref.name for ref in parse_selector(task, Kind.TASK)]
    if published and (source or export or publish):
        raise UsageError("--published has levels alone, no measurements. Leave out --from, --export and --publish.")
    measured = Measurements(()) if published else _stored(db) if source is None else read(source)
    analysis = analyse(measured, envs, tasks)
    if published:
        analysis = replace(analysis, levels=tolerance.known_levels(envs, tasks))
    balances = list(energies(measured, envs))
    if export is not None:
        write(measured, export)
    if publish is not None:
        tolerance.publish(measured, publish)
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


def _tell_cost(wanted: "list[RunSpec]", db: str, jobs: int) -> None:
    """Print how long the runs that are not done will take."""
    from zoobench.db.rows import RunState
    from zoobench.report.estimate import basis_text, total_seconds
    from zoobench.report.views import duration
    from zoobench.verify.accuracy.rates import origin

    states, estimator = known_runs(db, wanted, _level_rate)
    estimates = [estimator(spec) for spec in wanted if states.get(spec.key()) is not RunState.DONE]
    total = duration(total_seconds([each and each.seconds for each in estimates], jobs))
    say(f"{len(estimates)} runs to do of {len(wanted)}; estimated time with {jobs} at once, once started: {total}")
    if estimates:
        say(f"Estimated: {basis_text(estimator, estimates, origin())}")


def _level_rate(env: "Ref", fidelity: "Ref") -> "LevelRow | None":
    """The measured rate of an environment, a turned knob counting as its level."""
    from zoobench import registry
    from zoobench.registry import Kind
    from zoobench.spec import Ref
    from zoobench.verify.accuracy.rates import rate

    return rate(env, registry.resolve(Kind.FIDELITY, Ref(fidelity.name)))


def _run(wanted: "list[RunSpec]", db: str, jobs: int) -> "list[RunSpec]":
    """Do what is not done of these runs; those that are done then."""
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
    from zoobench.verify.accuracy.energy_audit import balances
    from zoobench.verify.accuracy.plan import STRONG
    from zoobench.verify.accuracy.records import ENERGY_STUDY, from_reader, stored

    with Store(db) as store:
        known = {(balance.env, balance.fidelity) for balance in from_reader(store).balances}
    controller = registry.resolve(Kind.CONTROLLER, STRONG)
    cells = {(spec.env, fidelity): replace(spec, fidelity=fidelity, controller=controller)
             for spec in reversed(trained) for fidelity in fidelities}  # fmt: skip
    rest = [spec for place, spec in cells.items() if place not in known]
    with Steps(len(rest)) as steps:

        def tell(case: str) -> None:
            steps.begin(f"energy of {case}")
            say(f"following the energy of {case}")

        for row in save_each(db, ENERGY_STUDY, balances(rest, on_case=tell), stored):
            steps.end(f"energy of {row.env} at {row.fidelity}: followed")


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


def _measure_rows(db: str, levels: int | None) -> "Iterator[AnalyticRow]":
    from zoobench.db.rows import StudyRow
    from zoobench.verify.accuracy.analytic import analytic, case_names

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
            say(f"  {row.cells} cells: {row.quantity} off by {row.error:.2g}, {row.slowdown:.2g} s per second")
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
