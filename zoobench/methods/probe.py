"""The probe: not an optimiser, but a measurement of the same controllers at every fidelity."""

import math
import time
from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.inputs import checked_run_name, solution_in
from zoobench.methods.base import First, RunContext, Solution, Work, keep, report, resume
from zoobench.registry import Kind, register


@register(Kind.METHOD, "probe", version=2, tags=("study",))
@dataclass(frozen=True, kw_only=True)
class Probe:
    """Evaluate gaits one by one, the same at every fidelity, so that fidelities can be compared.

    A gait is the best that a stored run had found after some of its iterations, or a draw from the prior. The early
    gaits of all runs come before the late ones. The learning curve holds, at step n, of the n-th gait the number of its
    `run` in `of` and of its `stage` in that run, its `score_current` unless it diverged, the `particles` of its scene
    and the `cpu_seconds` of its episode [s]; the first episodes, without and with gradient, also build and compile. For
    the first gaits, numbered from 0, it also holds the gradient of the loss (`slope_0`, a step for each parameter).

    * `of`: names of stored runs of the same body and controller, separated by `+`; empty for draws.
    * `last`: gaits of each run, of which the last is its solution.
    * `gradients`: number of gaits with a gradient.
    """

    of: str = ""
    last: int = 4
    gradients: int = 0

    def __post_init__(self) -> None:
        if self.gradients < 0 or self.last < 1:
            raise UsageError(
                f"last={self.last}, gradients={self.gradients} is not possible. Give at least 1 and at least 0."
            )
        for name in self._runs():
            checked_run_name(name)

    def work(self, frames: int) -> Work:
        """A gait, its gradient shared out among all."""
        share = min(1.0, self.gradients / max(1, self.last * len(self._runs())))
        return Work(frames=(1.0 - share) * frames, gradient_frames=share * frames)

    def first(self, frames: int) -> First:
        """A gait."""
        return First(1, gradient_frames=frames) if self.gradients else First(1, frames=frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Evaluate until the gaits or the budget are spent; the solution is the best gait."""
        incumbent, meter = resume(problem, context), problem.meter
        gaits = self._gaits()
        while (not gaits or meter.iterations < len(gaits)) and (problem.affords() or not meter.episodes):
            # the first is always tried, so that the problem reports a budget too small for it
            number = meter.iterations
            run, stage, params = gaits[number] if gaits else (number, 0, problem.initial(context.rng))
            begin = time.process_time()
            episode = problem.episode(params, gradient=number < self.gradients)
            readings = {"cpu_seconds": time.process_time() - begin, "run": run, "stage": stage}
            if episode.recorded is not None:
                readings["particles"] = episode.recorded.scene.particle_count
            if episode.evaluation.failure is None:
                readings["score_current"] = episode.evaluation.score
                _report_gradient(number, context, episode.gradient)
            incumbent.offer(params, episode.evaluation)
            meter.iterations += 1
            report(problem, context, incumbent, readings, share=meter.iterations / len(gaits) if gaits else 0.0)
            keep(problem, context, incumbent)
            if context.should_stop():
                break
        return incumbent.solution(iterations=meter.iterations)

    def _runs(self) -> list[str]:
        return [name for name in self.of.split("+") if name]

    def _gaits(self) -> list[tuple[int, int, Array]]:
        """Number of the run, stage in it, and parameters `[parameter_count]` of every gait."""
        found = []
        for number, name in enumerate(self._runs()):
            stored = solution_in(name)
            stages = list(enumerate(dict.fromkeys((*stored.milestones, stored.params))))[-self.last :]
            found += [(place, number, stage, np.array(params)) for place, (stage, params) in enumerate(stages)]
        return [gait[1:] for gait in sorted(found, key=lambda gait: gait[:3])]


def _report_gradient(number: int, context: RunContext, gradient: Array) -> None:
    """Report the gradient `[parameter_count]` of the gait with this number; nothing of an empty one."""
    for step, value in enumerate(gradient.tolist()):
        if math.isfinite(value):
            context.report(step, **{f"slope_{number}": value})
