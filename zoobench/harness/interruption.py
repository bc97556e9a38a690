"""Ctrl-C that is never lost."""

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self


class Interruption:
    """While it lasts, the first Ctrl-C is noted and raised by `check`; the next is raised at once, as usual.

    Python raises KeyboardInterrupt wherever it happens to be; within the finaliser of a library's object it is printed
    and lost. Threads other than the main one have no say in signals: there everything stays as it is.
    """

    def __init__(self) -> None:
        self._noted = False
        self._former: Any = None

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._former = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._former is not None:
            signal.signal(signal.SIGINT, self._former)

    def check(self) -> None:
        """Where it can be acted upon.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        if self._noted:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._noted:
            signal.default_int_handler(number, frame)
        self._noted = True
