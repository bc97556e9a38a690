"""Reading a pipe line by line in a thread of its own, with bounded memory."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import IO, NamedTuple

_CHUNK = 1 << 16


class PipedLine(NamedTuple):
    """A line without its end; `is_cut` if there was more of it than the reader keeps."""

    content: bytes
    is_cut: bool


class LineReader:
    """Hands the lines of a stream on until its end.

    Args:
        stream: a pipe, which nobody else reads.
        longest: so much of each line is kept [bytes].
        take: called with every line.
        most: after so many lines, only the last of what is there at once is handed on, so that a flood costs little;
            `allow` begins to count anew.
    """

    def __init__(
        self, stream: IO[bytes], longest: int, take: Callable[[PipedLine], None], most: int = sys.maxsize
    ) -> None:
        self._stream, self._longest, self._take, self._left = stream, longest, take, most
        self._waits_since: float | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def allow(self, most: int) -> None:
        """Hand on so many lines from now on, while nobody writes."""
        self._left = most

    def join(self, timeout: float) -> None:
        """Wait for the end of the stream, `timeout` [s] at most."""
        self._thread.join(timeout)

    @property
    def is_alive(self) -> bool:
        """Whether the end of the stream was not reached yet."""
        return self._thread.is_alive()

    def is_at_work(self, since: float, patience: float) -> bool:
        """Whether more is to come of it: not at the end of the stream, nor after a silence of `patience` [s].

        Args:
            since: a silence before this does not count; of the monotonic clock [s].
            patience: of the one who asks [s].
        """
        waits = self._waits_since
        return self.is_alive and (waits is None or time.monotonic() - max(waits, since) < patience)

    def _run(self) -> None:
        for line in self._lines():
            self._take(line)

    def _lines(self) -> Iterator[PipedLine]:
        parts: list[bytes] = []
        size = 0
        while chunk := self._read():
            *ends, rest = chunk.split(b"\n")
            if self._left <= 0 and len(ends) > 1:
                parts, size, ends = [], 0, ends[-1:]
            self._left -= len(ends)
            for end in ends:
                yield self._line([*parts, end], size + len(end))
                parts, size = [], 0
            if size < self._longest:
                parts.append(rest[: self._longest - size])
            size += len(rest)
        if size:
            yield self._line(parts, size)

    def _line(self, parts: list[bytes], size: int) -> PipedLine:
        return PipedLine(b"".join(parts)[: self._longest], size > self._longest)

    def _read(self) -> bytes:
        self._waits_since = time.monotonic()
        chunk = self._stream.read1(_CHUNK)  # type: ignore[attr-defined]  # a buffered pipe
        self._waits_since = None
        return bytes(chunk)
