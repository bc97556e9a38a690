"""Ctrl-C, deferred until it can be handled."""

import signal
import threading
from types import FrameType
from typing import Self


class Interruption:
    """While it lasts, the first Ctrl-C is noted and raised by `check`; the next is raised at once, as usual.

    Python raises KeyboardInterrupt wherever it happens to be; within the finaliser of a library's object it is printed
    and lost. Where Ctrl-C is not Python's, as in a job in the background, which ignores it, and in threads other than
    the main one, which have no say in signals, everything stays as it is.
    """

    def __init__(self) -> None:
        self._noted = False
        self._is_set = False

    def __enter__(self) -> Self:
        is_main = threading.current_thread() is threading.main_thread()
        if is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._note)
            self._is_set = True
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_set:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def check(self) -> None:
        """Raise the interrupt that was noted.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        if self._noted:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._noted:
            signal.default_int_handler(number, frame)
        self._noted = True
