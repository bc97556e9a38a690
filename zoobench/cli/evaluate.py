"""`zoobench evaluate`: the solutions of runs in other environments, tasks or fidelities."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, DoneRunsArgument, FormatOption, component_option
from zoobench.cli.output import Format, emit, say
from zoobench.cli.steps import Steps
from zoobench.cli.studies import save_each
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.db.rows import RunRow
    from zoobench.registry import Kind
    from zoobench.spec import Ref
    from zoobench.verify.transfer_study import TransferRow, TransferTargets

_LIKEWISE = "Likewise; the run's own if not given."


def evaluate(
    runs: DoneRunsArgument = None,
    env: Annotated[
        str, component_option("envs", "--env", "Environments: names or globs, with commas; the run's own if not given.")
    ] = "",
    task: Annotated[str, component_option("tasks", "--task", _LIKEWISE)] = "",
    fidelity: Annotated[str, component_option("fidelities", "--fidelity", _LIKEWISE)] = "",
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Evaluate solutions in other environments.

    Or in other tasks or fidelities: one episode each, with the stored solution unchanged; the scores are stored.
    Without runs, the matrix of all stored scores: where solutions were found by where they were evaluated.
    """
    if not runs:
        chosen = (("--env", env), ("--task", task), ("--fidelity", fidelity))
        _show(db, form, [word for name, text in chosen if text for word in (name, text)])
        return
    from zoobench.db.store import Store
    from zoobench.harness.starts import solution_of
    from zoobench.registry import Kind
    from zoobench.report.listing import Listing
    from zoobench.spec import Ref
    from zoobench.verify.transfer_study import STUDY, TransferTargets, stored

    targets = TransferTargets(_refs(env, Kind.ENV), _refs(task, Kind.TASK), _refs(fidelity, Kind.FIDELITY))
    with Store(db, create=False) as store:
        solutions = [(run, solution_of(store, run)) for run in map(store.run, runs)]
    found = []
    with Steps(sum(len(list(targets.of(run.spec))) for run, _ in solutions)) as steps:
        for row in save_each(db, STUDY, _all(solutions, targets), stored):
            found.append(row)
            score = row.reason if row.score is None else f"score {row.score:.4g} {row.unit}"
            steps.end(f"run {row.run} in {Ref.parse(row.env).name}: {score}")
    columns = ("run", "found_in", "env", "task", "fidelity", "score", "unit")
    body = tuple(
        (row.run, *(Ref.parse(text).name for text in (row.home[0], row.env, row.task, row.fidelity)), row.score,
         row.unit)
        for row in found
    )  # fmt: skip
    emit(Listing(columns, body), form, records=[asdict(row) for row in found])


def _refs(text: str, kind: "Kind") -> "list[Ref] | None":
    """The components that a text stands for, None for an empty one."""
    from zoobench import registry
    from zoobench.harness.grid import parse_selector

    return [registry.resolve(kind, ref) for ref in parse_selector(text, kind)] if text else None


def _show(db: str, form: Format, others: list[str]) -> None:
    """Print the transfer matrix of all that was evaluated."""
    from zoobench.db.store import Store
    from zoobench.report.provisional import footnotes
    from zoobench.report.transfer_table import transfer_matrix
    from zoobench.spec import Ref
    from zoobench.verify.transfer_study import STUDY

    if others:
        raise UsageError(f"Without runs, all that was evaluated is shown. Leave {' '.join(others)} out, or name runs.")
    with Store(db, create=False) as store:
        documents = [row.document for study in store.studies(STUDY) for row in study.rows]
        specs = {run.id: run.spec for run in store.runs(ids={document["run"] for document in documents})}
    found = transfer_matrix(
        {**document, "controller": str(spec.controller), "budget": str(spec.budget)}
        for document in documents
        for spec in [specs[document["run"]]]
    )
    emit(found, form)
    for note in footnotes(Ref.parse(env) for document in documents for env in (document["env"], document["home"][0])):
        say(note)
    if not found.rows:
        say("Nothing was evaluated elsewhere yet. `zoobench evaluate RUN --env '*'` does.")
    elif form in (Format.TABLE, Format.MD):
        say("cells: mean over runs ± half of the 95 % Student-t interval; bold or *: where the solutions were found")


def _all(solutions: "list[tuple[RunRow, tuple[float, ...]]]", targets: "TransferTargets") -> "Iterator[TransferRow]":
    from zoobench.verify.transfer_study import transfer

    for run, parameters in solutions:
        yield from transfer(run.id, run.spec, parameters, targets)
