"""Runs as arguments of commands, and their solutions."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from zoobench.cli.output import say
from zoobench.errors import UnknownRunError, UsageError

if TYPE_CHECKING:
    from zoobench.db.published import PublishedRun
    from zoobench.db.rows import RunRow
    from zoobench.db.store import Store
    from zoobench.methods.archive import Archive
    from zoobench.render.bodies import Sampled
    from zoobench.spec import Ref, RunSpec


@dataclass(frozen=True)
class NamedSolution:
    """The solution of a run.

    Attributes:
        name: of the run, for people.
        run: it, None if it is not of the database but published.
        params: `[parameter_count]`.
        score: in `unit`.
    """

    name: str
    run: "RunRow | None"
    spec: "RunSpec"
    params: tuple[float, ...]
    score: float
    unit: str

    def text(self, score: float, digits: int = 4) -> str:
        """A score of this task as it is said: `score 0.12 m/s`, or `error 0.05 m`."""
        from zoobench.report.views import score_text

        return score_text(self.spec.task, score, self.unit, digits)


def solution_named(text: str, db: str) -> NamedSolution:
    """The solution of a run of the database, or of a published leaderboard, as `best:ground/turning/caterpillar`.

    The start of a key names a published run, too, if the database has none of that key. Which published run it is, is
    said. Where its environment or task has only newer versions, the newest takes their place, with a word.

    Raises:
        UsageError: there is no such run, or it has no solution.
        StorageError: the database or leaderboard cannot be read.
    """
    from zoobench.db.store import Store

    if best := published_run(text, db):
        return solution_of_published(text, best)
    with Store(db, create=False) as store:
        return solution_of_run(store, text)


def solution_of_published(text: str, best: "PublishedRun") -> NamedSolution:
    """That of the published run that a text names, which is said."""
    from zoobench.harness.starts import words_of

    say(f"{text} is {words_of(best)}")
    return NamedSolution(text, None, _of_today(best.spec), best.params, best.score, best.unit)


def published_run(text: str, db: str) -> "PublishedRun | None":
    """The published run of this name, or whose key begins so; None if there is none, or the database has the key.

    Raises:
        UsageError: several runs of the database have a key that begins so.
    """
    from zoobench.db import published
    from zoobench.db.query import is_number
    from zoobench.db.store import Store
    from zoobench.harness.starts import has_database

    if names_published(text):
        return published.named(text)
    key = text.removeprefix("run-").lower()
    found = None if is_number(key) or len(key) < 4 else published.with_key(key)
    if found is None or not has_database(db):
        return found
    with Store(db, create=False) as store:
        try:
            store.run(text)
        except UnknownRunError:
            return found
    return None


def _of_today(spec: "RunSpec") -> "RunSpec":
    """The run in an environment and a task that this version has, with the parameters that they still have."""
    from dataclasses import replace

    from zoobench import registry
    from zoobench.registry import Kind
    from zoobench.spec import Ref

    for axis, kind in (("env", Kind.ENV), ("task", Kind.TASK)):
        ref = getattr(spec, axis)
        newest = registry.get(kind, ref.name)
        if newest.version > ref.version:
            kept = tuple((key, value) for key, value in ref.params if key in newest.parameters)
            changed: dict[str, Any] = {axis: registry.resolve(kind, Ref(ref.name, newest.version, kept))}
            spec = replace(spec, **changed)
            say(f"  it was found in {ref.name}-v{ref.version}; in {ref.name}-v{newest.version} its score may differ")
    return spec


def solution_of_run(store: "Store", text: str) -> NamedSolution:
    """The solution of a run of an open database.

    Raises:
        UsageError: there is no such run, or it has no solution.
    """
    from zoobench.harness.starts import solution_of

    run = store.run(text)
    params = solution_of(store, run)
    score = next(final for final in store.finals(run.id) if final.name == "score")
    return NamedSolution(f"run {run.id}", run, run.spec, params, score.value, score.unit)


def solution_so_far(text: str, db: str) -> NamedSolution | None:
    """As `solution_named`; of a run that goes on, the best that it keeps so far. None if that is nothing yet.

    Raises:
        UsageError: there is no such run, or it has ended without a solution.
        StorageError: the database or leaderboard cannot be read.
    """
    from zoobench import registry
    from zoobench.db.store import Store
    from zoobench.registry import Kind

    if published := published_run(text, db):
        return solution_of_published(text, published)
    with Store(db, create=False) as store:
        run = store.run(text)
        if run.has_ended:
            return solution_of_run(store, text)
        milestones = store.milestones(run.id)
    if not milestones:
        return None
    best, unit = milestones[-1], registry.create(Kind.TASK, run.spec.task).unit
    name = f"run {run.id} after {best.step:,} iteration{'s' * (best.step != 1)}"
    return NamedSolution(name, run, run.spec, best.params, best.score, unit)


def names_published(text: str) -> bool:
    """Whether a text names a solution of a published leaderboard."""
    from zoobench.db.published import PREFIX

    return text.startswith(PREFIX)


def may_be_run(text: str) -> bool:
    """Whether a text can only name a run: names of components do not begin with a digit, or with `best:`."""
    return text[:1].isdigit() or names_published(text)


def names_run(text: str, db: str) -> bool:
    """Whether a text names a run and no component: a number, or the start of a key if the database exists."""
    from zoobench.harness.starts import has_database

    is_key = len(text) >= 4 and set(text.lower()) <= set("0123456789abcdef")
    return may_be_run(text) or (is_key and has_database(db))


def archive_of(store: "Store", run: "RunRow") -> "Archive":
    """The archive of a run.

    Raises:
        UsageError: the run has no solution, or its method keeps no archive.
    """
    from zoobench.harness.starts import solution_of
    from zoobench.methods.archive import Archive

    solution_of(store, run)  # raises if the run is not done
    stored = store.archive(run.id)
    if stored is None:
        raise UsageError(
            f"Run {run.id} kept no archive: its method is {run.spec.method.name}. "
            "Runs of quality-diversity keep one; repeat a run of an earlier version with --rerun."
        )
    return Archive.from_bytes(stored)


def body_of_run(
    text: str, db: str, fidelity: "Ref | None" = None, *, elite: int | None = None
) -> "tuple[Sampled, str]":
    """The body of a run's solution, at the run's own fidelity if none is given, and its title.

    `elite` asks for the body of this number in the run's archive instead; 1 is the best.

    Raises:
        UsageError: the run or elite does not exist, or its solution, or the solution does not fit the fidelity.
    """
    from zoobench.db.store import Store
    from zoobench.render.bodies import formed

    if elite is None:
        found = solution_named(text, db)
        return formed(found.spec, found.params, fidelity), f"{found.name}, {found.spec.design.name}"
    with Store(db, create=False) as store:
        run = store.run(text)
        parameters = _elite(archive_of(store, run), elite)
    return formed(run.spec, parameters, fidelity), f"run {run.id}, {run.spec.design.name}"


def _elite(archive: "Archive", number: int) -> "list[float]":
    count = len(archive.scores)
    if not 1 <= number <= count:
        raise UsageError(f"There is no elite {number} in an archive of {count}. Give 1, the best, to {count}.")
    found: list[float] = archive.params[number - 1].tolist()
    return found
