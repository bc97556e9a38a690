"""The probe: not an optimiser, but a measurement of the same controllers in every simulation."""

from dataclasses import dataclass

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.episode import Episode
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.methods.base import RunContext, Solution, keep, report, resume
from zoobench.registry import Kind, register
from zoobench.spec import Ref

EVERY = 5
"""Control frames between two recorded points of a trajectory."""

PATHS = ("path_x", "path_y", "path_z")
SPREADS = ("spread_xx", "spread_yy", "spread_zz", "spread_yz", "spread_xz", "spread_xy")


@register(Kind.METHOD, "probe", tags=("study",))
@dataclass(frozen=True, kw_only=True)
class Probe:
    """Evaluate draws from the prior one by one, the same at every fidelity, so that fidelities can be compared.

    The learning curve holds, at step n, `score_current` of the n-th draw and its `score_TASK` in every further task; it
    has no value if the draw diverged. For the first draws, numbered from 0, it also holds the gradient of the loss
    (`slope_0`, a step for each parameter) and, by control frame, the displacement of the centre of mass (`path_x_0` and
    so on [m]) and the second moments of the body's mass about it (`spread_xx_0` and so on [m^2]).

    * `gradients`: number of draws with gradient and trajectory.
    * `also`: names of further tasks that score the same motions, separated by `+`.
    """

    gradients: int = 0
    also: str = ""

    def __post_init__(self) -> None:
        if self.gradients < 0:
            raise UsageError(f"{self.gradients} gradients are not possible. Give 0 or more.")
        for name in self._further():
            registry.get(Kind.TASK, name)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Draw and evaluate until the budget is spent; the solution is the best draw."""
        incumbent = resume(problem, context)
        while problem.affords(gradient=self._is_close(problem)) or not problem.meter.episodes:
            # the first draw is always tried, so that the problem reports a budget too small for it
            params = problem.initial(context.rng)
            close = self._is_close(problem)
            episode = problem.episode(params, gradient=close)
            incumbent.offer(params, episode.evaluation)
            problem.meter.iterations += 1
            report(problem, context, incumbent, self._readings(episode))
            if close and episode.evaluation.failure is None:
                _report_closely(problem.meter.iterations - 1, context, episode)
            keep(problem, context, incumbent)
            if context.should_stop():
                break
        return incumbent.solution(iterations=problem.meter.iterations)

    def _further(self) -> list[str]:
        return [name for name in self.also.split("+") if name]

    def _is_close(self, problem: Problem) -> bool:
        """Whether gradient and trajectory of the next draw are recorded."""
        return problem.meter.iterations < self.gradients

    def _readings(self, episode: Episode) -> dict[str, float]:
        """The scores of a draw; none if it diverged."""
        if episode.evaluation.failure is not None:
            return {}
        return {"score_current": episode.evaluation.score} | {
            f"score_{name}": float(registry.create(Kind.TASK, Ref(name)).score(episode.record.motion).detach())
            for name in self._further()
        }


def _report_closely(number: int, context: RunContext, episode: Episode) -> None:
    """Report gradient, trajectory and second moments of the draw with this number."""
    for step, value in enumerate(episode.gradient.tolist()):
        if np.isfinite(value):
            context.report(step, **{f"slope_{number}": value})
    path, spread = path_and_spread(episode)
    for place, values in enumerate(np.hstack([path, spread]).tolist()):
        readings = {f"{name}_{number}": value for name, value in zip(PATHS + SPREADS, values, strict=True)}
        context.report(EVERY * place, **readings)


def path_and_spread(episode: Episode) -> tuple[Array, Array]:
    """At every `EVERY`-th frame, displacement `[points, 3]` [m] and second moments `[points, 6]` [m^2] of the mass."""
    motion = episode.record.motion
    centre = motion.centre_of_mass()[::EVERY, 0].detach().numpy()
    path: Array = centre - centre[0]
    return path, motion.second_moments()[::EVERY, 0].detach().numpy()
