"""Ctrl-C that is never lost."""

import signal
import threading

import pytest

from zoobench.harness.interruption import Interruption


def test_the_first_is_raised_where_it_can_be_acted_upon_the_second_at_once() -> None:
    """And afterwards Ctrl-C does what it did before."""
    before = signal.getsignal(signal.SIGINT)
    with Interruption() as interruption:
        interruption.check()
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            interruption.check()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_thread_leaves_signals_alone() -> None:
    """Only the main thread may set their handlers."""
    seen = []

    def look() -> None:
        with Interruption() as interruption:
            interruption.check()
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert seen == [signal.getsignal(signal.SIGINT)]
