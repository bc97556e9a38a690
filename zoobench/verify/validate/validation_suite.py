"""All validation cases, and the choice among them by name."""

from collections.abc import Generator, Iterable

from zoobench.verify import selection
from zoobench.verify.validate import (
    conservation,
    elements,
    fluids,
    friction,
    gradients,
    granular,
    manufactured,
    statics,
    waves,
)
from zoobench.verify.validate.base import Case, Outcome

_ALL: tuple[Case, ...] = (
    *conservation.CASES,
    *waves.CASES,
    *manufactured.CASES,
    *statics.CASES,
    *elements.CASES,
    *friction.CASES,
    *granular.CASES,
    *fluids.CASES,
    *gradients.CASES,
)

CASES = tuple(sorted(_ALL, key=lambda case: -case.precision if case.precision else -48))
"""By precision, 64 bits first: each change of it restarts the runtime."""


def select(patterns: Iterable[str], *, fast: bool = False) -> list[Case]:
    """The cases whose names match a name or glob, those that need seconds only if `fast`; in the suite's order.

    Raises:
        UnknownNameError: a pattern matches nothing.
        UsageError: what it matches is not fast.
    """
    return selection.select(CASES, patterns, noun="validation case", fast=fast)


def run(cases: Iterable[Case]) -> Generator[tuple[Case, Outcome], None, None]:
    """Measure one case after the other."""
    for case in cases:
        yield case, case.run()
