"""The child process of a worker, which does one run after the other as long as it is what a new one would be."""

import os
from collections.abc import Callable
from typing import Any, NamedTuple, Self

from zoobench.db.rows import Claim
from zoobench.harness.process import ChildProcess, Process
from zoobench.harness.provenance import plugins_of
from zoobench.inputs import Start
from zoobench.spec import on_gpu


class _Beginning(NamedTuple):
    """What a process would begin with now: one that began with the same does the next run, too.

    Sources, packages and settings of the machine; plug-ins; the environment, of which libraries read some when they are
    loaded; the stored runs of which bodies and controllers are made; and whether a GPU is used.
    """

    origin: dict[str, Any]
    plugins: list[dict[str, dict[str, str | None]]]
    environment: dict[str, str]
    stored: tuple[Start, ...]
    on_gpu: bool


class Executor:
    """Has the runs of one worker done; used as a context, at whose end its child process ends.

    The child ends by itself after a run that did not end well or has left something behind, see
    `zoobench.harness.child`. To be used by one thread, which must live as long as it.

    Args:
        start: starts a process.
    """

    def __init__(self, start: Callable[[], Process]) -> None:
        self._start = start
        self._child: ChildProcess | None = None
        self._beginning: _Beginning | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._child is not None:
            self._child.end()
            self._child = None

    def child_for(self, claim: Claim, origin: dict[str, Any]) -> ChildProcess:
        """An idle process for a run: that of the last run, or a new one.

        Args:
            claim: the run.
            origin: what `provenance.gather` gives where the process is.
        """
        plugins = [plugins_of(spec) for spec in (claim.spec, *(each.spec for each in claim.stored))]
        beginning = _Beginning(origin, plugins, dict(os.environ), claim.stored, on_gpu(claim.spec))
        if self._child is None or not self._child.is_idle or beginning != self._beginning:
            self.__exit__()
            self._child, self._beginning = ChildProcess(self._start()), beginning
        return self._child
