"""Stored runs as they are typed: `diffphysics[start=12]` and `stored[run=12]` name a run of a database, by its key, and
`diffphysics[start=best:ground/turning/caterpillar]` one of a published leaderboard, which needs no database."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from zoobench import registry
from zoobench.db import published
from zoobench.errors import UsageError
from zoobench.inputs import Start, StoredRun, find_with, make_known, named_run, named_runs, run_name
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec, repeat_command
from zoobench.tasks.quantities import quantity_of

if TYPE_CHECKING:
    from zoobench.db.query import Reader
    from zoobench.db.rows import RunRow


def has_database(location: str) -> bool:
    """Whether a database may be at this location: a file, or that of a server."""
    return "://" in location or Path(location).exists()


def stored(location: str, key: str) -> Start | None:
    """The solution of the run whose key begins so, in the database at this location or published.

    For a published one there need not be a database.

    Raises:
        StorageError: the database cannot be read.
    """
    from zoobench.db.query import Reader

    if not has_database(location):
        return published.start(key)
    with Reader(location, create=False) as reader:
        return reader.stored(key)


def look_in(location: str) -> str:
    """Let settings name the runs of the database at this location, which is returned; it is opened when one does."""

    find_with(lambda name: stored(location, name.removeprefix("run-")))
    return location


def names_runs(kind: Kind, refs: Iterable[Ref]) -> bool:
    """Whether one of these components of a kind names a stored run."""
    return any(_typed(kind, ref) for ref in refs)


def pinned(kind: Kind, ref: Ref, location: str) -> Ref:
    """The component with the runs that it names, of the database at this location or published, named by their keys.

    Raises:
        UsageError: there is no such run, or it has no solution.
        StorageError: the database cannot be read.
    """
    return _with_runs(ref, {key: _named(text, location) for key, text in _typed(kind, ref).items()})


def pinned_published(kind: Kind, ref: Ref) -> Ref:
    """The component with the published runs that it names, named by their keys; others stay as they were typed.

    Raises:
        UnknownNameError: there is no such run.
        StorageError: a leaderboard cannot be read.
    """
    names = {key: text for key, text in _typed(kind, ref).items() if text.startswith(published.PREFIX)}
    return _with_runs(ref, {key: _named_published(text) for key, text in names.items()})


def _with_runs(ref: Ref, names: Mapping[str, str]) -> Ref:
    return Ref(ref.name, ref.version, tuple(sorted({**ref.kwargs, **names}.items())))


def _named(text: str, location: str) -> str:
    """The name of a run that was typed, which has a solution; the database is opened for its own runs only."""
    from zoobench.db.query import Reader

    if text.startswith(published.PREFIX):
        return _named_published(text)
    with Reader(location, create=False) as reader:
        run = reader.run(text.removeprefix("run-"))
        solution_of(reader, run)
        return run_name(run.key)


def _named_published(text: str) -> str:
    best = published.named(text)
    name = run_name(best.key)
    make_known(name, best.start)
    return name


def words_of(best: published.PublishedRun) -> str:
    """Which published run it is, for people: its board, environment if that has settings, method, seed and score."""
    spec, wall = best.spec, ", at a wall" if best.at_wall else ""
    score, env = quantity_of(spec.task, best.unit).text(best.score), registry.short(Kind.ENV, spec.env)
    where = f"{env}, " * (env != spec.env.name)
    return f"of the leaderboard {best.board}: {where}{spec.method.name}, seed {spec.seed}, {score}{wall}"


def published_notes(specs: Iterable[RunSpec]) -> Iterator[str]:
    """For each published run that some runs name, a line that says which it is.

    Raises:
        StorageError: a leaderboard cannot be read.
    """
    for key in dict.fromkeys(key for spec in specs for key in named_runs(spec.method, spec.controller, spec.design)):
        if found := published.with_key(key):
            yield f"{run_name(found.key)}, {found.full_name}, is {words_of(found)}"


def start_notes(specs: Iterable[RunSpec], location: str) -> Iterator[str]:
    """For each cell with a start, a line that says what it takes of it.

    Raises:
        UsageError: nothing of it fits.
        StorageError: the database cannot be read.
    """
    from zoobench.cell.warm_start import overlay_of

    for spec in {(spec.design, spec.controller, spec.method, spec.fidelity): spec for spec in specs}.values():
        if start := stored(location, named_run(spec.method)):
            yield f"{spec.design.name} x {spec.method.name}, warm start: {overlay_of(start, spec).words}"


def gait_notes(specs: Iterable[RunSpec]) -> Iterator[str]:
    """For each cell with a stored gait, a line if it was found on muscles of other names.

    Raises:
        UsageError: a gait does not fit its body, or a stored body its fidelity.
    """
    from zoobench.cell.robot import Robot, gait_of

    cells = {(spec.design, spec.controller, spec.task, spec.fidelity): spec for spec in specs}
    for spec in (spec for spec in cells.values() if named_runs(spec.design, spec.controller)):
        robot = Robot.of_run(spec)
        home = gait_of(robot)
        if home is not None and Robot.of_run(home).body.muscles != robot.body.muscles:
            yield f"The gait of {home.design.name} drives the muscles of {spec.design.name} in their order."


def run_and_its_starts(reader: "Reader", run: "RunRow") -> Sequence[RunSpec]:
    """The runs that repeat a run, in order: a run that another names comes before it."""
    found: dict[str, RunSpec] = {}

    def add(spec: RunSpec) -> None:
        for key in named_runs(spec.method, spec.controller, spec.design):
            if start := reader.stored(key):
                add(start.spec)
        found[spec.key()] = spec

    add(run.spec)
    return list(found.values())


def solution_of(reader: "Reader", run: "RunRow") -> tuple[float, ...]:
    """The parameters that a run has found.

    Raises:
        UsageError: it has none.
        StorageError: the database cannot be read.
    """
    from zoobench.db.rows import RunState

    if not run.has_ended:
        raise UsageError(
            f"Run {run.id} is {run.state} and has no solution yet. Wait until `zoobench status` counts it as done."
        )
    if run.state is not RunState.DONE:
        raise UsageError(f"Run {run.id} is {run.state} and has no solution. `zoobench show {run.id} --log` says why.")
    params = reader.solution(run.id)
    if params is None:
        raise UsageError(
            f"Run {run.id} was done by an earlier zoobench, which kept no solutions. Do it again with: "
            f"{repeat_command(run.spec)} --rerun '*'"
        )
    return params


def is_warm(spec: RunSpec) -> bool:
    """Whether a run starts from another."""
    return bool(named_run(spec.method))


def _typed(kind: Kind, ref: Ref) -> dict[str, str]:
    """The parameters of a component that name a run, as they were typed."""
    expected = registry.get(kind, ref.name, ref.version).parameters
    return {key: str(value) for key, value in ref.params if expected.get(key) is StoredRun and value != ""}
