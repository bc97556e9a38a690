"""Proximal policy optimisation (SoftZoo's paper, F.2): reinforcement learning of a policy network."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.cell.session import Session, new_session
from zoobench.errors import BudgetExhaustedError, UsageError, extra
from zoobench.methods.base import First, Incumbent, RunContext, Solution, Work, keep, report, resume, unpack
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from zoobench.gym.learner import Learner

_POLICY = "policy"
"""Tag of controllers that this method can train, and of methods that need such a controller."""


@register(Kind.METHOD, "ppo", version=2, tags=("policy", "given-body"), extra="ppo")
@dataclass(frozen=True, kw_only=True)
class Ppo:
    """Proximal policy optimisation (Schulman et al. 2017) of the controller `policy-network`, by stable-baselines3.

    The policy acts in all worlds until a buffer of frames is full, and is updated from it. Then the policy without
    exploration, a controller like any other, is evaluated in an episode of its own; the best policy evaluated is the
    solution. All episodes are metered.

    * `timesteps`: frames to learn from, rounded up to whole buffers; 0 for as many as the budget allows.
    * `buffer`: frames per update in all worlds together, `n_steps` times the worlds in Stable-Baselines3.
    * `batch`: frames per optimiser step (`batch_size`).
    * `epochs`: passes over the buffer (`n_epochs`).
    * `gae`: lambda of the generalised advantage estimation (`gae_lambda`).
    * `discount`: factor per frame (`gamma`).
    * `entropy`: entropy coefficient (`ent_coef`).
    * `lr`: learning rate (`learning_rate`).
    * `clip`: limit of the ratio of new to old probability (`clip_range`).
    * `worlds`: episodes simulated in parallel; the buffer must be a multiple.
    * `deviation`: initial standard deviation of the exploration, in every weight and bias of the waves.

    A resumed run begins its episodes again, so that it differs from an uninterrupted one; `resumed` counts how often.
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
                raise UsageError(f"ppo[{name}={getattr(self, name):g}] cannot be used. Give a positive {name}.")
        if self.timesteps < 0 or self.entropy < 0 or not (0 <= self.gae <= 1 and 0 <= self.discount <= 1):
            raise UsageError(
                f"timesteps={self.timesteps}, entropy={self.entropy:g}, gae={self.gae:g}, discount={self.discount:g}: "
                "give 0 or more timesteps and entropy, and gae and discount in [0, 1]."
            )
        if self.buffer % self.worlds or not 2 <= self.batch <= self.buffer:
            raise UsageError(
                f"A buffer of {self.buffer} frames does not fit {self.worlds} worlds and batches of {self.batch}. "
                "Give a multiple of the worlds, and a batch of 2 or more up to the buffer."
            )

    def work(self, frames: int) -> Work:
        """A buffer and the evaluation after it."""
        return Work(frames=self.buffer + frames, iterations=math.ceil(self.timesteps / self.buffer))

    def first(self, frames: int) -> First:
        """A buffer, for which every world begins episodes, and the evaluation after it."""
        begun = self.worlds * math.ceil(self.buffer / self.worlds / frames)
        return First(begun + 1, frames=self.buffer + frames)

    def run(self, problem: Problem, context: RunContext) -> Solution:
        """Train until the budget does not suffice for another buffer and the evaluation after it.

        Raises:
            UsageError: the controller is not a policy, the design is a design space, or stable-baselines3 is not
                installed.
            DivergenceError, BudgetExhaustedError: as for every method.
        """
        hidden = _hidden(problem)
        stored = context.restore()
        incumbent = resume(problem, context)
        start = problem.initial(context.rng)
        session = new_session(problem, self.worlds)
        with _seeded(int(context.rng.integers(2**31))):
            learner = self._learner(session, start, hidden)
            training = _Training(problem, context, session, learner, incumbent)
            if stored is not None:
                training.load(unpack(stored))
            self._check_first_buffer(training)
            while self._goes_on(training) and training.step():
                self._report(training)
                keep(problem, context, incumbent, **training.state())
                if context.should_stop():
                    break
        return training.solution()

    def _learner(self, session: Session, start: Array, hidden: int) -> "Learner":
        with extra("ppo", "ppo needs"):
            from zoobench.gym.learner import Learner
            from zoobench.gym.vector import ZooVectorEnv
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

    def _affords(self, training: "_Training") -> bool:
        return training.session.affords(self.buffer // self.worlds, evaluations=1)

    def _goes_on(self, training: "_Training") -> bool:
        return (not self.timesteps or training.learner.timesteps < self.timesteps) and self._affords(training)

    def _check_first_buffer(self, training: "_Training") -> None:
        problem = training.problem
        if problem.meter.iterations or self._affords(training):
            return
        raise BudgetExhaustedError(
            f"The budget of {problem.spec.budget} does not suffice for a first buffer of {self.buffer} frames and an "
            f"evaluation of {problem.spec.frames} frames. Give a larger budget or a smaller buffer."
        )

    def _report(self, training: "_Training") -> None:
        learner = training.learner
        readings = {"timesteps": float(learner.timesteps), "deviation": learner.deviation}
        readings["reward_explored"] = training.reward
        if training.score is not None:
            readings["score_current"] = training.score
        share = learner.timesteps / self.timesteps if self.timesteps else 0.0
        report(training.problem, training.context, training.incumbent, readings, share=share)


class _Training:
    """The state of one run: learner, session and incumbent.

    Attributes:
        reward: mean over the last buffer, with exploration.
        score: of the policy after it, without exploration; None if the episode failed.
    """

    def __init__(
        self, problem: Problem, context: RunContext, session: Session, learner: "Learner", incumbent: Incumbent
    ) -> None:
        self.problem, self.context, self.session = problem, context, session
        self.learner, self.incumbent = learner, incumbent
        self.reward = 0.0
        self.score: float | None = None
        self._resumed = 0
        self._is_resumed = False

    def step(self) -> bool:
        """Learn from one buffer and evaluate the policy; False if the budget ended before the evaluation did.

        That happens with budgets of seconds, of episodes if some end early and are begun again, and of substeps if
        exploration takes more than expected.
        """
        try:
            self.reward = self.learner.learn()
            params = self.learner.actor
            evaluation = self.problem.evaluate(params)
        except BudgetExhaustedError:
            if not self.problem.meter.iterations:
                raise
            return False
        self.incumbent.offer(params, evaluation)
        self.score = evaluation.score if evaluation.failure is None else None
        self.problem.meter.iterations += 1
        self._resumed += int(self._is_resumed)
        self._is_resumed = False
        return True

    def solution(self) -> Solution:
        """The solution of the ended run."""
        return self.incumbent.solution(
            iterations=self.problem.meter.iterations,
            timesteps=self.learner.timesteps,
            diverged_episodes=self.session.failures,
            resumed=self._resumed,
        )

    def state(self) -> dict[str, Any]:
        """Plain data for a checkpoint, without the incumbent."""
        return {"learner": self.learner.state(), "failures": self.session.failures, "resumed": self._resumed}

    def load(self, state: dict[str, Any]) -> None:
        """Restore learner and counts from `state`; `resume` restores the rest."""
        self.learner.load(state["learner"])
        self.session.failures, self._resumed, self._is_resumed = state["failures"], state["resumed"], True


def _hidden(problem: Problem) -> int:
    """Units of the policy's hidden layers.

    Raises:
        UsageError: the controller is not a policy.
    """
    ref = registry.resolve(Kind.CONTROLLER, problem.spec.controller)
    if _POLICY not in registry.get(Kind.CONTROLLER, ref.name, ref.version).tags:
        raise UsageError(
            f"ppo trains a policy, and the controller {ref.name!r} is none. "
            "Choose a policy: --controller policy-network."
        )
    return int(ref.kwargs["hidden"])


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Seed the global generators of torch and NumPy for stable-baselines3, on one thread, and restore them after it."""
    import torch

    threads, state = torch.get_num_threads(), np.random.get_state()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        np.random.seed(seed)
        torch.set_num_threads(1)
        try:
            yield
        finally:
            np.random.set_state(state)
            torch.set_num_threads(threads)
