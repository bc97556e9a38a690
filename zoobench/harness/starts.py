"""Warm starts as they are typed: `diffphysics[start=12]` is a run of a database, and becomes its key."""

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.inputs import StoredRun, named_run, run_name
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec, repeat_command

if TYPE_CHECKING:
    from zoobench.db.query import Reader
    from zoobench.db.rows import RunRow


def has_start(method: Ref) -> bool:
    """Whether a method names a run to start from."""
    return bool(_starts(method))


def pinned(method: Ref, reader: "Reader") -> Ref:
    """The method with the runs that it starts from named by their keys.

    Raises:
        UsageError: there is no such run, or it has no solution.
        StorageError: the database cannot be read.
    """
    names = {}
    for key, text in _starts(method).items():
        run = reader.run(text.removeprefix("run-"))
        solution_of(reader, run)
        names[key] = run_name(run.key)
    return Ref(method.name, method.version, tuple(sorted({**method.kwargs, **names}.items())))


def start_notes(specs: Iterable[RunSpec], reader: "Reader") -> Iterator[str]:
    """For each cell with a start, a line that says what it takes of it.

    Raises:
        UsageError: nothing of it fits.
        StorageError: the database cannot be read.
    """
    from zoobench.cell.warm_start import overlay_of

    for spec in {(spec.design, spec.controller, spec.method, spec.fidelity): spec for spec in specs}.values():
        if start := reader.start(spec):
            yield f"{spec.design.name} x {spec.method.name}, warm start: {overlay_of(start, spec).words}"


def run_and_its_starts(reader: "Reader", run: "RunRow") -> Sequence[RunSpec]:
    """The runs that repeat a run, in order: a run that another starts from comes before it."""
    specs = [run.spec]
    while (start := reader.start(specs[0])) is not None:
        specs.insert(0, start.spec)
    return specs


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


def _starts(method: Ref) -> dict[str, str]:
    """The parameters of a method that name a run, as they were typed."""
    expected = registry.get(Kind.METHOD, method.name, method.version).parameters
    return {key: str(value) for key, value in method.params if expected.get(key) is StoredRun and value != ""}
