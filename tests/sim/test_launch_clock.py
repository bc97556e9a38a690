"""The clock of launches: what it adds up, and that it changes nothing."""

import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.sim.scenes import fidelity, ground_scene, interface_scene
from zoobench.sim import launch_clock
from zoobench.sim.launch_clock import VARIABLE, LaunchClock, LaunchTimes, watch
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver


class FakeLauncher:
    """Takes 1 s to launch and 2 s for each substep, 5 s for a survey, and at first 10 s and 2 s more to compile."""

    def __init__(self) -> None:
        self.now = 0.0
        self.advanced: list[int] = []
        self.surveys = 0

    def advance(self, plan: LaunchPlan, stride: int) -> None:
        """Count the substeps."""
        self.now += 1.0 + 2.0 * plan.world_substeps + (0.0 if self.advanced else 10.0)
        self.advanced.append(plan.world_substeps)

    def reverse(self, *, plan: LaunchPlan) -> None:
        """As long as an advance, without anything to compile."""
        self.now += 1.0 + 2.0 * plan.world_substeps

    def survey(self) -> None:
        """Has no plan."""
        self.now += 5.0 if self.surveys else 7.0
        self.surveys += 1


def plan_of(substeps: int) -> LaunchPlan:
    """For one world."""
    plan = LaunchPlan.none(1, torch.float32, "cpu")
    plan.set(np.zeros(1, np.int64), np.array([substeps]), np.ones(1))
    return plan


def test_calls_are_split_into_loading_launching_and_kernels() -> None:
    """However long the kernels take: launches of no substeps compile, and tell what a launch costs."""
    launcher = FakeLauncher()
    clock = LaunchClock(launcher, lambda: launcher.now)
    for substeps in (300, 100, 100, 100):
        launcher.advance(plan_of(substeps), 0)
    launcher.reverse(plan=plan_of(3))
    times = clock.times()
    assert times["advance"] == LaunchTimes(calls=4, loading_s=10.0, launching_s=4 * 1.0, kernel_s=1200.0)
    assert times["reverse"] == LaunchTimes(calls=1, loading_s=0.0, launching_s=1.0, kernel_s=6.0)
    assert (clock.launch_seconds("advance"), clock.launch_seconds("survey")) == (1.0, None)


def test_a_method_without_a_plan_is_known_by_its_calls() -> None:
    """What the first took longer than the others is loading; a single one tells nothing of it."""
    launcher = FakeLauncher()
    clock = LaunchClock(launcher, lambda: launcher.now)
    launcher.survey()
    assert clock.times() == {"survey": LaunchTimes(calls=1, loading_s=0.0, launching_s=0.0, kernel_s=7.0)}
    launcher.survey()
    launcher.survey()
    assert clock.times()["survey"] == LaunchTimes(calls=3, loading_s=2.0, launching_s=0.0, kernel_s=15.0)


def test_launches_of_no_substeps_are_not_among_the_calls() -> None:
    """The launcher is called as it was, and before the first time with nothing to do."""
    launcher = FakeLauncher()
    clock = LaunchClock(launcher, lambda: launcher.now)
    for _ in range(3):
        launcher.advance(plan_of(3), 0)
    assert [count for count in launcher.advanced if count] == [3, 3, 3]
    assert launcher.advanced.count(0) == len(clock.empty["advance"]) > 1


@pytest.mark.parametrize(("scene", "sleep"), [(ground_scene(), 0.0), (interface_scene(), 0.5)], ids=["awake", "sleep"])
def test_a_clock_changes_no_number(scene: Scene, sleep: float) -> None:
    """The launches of no substeps leave trajectory and gradient as they are, bit for bit, also where matter sleeps."""

    def gradient(timed: bool) -> tuple[np.ndarray, np.ndarray, dict[str, object]]:
        solver = Solver(scene, replace(fidelity(), sleep=sleep), gradients=True)
        clock = LaunchClock(solver.launcher) if timed else None
        rollout = solver.run(np.full((3, 1, solver.muscle_count), 0.5))
        ones = np.ones_like(rollout.positions)
        found = solver.backward(rollout, ones, ones)
        return rollout.positions, found.actuation, dict(clock.times()) if clock else {}

    plain, clocked = gradient(timed=False), gradient(timed=True)
    assert set(clocked[2]) >= {"advance", "reverse"}
    assert (plain[0] == clocked[0]).all()
    assert (plain[1] == clocked[1]).all()


@pytest.fixture
def at_exit(monkeypatch: pytest.MonkeyPatch) -> list[Callable[[], None]]:
    """What would be called at the end of this process; no launcher is watched yet."""
    called: list[Callable[[], None]] = []
    monkeypatch.setattr(launch_clock, "_clocks", [])
    monkeypatch.setattr(launch_clock.atexit, "register", lambda what, *given: called.append(partial(what, *given)))
    return called


def test_a_process_writes_what_its_launchers_took(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at_exit: list[Callable[[], None]]
) -> None:
    """One file at its end, if it is asked to: each launcher's calls, and the processor time of all it did."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    for _ in range(2):
        launcher = FakeLauncher()
        watch(launcher)
        launcher.advance(plan_of(1), 0)
    (write,) = at_exit
    write()
    (document,) = [json.loads(path.read_text()) for path in tmp_path.glob(f"{os.getpid()}.json")]
    assert [launches["advance"]["calls"] for launches in document["launches"]] == [1, 1]
    assert document["process_s"] > 0


def test_nothing_is_watched_unless_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, at_exit: list[Callable[[], None]]
) -> None:
    """The launcher keeps its own methods, and nothing is written."""
    monkeypatch.delenv(VARIABLE, raising=False)
    launcher = FakeLauncher()
    watch(launcher)
    assert vars(launcher).keys() == {"now", "advanced", "surveys"}
    assert at_exit == []


@pytest.mark.usefixtures("at_exit")
def test_every_launcher_is_watched(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Of every solver, however it is made."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    Solver(ground_scene(), fidelity()).substeps(1)
    (clock,) = launch_clock._clocks
    assert clock.times()["advance"].calls == 1


def test_work_is_timed_by_the_processor_and_on_a_gpu_by_the_wall(monkeypatch: pytest.MonkeyPatch) -> None:
    """There launches return at once: the clock waits until all are done."""
    waited = []
    monkeypatch.setattr(launch_clock.ti, "sync", lambda: waited.append("taichi"))
    monkeypatch.setattr(launch_clock.torch.cuda, "synchronize", lambda: waited.append("torch"))
    assert launch_clock.work_clock("cpu") is time.process_time
    clock = launch_clock.work_clock("cuda")
    assert waited == []
    first, second = clock(), clock()
    assert waited == ["taichi", "torch"] * 2
    assert first <= second <= time.perf_counter()
