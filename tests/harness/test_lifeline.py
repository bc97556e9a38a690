"""A process reads its orders line by line and notices the end of its parent."""

import os
import subprocess
import sys
import threading

from zoobench.harness.lifeline import Lifeline


def test_lines_of_any_length_arrive_whole() -> None:
    """A job with a large checkpoint is longer than a pipe holds; two lines may come in one piece."""
    reading, writing = os.pipe()
    long = b"x" * 1_000_000
    writer = threading.Thread(target=_write, args=(writing, long + b"\nsecond\nthird\n"))
    writer.start()
    lifeline = Lifeline(reading)
    assert lifeline.line() == long
    assert lifeline.line() == b"second"
    assert lifeline.line() == b"third"
    assert lifeline.line() is None
    writer.join()
    os.close(reading)


def test_the_watcher_tells_lines_and_the_end() -> None:
    """What comes after the first line is told as it comes, the end once."""
    reading, writing = os.pipe()
    lines: list[bytes] = []
    ended = threading.Event()
    Lifeline(reading).watch(on_line=lines.append, on_end=ended.set)
    _write(writing, b"stop\n")
    assert ended.wait(10.0)
    assert lines == [b"stop"]
    os.close(reading)


def test_standard_input_is_taken_whole() -> None:
    """Orders come through it, and what other code does with standard input ends nobody."""
    code = (
        "import os, sys; from zoobench.harness.lifeline import Lifeline, take_standard_input; "
        "lifeline = Lifeline(take_standard_input()); print(sys.stdin.read() == ''); sys.stdin.close(); "
        "print(lifeline.line().decode())"
    )
    done = subprocess.run([sys.executable, "-c", code], input="an order\n", capture_output=True, text=True, check=True)
    assert done.stdout == "True\nan order\n"


def _write(descriptor: int, data: bytes) -> None:
    with os.fdopen(descriptor, "wb") as stream:
        stream.write(data)
