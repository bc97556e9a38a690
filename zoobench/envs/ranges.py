"""The ranges that settings of environments share."""

import math
from collections.abc import Iterable

from zoobench.errors import UsageError


def check_ranges(group: object, *, positive: Iterable[str] = (), not_negative: Iterable[str] = ()) -> None:
    """Check fields of a group of settings by their names.

    Raises:
        UsageError: one of them is not finite, or below its range.
    """
    for names, least, advice in ((positive, math.ulp(0.0), "a positive number"), (not_negative, 0.0, "0 or more")):
        for name in names:
            if not least <= (value := getattr(group, name)) < math.inf:
                raise UsageError(f"An {name} of {value:g} is not possible. Give {advice}.")
