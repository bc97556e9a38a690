"""A part of a suite, selected in the words that make a grid elsewhere; what the suite does not hold is refused."""

from collections.abc import Collection

from zoobench.errors import UsageError
from zoobench.harness.grid import Skip
from zoobench.harness.suites import Suite, spec_of
from zoobench.spec import Budget, RunSelection, RunSpec

_HINT = "Options narrow a suite down, they do not change it. "


def narrowed(
    suite: Suite,
    selection: RunSelection,
    *,
    seeds: tuple[int, ...] | None = None,
    budget: Budget | None = None,
    frames: int | None = None,
) -> list[RunSpec | Skip]:
    """The selected cells of a suite in its order; None means every value that the suite has.

    Raises:
        UnknownNameError: a component that the suite does not have; suggests the nearest.
        UsageError: another value that it does not have, or nothing is left.
    """
    left = selection.among(suite.cells, spec_of, f"in the suite {suite.name!r}", _HINT)
    given: dict[str, Collection[object]] = {}
    if seeds is not None:
        given["seed"] = seeds
    given |= {name: (value,) for name, value in (("budget", budget), ("frames", frames)) if value is not None}
    for name, wanted in given.items():
        known = dict.fromkeys(getattr(spec, name) for spec in suite.specs)
        for value in wanted:
            if value not in known:
                raise UsageError(
                    f"The suite {suite.name!r} has no {name} {value}. {_HINT}It has {', '.join(map(str, known))}."
                )
        left = [cell for cell in left if getattr(spec_of(cell), name) in wanted]
    if not left:
        options = [*selection.options()[::2], *("--seeds" if name == "seed" else f"--{name}" for name in given)]
        raise UsageError(
            f"No run in the suite {suite.name!r} is all that {', '.join(options)} ask for. Leave one of them out, "
            f"or look with `zoobench run --suite {suite.source} --dry-run`."
        )
    return left
