"""Processor time inside a launcher's calls, measured from outside, for `zoobench verify bench`.

With ZOOBENCH_LAUNCH_CLOCK=FOLDER in the environment every process that simulates writes into that folder what it has
spent in its launches, as `PID.json`, when it ends.
"""

import atexit
import json
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import taichi as ti
import torch

from zoobench.sim.model.fidelity import Device
from zoobench.sim.model.launch_plan import LaunchPlan

VARIABLE = "ZOOBENCH_LAUNCH_CLOCK"

TIMED = ("advance", "reverse", "survey")
_EMPTY_LAUNCHES = 15

_clocks: list["LaunchClock"] = []

if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_clocks.clear)  # what was spent before is told by the other process


@dataclass(frozen=True)
class LaunchTimes:
    """Processor seconds of all calls of one method of a launcher.

    Attributes:
        loading_s: compiling its kernel, or loading it from the cache.
        launching_s: cost of the launches themselves; 0 where it is not known.
        kernel_s: the rest.
    """

    calls: int
    loading_s: float
    launching_s: float
    kernel_s: float


class LaunchClock:
    """Times the calls of one launcher from now on.

    Before the first call of a method with a `LaunchPlan` the same is launched with no substeps in any world, which
    changes nothing: the first time it compiles, and then it costs what a launch does. A method without a plan, as the
    survey, is known by its calls alone: its first one compiles, and is compared with the others.

    Args:
        launcher: its methods are replaced by timed ones.
        seconds: the clock [s].

    Attributes:
        spent: seconds of every call by method, in their order.
        empty: seconds of the launches of no substeps by method, in their order.
    """

    def __init__(self, launcher: Any, seconds: Callable[[], float] = time.process_time) -> None:
        self._seconds = seconds
        self.spent: dict[str, list[float]] = {name: [] for name in TIMED}
        self.empty: dict[str, list[float]] = {name: [] for name in TIMED}
        for name in TIMED:
            setattr(launcher, name, self._timed(name, getattr(launcher, name)))

    def times(self) -> dict[str, LaunchTimes]:
        """What was spent so far, by method that was called."""
        return {name: self._times(name) for name in TIMED if self.spent[name]}

    def launch_seconds(self, name: str) -> float | None:
        """Seconds of a launch of no substeps; None if none was made."""
        return statistics.median(self.empty[name][1:]) if self.empty[name] else None

    def _times(self, name: str) -> LaunchTimes:
        spent, cost = self.spent[name], self.launch_seconds(name)
        if cost is not None:
            launching = cost * len(spent)
            return LaunchTimes(len(spent), self.empty[name][0] - cost, launching, sum(spent) - launching)
        loading = max(0.0, spent[0] - statistics.median(spent[1:])) if len(spent) > 1 else 0.0
        return LaunchTimes(len(spent), loading, 0.0, sum(spent) - loading)

    def _timed(self, name: str, method: Callable[..., None]) -> Callable[..., None]:
        def timed(*arguments: Any, **named: Any) -> None:
            if not self.spent[name]:
                self._launch_empty(name, method, arguments, named)
            self.spent[name].append(self._measure(method, *arguments, **named))

        return timed

    def _measure(self, method: Callable[..., None], *arguments: Any, **named: Any) -> float:
        begin = self._seconds()
        method(*arguments, **named)
        return self._seconds() - begin

    def _launch_empty(
        self, name: str, method: Callable[..., None], arguments: tuple[Any, ...], named: dict[str, Any]
    ) -> None:
        plans = [each for each in (*arguments, *named.values()) if isinstance(each, LaunchPlan)]
        if plans:
            worlds, particles = plans[0].order.shape
            empty = LaunchPlan.none(worlds, plans[0].dt.dtype, str(plans[0].dt.device), particles)
            emptied = [empty if isinstance(each, LaunchPlan) else each for each in arguments]
            also = {key: empty if isinstance(each, LaunchPlan) else each for key, each in named.items()}
            for _ in range(1 + _EMPTY_LAUNCHES):
                self.empty[name].append(self._measure(method, *emptied, **also))


def work_clock(device: Device) -> Callable[[], float]:
    """Seconds of work so far: of the processor's time, and on CUDA of wall time once all launches are done."""

    def after_all() -> float:
        ti.sync()
        torch.cuda.synchronize()
        return time.perf_counter()

    return after_all if device == "cuda" else time.process_time


def watch(launcher: Any) -> None:
    """Time this launcher's calls and write them at the end of the process, if the environment asks for it."""
    if os.environ.get(VARIABLE):
        _write_at_exit()
        _clocks.append(LaunchClock(launcher))


@cache
def _write_at_exit() -> None:
    atexit.register(_write)


def _write() -> None:
    folder = Path(os.environ[VARIABLE])
    launches = [{name: asdict(times) for name, times in clock.times().items()} for clock in _clocks]
    (folder / f"{os.getpid()}.json").write_text(json.dumps({"process_s": time.process_time(), "launches": launches}))
