"""Clocks of a test: that of the wall, which may be set, and the monotonic one."""

import time

import pytest


class FakeClock:
    """Stands still until it is told; `time.time` and `time.monotonic` read it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._wall, self._steady = time.time(), time.monotonic()
        monkeypatch.setattr(time, "time", lambda: self._wall)
        monkeypatch.setattr(time, "monotonic", lambda: self._steady)

    def go_on(self, seconds: float) -> None:
        """Let time pass [s]."""
        self._wall += seconds
        self._steady += seconds

    def set_by(self, seconds: float) -> None:
        """Set the clock on the wall forward or, below zero, back [s]."""
        self._wall += seconds
