"""How far a long command is: after every step a line with their number, the time taken and the time left."""

import time
from typing import Self

from zoobench.cli.output import console, say


class Steps:
    """Tells of the steps of a command on standard error; on a terminal a bar shows the one in hand. Used as a context.

    The time left supposes that the steps to come take as long as those before them; it is not told where their number
    is not known.
    """

    def __init__(self, total: int | None) -> None:
        self._total, self._done = total, 0
        self._start = time.monotonic()
        self._pace = 0.0  # mean time of a step so far [s]
        self._board = None
        out = console(stderr=True)
        if out.is_terminal:
            from zoobench.cli.bars import BarBoard

            self._board = BarBoard(out)
            self._bar = self._board.add_task(f"[{self._count}]", total=total, standing=self._times)

    def begin(self, what: str) -> None:
        """Name the step that is in hand from now on."""
        if self._board is not None:
            self._board.update(self._bar, description=f"[{self._count}] {what}")

    def end(self, text: str) -> None:
        """End the step in hand with a line about it."""
        self._done += 1
        self._pace = (time.monotonic() - self._start) / self._done
        say(f"[{self._count}, {self._times()}] {text}")
        if self._board is not None:
            self._board.update(self._bar, completed=self._done, description=f"[{self._count}]")

    @property
    def _count(self) -> str:
        return f"{self._done}" if self._total is None else f"{self._done}/{self._total}"

    def _times(self) -> str:
        from zoobench.report.views import duration

        taken = time.monotonic() - self._start
        left = self._pace * (self._total or 0) - taken
        return f"{duration(taken)}, {duration(left)} left" if left >= 0.5 else duration(taken)

    def __enter__(self) -> Self:
        if self._board is not None:
            self._board.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._board is not None:
            self._board.stop()
