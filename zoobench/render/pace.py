"""Time as a viewer's clock shows it: how fast episodes pass, and how often something is shown."""

import time

_LATE = 0.25  # [s] of lost time that are made up for, at most
_NAP = 0.1  # [s]


class Pace:
    """Lets time pass between control frames."""

    def __init__(self) -> None:
        self._due = time.monotonic()

    def wait(self, seconds: float) -> None:
        """Wait until so much time [s] has passed since the last call, other work included."""
        now = time.monotonic()
        self._due = max(self._due + seconds, now - _LATE)
        time.sleep(max(self._due - now, 0.0))

    def rest(self) -> None:
        """Wait for a moment that is no part of an episode."""
        time.sleep(_NAP)
        self._due = time.monotonic()


class Throttle:
    """Says when something is due that is done so many times a second at most."""

    def __init__(self, most: float) -> None:
        self._interval, self._last = 1.0 / most, -1.0 / most

    def is_due(self) -> bool:
        """Whether it is; it is then taken as done."""
        now = time.monotonic()
        if now - self._last < self._interval:
            return False
        self._last = now
        return True
