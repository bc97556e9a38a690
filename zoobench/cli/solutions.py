"""Runs as arguments: which words name one, and what it has found."""

from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.db.rows import RunRow
    from zoobench.db.store import Store
    from zoobench.spec import Ref
    from zoobench.studies.bodies import Sampled


def may_be_run(text: str) -> bool:
    """Whether this can only be a run: names of components do not begin with a digit."""
    return text[:1].isdigit()


def names_run(text: str, db: str) -> bool:
    """Whether this names a run rather than a component: a number, or letters of a key where there is a database."""
    is_key = len(text) >= 4 and set(text.lower()) <= set("0123456789abcdef")
    return may_be_run(text) or (is_key and ("://" in db or Path(db).exists()))


def solution_of(store: "Store", run: "RunRow") -> tuple[float, ...]:
    """The parameters that a run has found.

    Raises:
        UsageError: it has none.
    """
    from zoobench.db.rows import OPEN_STATES, RunState
    from zoobench.report.views import repeat_command

    if run.state in OPEN_STATES:
        raise UsageError(
            f"Run {run.id} is {run.state} and has no solution yet. Wait until `zoobench status` counts it as done."
        )
    if run.state is not RunState.DONE:
        raise UsageError(f"Run {run.id} is {run.state} and has no solution. `zoobench logs {run.id}` says why.")
    params = store.solution(run.id)
    if params is None:
        raise UsageError(
            f"Run {run.id} was done by an earlier zoobench, which kept no solutions. Do it again with: "
            f"{repeat_command(run.spec)} --rerun '*'"
        )
    return params


def body_of_run(text: str, db: str, fidelity: "Ref | None" = None) -> "tuple[Sampled, str]":
    """The body that a run has found, at its own fidelity if none is given, and what to call it.

    Raises:
        UsageError: there is no such run, it has no solution, or that describes no body at this fidelity.
    """
    from zoobench.db.store import Store
    from zoobench.studies.bodies import formed

    with Store(db, create=False) as store:
        run = store.run(text)
        parameters = solution_of(store, run)
    return formed(run.spec, parameters, fidelity), f"run {run.id}, {run.spec.design.name}"
