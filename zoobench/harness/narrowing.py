"""A part of a suite, named in the words that make a grid elsewhere. What the suite does not hold is refused."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase

from zoobench.errors import UnknownNameError, UsageError
from zoobench.harness.grid import Skip, split_selector
from zoobench.harness.suites import Suite, spec_of
from zoobench.spec import AXES, Budget, Ref, RunSpec


@dataclass(frozen=True)
class Narrowing:
    """Which cells of a suite are meant; an empty text or None means all of that axis.

    Components are named as for a grid, `des*` or `diffphysics[lr=0.1]`: a cell fits if it has the name and, where they
    are given, the version and the values of the parameters.
    """

    env: str = ""
    task: str = ""
    design: str = ""
    controller: str = ""
    method: str = ""
    fidelity: str = ""
    seeds: tuple[int, ...] | None = None
    budget: Budget | None = None
    frames: int | None = None

    def of(self, suite: Suite) -> list[RunSpec | Skip]:
        """The chosen cells in the order of the suite.

        Raises:
            UnknownNameError: a component that the suite does not have; suggests the nearest.
            UsageError: another value that it does not have, or nothing is left.
        """
        left = list(suite.cells)
        for axis in AXES:
            if text := getattr(self, axis):
                patterns = [_Pattern.parse(item, axis, suite) for item in split_selector(text)]
                left = [cell for cell in left if any(each.fits(spec_of(cell)) for each in patterns)]
        if self.seeds is not None:
            left = _only(left, suite, "seed", self.seeds, lambda spec: spec.seed)
        if self.budget is not None:
            left = _only(left, suite, "budget", (self.budget,), lambda spec: spec.budget)
        if self.frames is not None:
            left = _only(left, suite, "frames", (self.frames,), lambda spec: spec.frames)
        if not left:
            given = ", ".join(f"--{item.name}" for item in fields(self) if getattr(self, item.name) not in ("", None))
            raise UsageError(
                f"No run of the suite {suite.name!r} is all that {given} ask for. Leave one of them out, "
                f"or look with `zoobench plan --suite {suite.source}`."
            )
        return left


@dataclass(frozen=True)
class _Pattern:
    """A name or glob of an axis, with the version (0: any) and the parameters that a cell must have."""

    axis: str
    name: str
    version: int
    params: tuple[tuple[str, object], ...]

    @classmethod
    def parse(cls, text: str, axis: str, suite: Suite) -> "_Pattern":
        head, bracket, rest = text.partition("[")
        is_glob = "*" in head or "?" in head
        ref = Ref.parse(f"any{bracket}{rest}" if is_glob else text)
        pattern = cls(axis, head if is_glob else ref.name, ref.version, ref.params)
        refs = {getattr(spec, axis) for spec in suite.specs}
        if not any(pattern.fits_ref(ref) for ref in refs):
            known = {other.name for other in refs}
            if not any(fnmatchcase(name, pattern.name) for name in known):
                raise UnknownNameError(f"{axis} in the suite {suite.name!r}:", pattern.name, known)
            raise UsageError(
                f"The suite {suite.name!r} has no {axis} {text!r}: options narrow a suite down, they do not change it. "
                f"It has {', '.join(sorted(str(ref) for ref in refs if fnmatchcase(ref.name, pattern.name)))}."
            )
        return pattern

    def fits(self, spec: RunSpec) -> bool:
        return self.fits_ref(getattr(spec, self.axis))

    def fits_ref(self, ref: Ref) -> bool:
        return (
            fnmatchcase(ref.name, self.name)
            and self.version in (0, ref.version)
            and all(ref.kwargs.get(name) == value for name, value in self.params)
        )


def _only(
    cells: Sequence[RunSpec | Skip],
    suite: Suite,
    what: str,
    wanted: Sequence[object],
    value_of: Callable[[RunSpec], object],
) -> list[RunSpec | Skip]:
    known = dict.fromkeys(value_of(spec) for spec in suite.specs)
    for value in wanted:
        if value not in known:
            raise UsageError(
                f"The suite {suite.name!r} has no {what} {value}: options narrow a suite down, they do not change it. "
                f"It has {', '.join(map(str, known))}."
            )
    return [cell for cell in cells if value_of(spec_of(cell)) in wanted]
