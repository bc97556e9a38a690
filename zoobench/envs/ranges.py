"""The ranges that settings of environments share."""

import math
from collections.abc import Collection

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
