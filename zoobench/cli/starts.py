"""Warm starts from the command line: `diffphysics[start=12]` is a run of this database, and becomes its key."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from zoobench.cli.output import say
from zoobench.cli.solutions import solution_of

if TYPE_CHECKING:
    from zoobench.db.query import Reader
    from zoobench.db.rows import RunRow
    from zoobench.spec import Ref, RunSpec


def pinned(methods: "Iterable[Ref]", db: str) -> "list[Ref]":
    """The methods, with the runs that they start from named by their keys.

    Raises:
        UsageError: there is no such run, or it has no solution.
        StorageError: there is no such database.
    """
    from zoobench.db.store import Store
    from zoobench.inputs import run_name

    found = []
    for ref in methods:
        if starts := _starts(ref):
            with Store(db, create=False) as store:
                runs = {key: store.run(text.removeprefix("run-")) for key, text in starts.items()}
                for run in runs.values():
                    solution_of(store, run)
            names = {key: run_name(run.key) for key, run in runs.items()}
            ref = type(ref)(ref.name, ref.version, tuple(sorted({**ref.kwargs, **names}.items())))
        found.append(ref)
    return found


def tell_starts(specs: "Iterable[RunSpec]", db: str) -> None:
    """Say what each cell with a start takes of it.

    Raises:
        UsageError: nothing of it fits.
    """
    from zoobench.cell.warm_start import overlay_of
    from zoobench.db.store import Store
    from zoobench.inputs import named_run

    cells = {(spec.design, spec.controller, spec.method, spec.fidelity): spec for spec in specs}
    warm = [spec for spec in cells.values() if named_run(spec.method)]
    if not warm:
        return
    with Store(db, create=False) as store:
        for spec in warm:
            if start := store.start(spec):
                say(f"{spec.design.name} x {spec.method.name}, warm start: {overlay_of(start, spec).words}")


def run_and_its_starts(reader: "Reader", run: "RunRow") -> "Sequence[RunSpec]":
    """What has to be run to repeat a run, the first first: a run that another starts from comes before it."""
    specs = [run.spec]
    while (start := reader.start(specs[0])) is not None:
        specs.insert(0, start.spec)
    return specs


def _starts(ref: "Ref") -> dict[str, str]:
    """The parameters of a method that name a run, as they were typed."""
    from zoobench import registry
    from zoobench.inputs import StoredRun
    from zoobench.registry import Kind

    expected = registry.get(Kind.METHOD, ref.name, ref.version).parameters
    return {key: str(value) for key, value in ref.params if expected.get(key) is StoredRun and value != ""}
