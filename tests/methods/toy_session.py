"""A toy session: the activity of a muscle is to follow an order in the observation."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import torch

from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.meter import BudgetMeter
from zoobench.cell.session import Step
from zoobench.controllers.policy_network import PolicyNetwork
from zoobench.errors import BudgetExhaustedError, Divergence
from zoobench.registry import Kind, resolve
from zoobench.spec import FRAME_SECONDS, Budget, Ref, RunSpec
from zoobench.tasks.base import Metric

FRAMES = 10
PLENTY = Budget("substeps", 1e9)
FAILURE = Divergence(0, 0, 1, "det F", -1.0, 0.0, 0, (0.0, 0.0, 0.0), "Try something else.")


def orders(episodes: int) -> Array:
    """The orders in the frames of each episode `[episodes, FRAMES + 1]`, in [-0.8, 0.8]."""
    return np.random.default_rng(7).uniform(-0.8, 0.8, (episodes, FRAMES + 1))


class Mirror:
    """As `zoobench.cell.session.Session`: one muscle, whose activity is to be the first number of the observation.

    The last number is the share of the episode that is left, the others are zero. A frame's reward is 1 minus the
    square of what it misses, and it costs a substep. An activity beyond `limit` blows the world up.
    """

    muscle_count = 1
    layout = (("body", 8), ("muscles", 6), ("time_left", 1))
    observation_count = 15

    def __init__(self, worlds: int = 1, budget: Budget = PLENTY, limit: float = 2.0) -> None:
        self.worlds, self._budget, self._limit = worlds, budget, limit
        self.meter = BudgetMeter()
        self.failures = 0
        self._frames = np.zeros(worlds, np.int64)
        self._episodes = np.full(worlds, -1)
        self._orders = orders(5000)

    @property
    def times(self) -> Array:
        return self._frames * FRAME_SECONDS

    def affords(self, frames: int, evaluations: int = 0) -> bool:
        budget, meter = self._budget, self.meter
        if budget.kind == "substeps":
            return meter.substeps + frames * self.worlds + evaluations * FRAMES <= budget.amount
        if budget.kind == "episodes":
            begun = np.ceil((self._frames + frames) / FRAMES) - np.ceil(self._frames / FRAMES)
            return meter.episodes + int(begun.sum()) + evaluations <= budget.amount
        return meter.is_left(budget)

    def begin(self, worlds: Iterable[int] | None = None, **drawn: object) -> Array:
        for world in range(self.worlds) if worlds is None else worlds:
            self._episodes[world] += self.worlds if self._episodes[world] >= 0 else world + 1
            self._frames[world] = 0
        return self._observations()

    def step(self, activity: Array) -> Step:
        if not self.affords(1):
            raise BudgetExhaustedError("The toy's budget is spent.")
        self.meter.start_clock()
        self.meter.episodes += int((self._frames == 0).sum())
        self.meter.forward += self.worlds
        rewards = 1.0 - (activity[:, 0] - self._observations()[:, 0]) ** 2
        failed = np.abs(activity[:, 0]) > self._limit
        self._frames += 1
        self.failures += int(failed.sum())
        over = self._frames >= FRAMES
        failures = {int(world): FAILURE for world in np.flatnonzero(failed)}
        return Step(self._observations(), np.where(failed, 0.0, rewards), failed, over & ~failed, failures)

    def _observations(self) -> Array:
        observations = np.zeros((self.worlds, self.observation_count))
        observations[:, 0] = self._orders[self._episodes, self._frames]
        observations[:, -1] = 1.0 - self._frames / FRAMES
        return observations


class Obey:
    """As `zoobench.cell.problem.Problem`, over `Mirror`s; parameters are those of a small `policy-network`."""

    def __init__(self, budget: Budget, limit: float = 2.0) -> None:
        names = ("ground", "toy", "toy", "toy", "toy", "toy")
        env, task, design, controller, method, fidelity = (Ref(name, 1) for name in names)
        spec = RunSpec(env, task, design, controller, method, 0, budget, fidelity, FRAMES)
        self._policy = PolicyNetwork(hidden=16)
        self.spec = replace(spec, controller=resolve(Kind.CONTROLLER, Ref.parse("policy-network[hidden=16]")))
        self.meter = BudgetMeter()
        self._limit = limit
        self.parameter_count = self._policy.parameter_count(1, Mirror.observation_count)
        self.seen: list[Array] = []

    def initial(self, rng: np.random.Generator) -> Array:
        return self._policy.initial(rng, 1, Mirror.observation_count)

    def session(self, worlds: int) -> Mirror:
        session = Mirror(worlds, self.spec.budget, self._limit)
        session.meter = self.meter
        return session

    def evaluate(self, params: Array) -> Evaluation:
        session = self.session(1)
        if not session.affords(FRAMES):
            raise BudgetExhaustedError("The toy's budget is spent.")
        self.seen.append(params)
        observations, rewards = session.begin(), []
        for _ in range(FRAMES):
            weights, seen = torch.as_tensor(params), torch.as_tensor(observations[0])
            step = session.step(self._policy.response(weights, session.times[0], seen, 1).numpy()[None])
            if step.failures:
                return Evaluation(-np.inf, {}, np.zeros(0), step.failures[0])
            observations = step.observations
            rewards.append(step.rewards[0])
        score = float(np.mean(rewards))
        return Evaluation(score, {"score": Metric(score, "m/s")}, np.array(rewards))
