"""Runs as arguments: which words name one, and what it has found."""

from pathlib import Path
from typing import TYPE_CHECKING

from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.db.rows import RunRow
    from zoobench.db.store import Store
    from zoobench.methods.archive import Archive
    from zoobench.render.bodies import Sampled
    from zoobench.spec import Ref


def may_be_run(text: str) -> bool:
    """Whether this can only be a run: names of components do not begin with a digit."""
    return text[:1].isdigit()


def names_run(text: str, db: str) -> bool:
    """Whether this names a run rather than a component: a number, or letters of a key where there is a database."""
    is_key = len(text) >= 4 and set(text.lower()) <= set("0123456789abcdef")
    return may_be_run(text) or (is_key and ("://" in db or Path(db).exists()))


def archive_of(store: "Store", run: "RunRow") -> "Archive":
    """What a run has found beside its solution.

    Raises:
        UsageError: it has no solution, or its method keeps no archive.
    """
    from zoobench.harness.starts import solution_of
    from zoobench.methods.archive import Archive

    solution_of(store, run)  # says why there is none
    stored = store.archive(run.id)
    if stored is None:
        raise UsageError(
            f"Run {run.id} kept no archive: its method is {run.spec.method.name}. "
            "Runs of quality-diversity keep one; if an earlier zoobench did it, do it again with --rerun."
        )
    return Archive.from_bytes(stored)


def body_of_run(
    text: str, db: str, fidelity: "Ref | None" = None, *, elite: int | None = None
) -> "tuple[Sampled, str]":
    """The body that a run has found, at its own fidelity if none is given, and what to call it.

    `elite` is the number of one in its archive instead, from 1.

    Raises:
        UsageError: there is no such run or elite, it has no solution, or that describes no body at this fidelity.
    """
    from zoobench.db.store import Store
    from zoobench.harness.starts import solution_of
    from zoobench.render.bodies import formed

    with Store(db, create=False) as store:
        run = store.run(text)
        parameters = solution_of(store, run) if elite is None else _elite(archive_of(store, run), elite)
    return formed(run.spec, parameters, fidelity), f"run {run.id}, {run.spec.design.name}"


def _elite(archive: "Archive", number: int) -> "list[float]":
    count = len(archive.scores)
    if not 1 <= number <= count:
        raise UsageError(f"There is no elite {number} in an archive of {count}. Give 1, the best, to {count}.")
    found: list[float] = archive.params[number - 1].tolist()
    return found
