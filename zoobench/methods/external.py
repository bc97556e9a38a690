"""An agent that was trained elsewhere: an episode of it under the meter, kept as a trajectory that can be repeated."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from typing import TYPE_CHECKING, Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.cell.session import new_session
from zoobench.errors import DivergenceError, UsageError
from zoobench.inputs import NO_FILE, InputFile, path_of, read
from zoobench.methods.base import First, RunContext, Solution, Work, keep, report, resume
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from zoobench.gym.channels import Floats

Policy = Callable[["Floats"], "Floats"]

EPISODES = 2
"""The budget of a submission: the agent's own episode, and the trajectory played again."""

_LARGEST = 1.0 - 1e-9
"""Largest activity that the controller `trajectory` can have, a hyperbolic tangent."""


@register(Kind.METHOD, "external", tags=("external", "given-body"), added=("weights",))
@dataclass(frozen=True, kw_only=True)
class External:
    """Evaluate an agent that was trained elsewhere; `zoobench submit` makes such a run.

    The agent acts for an episode, as in the environment of Gymnasium with the same name. The muscles' activity is the
    solution, parameters of the controller `trajectory`. It is played again without the agent, and that is the score;
    `score_acting` is that of the agent's own episode. The cost of its training is not known.

    * `policy`: a Python file with the agent.
    * `function`: in it, from the observation of a control frame to the action.
    * `action`: waves or muscles, see `zoobench.gym.channels.Channels`.
    * `weights`: a file that the agent reads; it is checked for changes only.
    * `agent`: a name for tables.
    """

    policy: InputFile
    function: str = "act"
    action: Literal["waves", "muscles"] = "waves"
    weights: InputFile = NO_FILE
    agent: str = ""

    def work(self, frames: int) -> Work:
        """Two episodes."""
        return Work(frames=EPISODES * frames, iterations=1)

    def first(self, frames: int) -> First:
        """Both episodes, whose substeps are known only as they are simulated."""
        return First(EPISODES)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Let the agent act for an episode, and play it again.

        Raises:
            UsageError: the controller is not a trajectory as long as the episode, the agent cannot be loaded, or it
                gives something that is no action.
            DivergenceError: the simulation diverges.
        """
        _check_controller(problem)
        incumbent = resume(problem, context)
        policy = self._policy()
        parameters, acting = self._act(problem, policy)
        evaluation = problem.evaluate(parameters)
        incumbent.offer(parameters, evaluation)
        problem.meter.iterations += 1
        report(problem, context, incumbent, {"score_current": evaluation.score}, share=1.0)
        keep(problem, context, incumbent)
        return incumbent.solution(iterations=1, score_acting=acting)

    def _policy(self) -> Policy:
        """The agent, of a file with the digest that the run's settings have."""
        read(self.policy)
        if self.weights:
            read(self.weights)
        path = path_of(self.policy).resolve()
        spec = spec_from_file_location(f"zoobench_agent_{path.stem}", path)
        if spec is None or spec.loader is None:
            raise UsageError(f"{str(path)!r} is no Python file. Give one that ends in .py.")
        sys.path.insert(0, str(path.parent))  # for modules that it imports from its folder
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        policy = getattr(module, self.function, None)
        if not callable(policy):
            raise UsageError(f"{path.name} has no function {self.function!r}. Name one that takes an observation.")
        found: Policy = policy
        return found

    def _act(self, problem: Problem, policy: Policy) -> tuple[Array, float]:
        """An episode of the agent: parameters of the controller `trajectory` `[parameter_count]`, and the score."""
        from zoobench.gym.worlds import Worlds

        session = new_session(problem, 1, keeps_history=True)
        worlds = Worlds.of(session, self.action)
        seen, activity = worlds.begin([np.random.default_rng(0)]), []
        while True:
            action = np.asarray(policy(seen[0]), dtype=np.float32).reshape(-1)
            seen, step = worlds.step(action[None])
            activity.append(np.clip(session.activity(0), -_LARGEST, _LARGEST))
            if step.failures:
                raise DivergenceError(step.failures[0])
            if step.evaluations:
                return np.arctanh(activity).reshape(-1), step.evaluations[0].score


def _check_controller(problem: Problem) -> None:
    """Refuse a controller that cannot hold the agent's activity."""
    spec = problem.spec
    if spec.controller.name != "trajectory" or spec.controller.kwargs["frames"] != spec.frames:
        raise UsageError(
            f"external needs --controller 'trajectory[frames={spec.frames}]', and {spec.controller} was given."
        )
