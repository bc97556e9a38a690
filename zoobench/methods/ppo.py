"""Proximal policy optimisation (specification F.2): reinforcement learning of a policy network."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.cell.session import Session, new_session
from zoobench.errors import BudgetExhaustedError, UsageError
from zoobench.methods.base import Champion, RunContext, Solution, pack, report, resume, unpack
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from zoobench.gym.learner import Learner

_POLICY = "policy"
"""Tag of a controller that is a network for this method, and of methods that need one."""


@register(Kind.METHOD, "ppo", tags=("policy",))
@dataclass(frozen=True, kw_only=True)
class Ppo:
    """Proximal policy optimisation (Schulman et al. 2017) of the controller `policy-network`, by stable-baselines3.

    A policy acts in all worlds at once until a buffer is full of frames, and learns from them. Then the policy without
    its exploration, which is a controller like any other, is evaluated in an episode; the best one met is the solution.
    Those episodes are metered as the others are.

    * `timesteps`: frames to learn from, rounded up to whole buffers; 0 for as many as the budget holds.
    * `buffer`: frames that are learnt from at once, of all worlds together.
    * `batch`: of a step of the optimiser; `epochs`: passes over the buffer.
    * `gae`: lambda of the generalised advantage estimation; `discount`: of rewards, for a frame.
    * `entropy`: its coefficient; `lr`: learning rate; `clip`: of the ratio of new to old probability.
    * `worlds`: how many episodes run side by side; the buffer must be a multiple.
    * `deviation`: of the exploration at first, in every weight and bias of the waves.

    A run that was interrupted begins its episodes anew, so that it is not the uninterrupted one bit for bit: `resumed`
    counts how often that happened.
    """

    timesteps: int = 100_000
    buffer: int = 2048
    batch: int = 32
    epochs: int = 20
    gae: float = 0.95
    discount: float = 0.98
    entropy: float = 0.001
    lr: float = 1e-4
    clip: float = 0.2
    worlds: int = 8
    deviation: float = 0.3

    def __post_init__(self) -> None:
        positive = ("buffer", "epochs", "lr", "clip", "worlds", "deviation")
        for name in positive:
            if getattr(self, name) <= 0:
                raise UsageError(f"ppo[{name}={getattr(self, name):g}] learns nothing. Give a positive {name}.")
        if self.timesteps < 0 or self.entropy < 0 or not (0 <= self.gae <= 1 and 0 <= self.discount <= 1):
            raise UsageError(
                f"timesteps={self.timesteps}, entropy={self.entropy:g}, gae={self.gae:g}, discount={self.discount:g}: "
                "give 0 or more timesteps and entropy, and gae and discount in [0, 1]."
            )
        if self.buffer % self.worlds or not 2 <= self.batch <= self.buffer:
            raise UsageError(
                f"A buffer of {self.buffer} cannot be filled by {self.worlds} worlds and learnt from by batches of "
                f"{self.batch}. Give a multiple of the worlds, and a batch from 2 up to it."
            )

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Learn until the budget does not hold a further buffer and the evaluation after it.

        Raises:
            UsageError: the controller is no policy, the body a design space, or stable-baselines3 is not installed.
            DivergenceError, BudgetExhaustedError: as of every method.
        """
        hidden = _hidden(problem)
        stored = context.restore()
        champion = resume(problem, context)
        start = problem.initial(context.rng)
        session = new_session(problem, self.worlds)
        with _own_randomness(int(context.rng.integers(2**31))):
            learner = self._learner(session, start, hidden)
            course = _Course(problem, context, session, learner, champion)
            if stored is not None:
                course.load(unpack(stored))
            self._demand_a_buffer(course)
            while self._goes_on(course) and course.go_on():
                self._report(course)
                context.checkpoint(pack(course.state()))
                if context.should_stop():
                    break
        return course.solution()

    def _learner(self, session: Session, start: Array, hidden: int) -> "Learner":
        try:
            from zoobench.gym.learner import Learner
            from zoobench.gym.vector import ZooVectorEnv
        except ModuleNotFoundError as error:
            raise UsageError(
                f"ppo needs {error.name}, which is not installed. Try: pip install 'zoobench[ppo]'."
            ) from None
        settings = {
            "n_steps": self.buffer // self.worlds,
            "batch_size": self.batch,
            "n_epochs": self.epochs,
            "gae_lambda": self.gae,
            "gamma": self.discount,
            "ent_coef": self.entropy,
            "learning_rate": self.lr,
            "clip_range": self.clip,
        }
        return Learner(ZooVectorEnv.of(session), start, hidden, self.deviation, settings)

    def _affords(self, course: "_Course") -> bool:
        return course.session.affords(self.buffer // self.worlds, evaluations=1)

    def _goes_on(self, course: "_Course") -> bool:
        return (not self.timesteps or course.learner.timesteps < self.timesteps) and self._affords(course)

    def _demand_a_buffer(self, course: "_Course") -> None:
        problem = course.problem
        if problem.meter.iterations or self._affords(course):
            return
        raise BudgetExhaustedError(
            f"The budget of {problem.spec.budget} does not hold a first buffer of {self.buffer} frames and an "
            f"evaluation of {problem.spec.frames}. Give a larger budget or a smaller buffer."
        )

    def _report(self, course: "_Course") -> None:
        learner = course.learner
        readings = {"timesteps": float(learner.timesteps), "deviation": learner.deviation}
        readings["reward_explored"] = course.reward
        if course.score is not None:
            readings["score_current"] = course.score
        share = learner.timesteps / self.timesteps if self.timesteps else 0.0
        report(course.problem, course.context, course.champion, readings, share=share)


class _Course:
    """One run: what has been learnt, and the best policy so far.

    Attributes:
        reward: mean of the last buffer, with exploration.
        score: of the policy after it, without exploration; None if the episode failed.
    """

    def __init__(
        self, problem: Problem, context: RunContext, session: Session, learner: "Learner", champion: Champion
    ) -> None:
        self.problem, self.context, self.session = problem, context, session
        self.learner, self.champion = learner, champion
        self.reward = 0.0
        self.score: float | None = None
        self._resumed = 0
        self._is_resumed = False

    def go_on(self) -> bool:
        """Learn from one buffer and evaluate what came of it; False if the budget ended in between.

        So it may where it counts seconds, or episodes that end early, since those are begun again, or substeps, of
        which exploring may take more than was expected.
        """
        try:
            self.reward = self.learner.learn()
            params = self.learner.actor
            evaluation = self.problem.evaluate(params)
        except BudgetExhaustedError:
            if not self.problem.meter.iterations:
                raise
            return False
        self.champion.offer(params, evaluation)
        self.score = evaluation.score if evaluation.failure is None else None
        self.problem.meter.iterations += 1
        self._resumed += int(self._is_resumed)
        self._is_resumed = False
        return True

    def solution(self) -> Solution:
        """The end of the run."""
        return self.champion.solution(
            iterations=self.problem.meter.iterations,
            timesteps=self.learner.timesteps,
            diverged_episodes=self.session.failures,
            resumed=self._resumed,
        )

    def state(self) -> dict[str, Any]:
        """Plain data for a checkpoint."""
        return {
            "champion": self.champion.state(),
            "meter": self.problem.meter.state(),
            "rng": self.context.rng.bit_generator.state,
            "learner": self.learner.state(),
            "failures": self.session.failures,
            "resumed": self._resumed,
        }

    def load(self, state: dict[str, Any]) -> None:
        """The learner and the counts of `state`; the rest is `resume`'s."""
        self.learner.load(state["learner"])
        self.session.failures, self._resumed, self._is_resumed = state["failures"], state["resumed"], True


def _hidden(problem: Problem) -> int:
    """Units of the policy's hidden layers."""
    ref = registry.resolve(Kind.CONTROLLER, problem.spec.controller)
    if _POLICY not in registry.get(Kind.CONTROLLER, ref.name, ref.version).tags:
        raise UsageError(
            f"ppo trains a policy, and the controller {ref.name!r} is none. "
            "Choose one that is: --controller policy-network."
        )
    return int(ref.kwargs["hidden"])


@contextmanager
def _own_randomness(seed: int) -> Iterator[None]:
    """What stable-baselines3 draws follows from the seed, on one thread; everybody else's draws stay as they were."""
    import torch

    threads, numpys = torch.get_num_threads(), np.random.get_state()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        np.random.seed(seed)
        torch.set_num_threads(1)
        try:
            yield
        finally:
            np.random.set_state(numpys)
            torch.set_num_threads(threads)
