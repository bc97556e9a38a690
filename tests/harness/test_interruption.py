"""Ctrl-C that is never lost."""

import signal
import threading

import pytest

from zoobench.harness.interruption import Interruption


def test_the_first_is_raised_where_it_can_be_acted_upon_the_second_at_once(ctrl_c: None) -> None:
    """And afterwards Ctrl-C does what it did before."""
    with Interruption() as interruption:
        interruption.check()
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            interruption.check()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_ignores_ctrl_c_goes_on_ignoring_it(ctrl_c: None) -> None:
    """A job in the background is not meant by it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with Interruption() as interruption:
        signal.raise_signal(signal.SIGINT)
        interruption.check()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


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
