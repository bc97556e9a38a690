"""The ranges that settings of environments share."""

import math
from collections.abc import Collection
from dataclasses import fields
from typing import Any

from zoobench.errors import UsageError


def check_ranges(group: object, *, positive: Collection[str] = (), not_negative: Collection[str] = ()) -> None:
    """Check fields of a group of settings by their names.

    Raises:
        UsageError: one of them is not finite, or below its range.
    """
    for name in (*positive, *not_negative):
        value, may_be_zero = getattr(group, name), name in not_negative
        if not 0.0 <= value < math.inf or (value == 0.0 and not may_be_zero):
            advice = "0 or more" if may_be_zero else "a positive number"
            raise UsageError(f"An {name} of {value:g} is not possible. Give {advice}.")


def check_no_idle(group: Any, default: Any, remedy: str) -> None:
    """Refuse settings of objects or obstacles where there are none: they would make new runs of the same numbers.

    Args:
        group: of settings, a dataclass that is false where there are none.
        default: the same by default.
        remedy: a setting with which there are some, `object=box`.

    Raises:
        UsageError: one of them is not the default.
    """
    if group:
        return
    for item in fields(group):
        if (value := getattr(group, item.name)) != getattr(default, item.name):
            raise UsageError(
                f"{item.name}={value} has no effect without an {remedy.partition('=')[0]}. Leave it out, or choose "
                f"one, as in {remedy}."
            )
