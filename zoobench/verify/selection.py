"""The choice among the cases of a study by name."""

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from typing import Protocol, TypeVar

from zoobench.errors import UnknownNameError, UsageError


class Named(Protocol):
    """A case: known by its name, and done in seconds or not."""

    @property
    def name(self) -> str:
        """Kebab-case."""

    @property
    def is_fast(self) -> bool:
        """Done in a few seconds."""


Case = TypeVar("Case", bound=Named)


def select(cases: Sequence[Case], patterns: Iterable[str], *, noun: str, fast: bool = False) -> list[Case]:
    """The cases whose names match a name or glob, those that need seconds only if `fast`; in the suite's order.

    Args:
        noun: what a case is called in a message.

    Raises:
        UnknownNameError: a pattern matches nothing.
        UsageError: what they match is not fast.
    """
    chosen: set[str] = set()
    for pattern in patterns:
        found = {case.name for case in cases if fnmatchcase(case.name, pattern)}
        if not found:
            raise UnknownNameError(noun, pattern, (case.name for case in cases))
        chosen |= found
    selected = [case for case in cases if case.name in chosen and (case.is_fast or not fast)]
    if not selected:
        raise UsageError(f"The cases {', '.join(sorted(chosen))} need longer than seconds. Leave --fast out.")
    return selected
