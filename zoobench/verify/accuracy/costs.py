"""Wall time of each simulation of the study on this machine.

The study's runs share the machine, so they are not timed. Here one simulation runs at a time, those of an environment
in turn and repeatedly, so that a machine that slows down does so for all of them.
"""

import math
import statistics
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import torch

from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec
from zoobench.verify.accuracy.records import FidelityCost, label

ENOUGH_SECONDS = 0.5
"""Approximate duration of a measured forward episode, which has two frames at least."""

LONGEST_FRAMES = 50


@dataclass
class _Subject:
    """One simulation with the times of its episodes [ns per particle and forward substep]."""

    spec: RunSpec
    has_gradients: bool
    forward: list[float] = field(default_factory=list)
    gradient: list[float] = field(default_factory=list)
    compile_seconds: float = 0.0
    particles: int = 0

    def warm_up(self) -> None:
        """Compile, and choose the length of the measured episodes."""
        first, second = (self._time(gradient=self.has_gradients)[0] for _ in range(2))
        self.compile_seconds = max(0.0, first - second)
        frame = self._time(gradient=False)[0] / self.spec.frames
        frames = min(max(2, math.ceil(ENOUGH_SECONDS / frame)), LONGEST_FRAMES)
        self.spec = replace(self.spec, frames=frames)

    def measure(self) -> None:
        """Time one more episode forward and, where the study computes gradients, one with its gradient."""
        self.forward.append(self._rate(gradient=False))
        if self.has_gradients:
            self.gradient.append(self._rate(gradient=True))

    def cost(self) -> FidelityCost:
        """The medians and extremes."""
        both = self.gradient or [math.nan]
        return FidelityCost(
            env=self.spec.env,
            fidelity=self.spec.fidelity,
            particles=self.particles,
            forward=statistics.median(self.forward),
            forward_least=min(self.forward),
            forward_most=max(self.forward),
            gradient=statistics.median(both),
            gradient_least=min(both),
            gradient_most=max(both),
            compile_seconds=self.compile_seconds,
        )

    def _rate(self, *, gradient: bool) -> float:
        seconds, substeps = self._time(gradient=gradient)
        return 1e9 * seconds / (substeps * self.particles)

    def _time(self, *, gradient: bool) -> tuple[float, int]:
        """Wall time [s] of an episode, without building and equilibrating the scene, and its forward substeps."""
        problem = Problem(self.spec, worlds=1)
        self.particles = problem.scene.particle_count
        params = problem.initial(np.random.default_rng(0))
        problem.prepare(gradient=gradient)
        begin = time.perf_counter()
        problem.episode(params, gradient=gradient)
        return time.perf_counter() - begin, problem.meter.forward


def costs(
    specs: Iterable[RunSpec], *, repeats: int = 3, on_case: Callable[[str], None] = lambda _: None
) -> Iterator[FidelityCost]:
    """Time every environment and fidelity of the study's runs, those of one precision and environment in turn.

    Gradients are timed where the study computes them.

    Raises:
        UsageError: fewer than one repeat.
    """
    if repeats < 1:
        raise UsageError(f"{repeats} repeats measure nothing. Give at least 1.")
    torch.set_num_threads(1)  # as in a run: one thread per simulation
    for group in _groups(specs):
        for subject in group:
            on_case(f"{subject.spec.env.name} {label(Kind.FIDELITY, subject.spec.fidelity)}")
            subject.warm_up()
        for _ in range(repeats):
            for subject in group:
                subject.measure()
        yield from (subject.cost() for subject in group)


def _groups(specs: Iterable[RunSpec]) -> list[list[_Subject]]:
    """Simulations to time in turn: of an environment in one precision, since another one restarts the runtime."""
    groups: dict[tuple[str, int], dict[tuple[Ref, Ref], _Subject]] = {}
    for spec in specs:
        if spec.fidelity.kwargs["shift"]:
            continue  # the same work as without
        precision = registry.create(Kind.FIDELITY, spec.fidelity).precision
        group = groups.setdefault((spec.env.name, precision), {})
        timed = replace(spec, frames=2, budget=Budget("episodes", 1000))
        subject = group.setdefault((spec.env, spec.fidelity), _Subject(timed, has_gradients=False))
        subject.has_gradients |= int(spec.method.kwargs["gradients"]) > 0
    return [list(group.values()) for group in groups.values()]
