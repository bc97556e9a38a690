"""How near the robot of a published run came to a side of its arena."""

from collections.abc import Mapping
from typing import Any

from zoobench.spec import WALL_GAP


def wall_gap_in(record: Mapping[str, Any]) -> float | None:
    """The gap [cells] of a run as an export of a leaderboard holds it; None if it is not known.

    `zoobench.spec.is_at_wall` and `standing` take it. Runs of an earlier zoobench did not read it; then an episode over
    more frames may tell.

    Raises:
        LookupError, TypeError, ValueError: it is no such record.
    """
    final = record["finals"].get(WALL_GAP)
    value = record.get("lasting", {}).get("home_gap") if final is None else final["value"]
    return None if value is None else float(value)
