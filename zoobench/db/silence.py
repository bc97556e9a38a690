"""For how long a lease is seen unchanged, by this process's own time.

Only the time that this process was looking counts: while it was stopped itself, or its machine slept, it cannot tell.
"""

import time

_LONGEST_LOOK_SECONDS = 2.0  # between two looks of one that looks on

_seen: dict[str, tuple[float | None, float, float]] = {}
"""The lease of each owner, when it was looked at last, and for how long it has been unchanged."""


def seconds_silent(owner: str, lease_until: float | None) -> float:
    """For how long [s] this process, which looks every second or two, has seen this lease of an owner unchanged."""
    now = time.monotonic()
    lease, looked_at, seconds = _seen.get(owner, (None, now, 0.0))
    seconds = seconds + min(now - looked_at, _LONGEST_LOOK_SECONDS) if lease == lease_until else 0.0
    _seen[owner] = lease_until, now, seconds
    return seconds
