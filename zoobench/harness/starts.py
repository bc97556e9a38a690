"""Stored runs as they are typed: `diffphysics[start=12]` and `stored[run=12]` name a run of a database, by its key, and
`diffphysics[start=best:ground/turning/caterpillar]` one of a published leaderboard."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from zoobench import registry
from zoobench.db import published
from zoobench.errors import UsageError
from zoobench.inputs import Start, StoredRun, find_with, named_run, named_runs, run_name
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec, repeat_command

if TYPE_CHECKING:
    from zoobench.db.query import Reader
    from zoobench.db.rows import RunRow


class StoredRuns(Protocol):
    """What settings may name: the runs of a `Reader`, and published ones."""

    def run(self, prefix: str) -> "RunRow":
        """See `Reader.run`."""

    def stored(self, key: str) -> Start | None:
        """See `Reader.stored`."""

    def solution(self, run_id: int) -> tuple[float, ...] | None:
        """See `Reader.solution`."""


@contextmanager
def stored_runs(location: str) -> Iterator[StoredRuns]:
    """The runs of the database at this location; without one there are published runs only.

    Raises:
        StorageError: the database cannot be read.
    """
    from zoobench.db.query import Reader

    if "://" in location or Path(location).exists():
        with Reader(location, create=False) as reader:
            yield reader
    else:
        yield _PublishedRuns(location)


class _PublishedRuns:
    """The runs that can be named where no database is."""

    def __init__(self, location: str) -> None:
        self._location = location

    def run(self, prefix: str) -> "RunRow":
        raise UsageError(f"There is no database {self._location}, and so no run {prefix!r}. Choose another with --db.")

    def stored(self, key: str) -> Start | None:
        return published.start(key)

    def solution(self, run_id: int) -> tuple[float, ...] | None:
        return None


def look_in(location: str) -> str:
    """Let settings name the runs of the database at this location, which is returned; it is opened when one does."""

    def find(name: str) -> Start | None:
        with stored_runs(location) as runs:
            return runs.stored(name.removeprefix("run-"))

    find_with(find)
    return location


def names_runs(kind: Kind, refs: Iterable[Ref]) -> bool:
    """Whether one of these components of a kind names a stored run."""
    return any(_typed(kind, ref) for ref in refs)


def pinned(kind: Kind, ref: Ref, reader: StoredRuns) -> Ref:
    """The component with the runs that it names named by their keys.

    Raises:
        UsageError: there is no such run, or it has no solution.
        StorageError: the database cannot be read.
    """
    names = {}
    for key, text in _typed(kind, ref).items():
        if text.startswith(published.PREFIX):
            names[key] = run_name(published.named(text).spec.key())
            continue
        run = reader.run(text.removeprefix("run-"))
        solution_of(reader, run)
        names[key] = run_name(run.key)
    return Ref(ref.name, ref.version, tuple(sorted({**ref.kwargs, **names}.items())))


def start_notes(specs: Iterable[RunSpec], reader: StoredRuns) -> Iterator[str]:
    """For each cell with a start, a line that says what it takes of it.

    Raises:
        UsageError: nothing of it fits.
        StorageError: the database cannot be read.
    """
    from zoobench.cell.warm_start import overlay_of

    for spec in {(spec.design, spec.controller, spec.method, spec.fidelity): spec for spec in specs}.values():
        if start := reader.stored(named_run(spec.method)):
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


def solution_of(reader: StoredRuns, run: "RunRow") -> tuple[float, ...]:
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
        raise UsageError(f"Run {run.id} is {run.state} and has no solution. `zoobench logs {run.id}` says why.")
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
