"""A process reads its orders line by line and notices the end of its parent."""

import os
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


def _write(descriptor: int, data: bytes) -> None:
    with os.fdopen(descriptor, "wb") as stream:
        stream.write(data)
