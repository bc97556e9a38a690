"""`zoobench evaluate`: the solutions of runs in other environments, tasks or fidelities."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict
from itertools import chain
from typing import TYPE_CHECKING, Annotated, NamedTuple

from typer import Exit

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, DoneRunsArgument, FormatOption, component_option
from zoobench.cli.output import Format, emit, emit_several, say
from zoobench.cli.solutions import NamedSolution, published_run, solution_of_published, solution_of_run
from zoobench.cli.steps import Steps
from zoobench.cli.studies import save_each
from zoobench.errors import DivergenceError, UsageError

if TYPE_CHECKING:
    from zoobench.registry import Kind
    from zoobench.spec import Ref, RunSpec
    from zoobench.studies.transfer_study import TransferRow, TransferTargets


def evaluate(
    runs: DoneRunsArgument = None,
    env: Annotated[
        str,
        component_option("envs", "--env", "Environments: names or globs, separated by commas. Default: the run's own."),
    ] = "",
    task: Annotated[str, component_option("tasks", "--task", "Tasks. Default: the run's own.")] = "",
    fidelity: Annotated[str, component_option("fidelities", "--fidelity", "Fidelities. Default: the run's own.")] = "",
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Evaluate solutions in other environments.

    The unchanged solution of each run is simulated for one episode in each environment, task and fidelity, and the
    scores are stored. Episodes that are not possible are skipped with the reason. Without runs, the command prints all
    stored scores as a matrix: a row for where a solution was trained, a column for where it was evaluated.
    """
    if not runs:
        chosen = (("--env", env), ("--task", task), ("--fidelity", fidelity))
        _show(db, form, [word for name, text in chosen if text for word in (name, text)])
        return
    from zoobench.cell.loading import check_devices
    from zoobench.db.rows import TRANSFER
    from zoobench.db.store import Store
    from zoobench.report.transfer_table import episode_listing, episode_overview
    from zoobench.spec import Ref
    from zoobench.studies.transfer_study import stored

    targets = targets_of(env, task, fidelity)
    named = [(text, published_run(text, db)) for text in runs]
    published = [solution_of_published(text, best) for text, best in named if best]
    own = []
    if typed := [text for text, best in named if not best]:
        with Store(db, create=False) as store:
            own = [solution_of_run(store, text) for text in typed]
    episodes = [_Episode(each, cell) for each in (*own, *published) for cell in targets.of(each.spec)]
    check_devices(each.cell for each in episodes)  # before any of them
    place = _places(episodes)
    episodes = _possible(episodes, place)
    found, failed = [], []
    with Steps(len(episodes)) as steps:

        def fail(episode: _Episode, error: Exception) -> None:
            failed.append(episode)
            steps.end(f"{episode.title}, {place(*episode.refs)}: {error}")

        kept = [each for each in episodes if each.solution.run is not None]
        saved = save_each(db, TRANSFER, _all(kept, fail), stored) if kept else iter(())
        for row in chain(saved, _all([each for each in episodes if each.solution.run is None], fail)):
            found.append(row)
            steps.end(f"{row.title}, {place(*map(Ref.parse, (row.env, row.task, row.fidelity)))}: {row.result}")
    if published:
        say("Scores of published solutions are shown and not stored: the database does not have their runs.")
    documents = [asdict(row) for row in found]
    emit(episode_overview(documents), form, programs=episode_listing(documents))
    if failed:
        raise Exit(1)


class _Episode(NamedTuple):
    """An episode of a solution, in the cell of another run or its own."""

    solution: NamedSolution
    cell: "RunSpec"

    @property
    def run(self) -> int | str:
        """Number of the run that found the solution, or its name if it is published."""
        return self.solution.name if self.solution.run is None else self.solution.run.id

    @property
    def title(self) -> str:
        """The run, for people."""
        return f"run {self.run}" if isinstance(self.run, int) else self.run

    @property
    def refs(self) -> "tuple[Ref, Ref, Ref]":
        """Where it is."""
        return self.cell.env, self.cell.task, self.cell.fidelity


def _places(episodes: Sequence[_Episode]) -> "Callable[[Ref, Ref, Ref], str]":
    """Names of environment, task and fidelity, with as many settings as it takes to tell these episodes apart."""
    from zoobench.report.labels import labels

    names = [labels(refs) for refs in zip(*(each.refs for each in episodes), strict=True)]
    return lambda *refs: " x ".join(known[ref] for known, ref in zip(names, refs, strict=True))


def _possible(episodes: Sequence[_Episode], place: "Callable[[Ref, Ref, Ref], str]") -> list[_Episode]:
    """The episodes that are possible; of the others it is said why they are not.

    Raises:
        UsageError: none is.
    """
    from zoobench.studies.transfer_study import transfer_fault

    left = []
    for each in episodes:
        if fault := transfer_fault(each.run, each.solution.spec, each.solution.params, each.cell):
            say(f"  skipped {each.title}, {place(*each.refs)}: {fault}")
        else:
            left.append(each)
    if not left:
        raise UsageError(
            "Nothing was evaluated: every episode was skipped, for the reasons above. Change what they name."
        )
    return left


def targets_of(env: str, task: str, fidelity: str) -> "TransferTargets":
    """Where to evaluate a solution, as it is typed; an empty text is the run's own.

    Raises:
        UnknownNameError, UsageError: a text stands for no component.
    """
    from zoobench.registry import Kind
    from zoobench.studies.transfer_study import TransferTargets

    return TransferTargets(_refs(env, Kind.ENV), _refs(task, Kind.TASK), _refs(fidelity, Kind.FIDELITY))


def _refs(text: str, kind: "Kind") -> "list[Ref] | None":
    """The components that a text stands for, None for an empty one."""
    from zoobench import registry
    from zoobench.harness.grid import parse_selector

    return [registry.resolve(kind, ref) for ref in parse_selector(text, kind)] if text else None


def _show(db: str, form: Format, others: list[str]) -> None:
    """Print the transfer matrix of all that was evaluated."""
    from zoobench.db.rows import TRANSFER
    from zoobench.db.store import Store
    from zoobench.report.provisional import footnotes
    from zoobench.report.transfer_table import transfer_cells, transfer_matrices, tried
    from zoobench.spec import Ref

    if others:
        raise UsageError(f"Without runs, all stored scores are shown. Leave {' '.join(others)} out, or name runs.")
    with Store(db, create=False) as store:
        documents = [row.document for study in store.studies(TRANSFER) for row in study.rows]
        specs = {run.id: run.spec for run in store.runs(ids={document["run"] for document in documents})}
    found = tried(documents, specs)
    if form in (Format.CSV, Format.JSON):
        emit(transfer_cells(found), form)
    else:
        emit_several({listing.title: listing for listing in transfer_matrices(found)}, form)
    for note in footnotes(Ref.parse(env) for document in documents for env in (document["env"], document["home"][0])):
        say(note)
    if documents and not found:
        say("All stored scores are of the fidelity smoke, which tables leave out.")
    elif not found:
        say("No solution was evaluated elsewhere yet. Try: zoobench evaluate RUN --env '*'")
    elif form in (Format.TABLE, Format.MD):
        say("cells: mean over runs ± half of the 95 % Student-t interval; bold or *: where the solutions were trained")


def _all(episodes: Iterable[_Episode], fail: Callable[[_Episode, Exception], None]) -> "Iterator[TransferRow]":
    """The rows of these episodes; `fail` is called with those that end without one."""
    from zoobench.studies.transfer_study import tried

    for each in episodes:
        try:
            yield tried(each.run, each.solution.spec, each.solution.params, each.cell)
        except (UsageError, DivergenceError) as error:
            fail(each, error)
