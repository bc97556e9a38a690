"""Stable-baselines3 behind our controller: the same policy on both sides."""

import numpy as np
import pytest
import torch

from tests.methods.toy_session import FRAMES, Mirror
from zoobench.controllers.policy_network import PolicyNetwork
from zoobench.gym.learner import Learner
from zoobench.gym.sb3 import ZooVecEnv
from zoobench.gym.vector import ZooVectorEnv
from zoobench.methods.base import pack, unpack

SEEN = Mirror.observation_count
POLICY = PolicyNetwork(hidden=16)
SETTINGS = {"n_steps": 16, "batch_size": 16, "n_epochs": 2}


def _learner(actor: np.ndarray, worlds: int = 2) -> Learner:
    return Learner(ZooVectorEnv.of(Mirror(worlds)), actor, 16, 0.3, SETTINGS)  # type: ignore[arg-type]


def test_what_it_does_without_exploration_is_what_the_controller_does() -> None:
    """Before and after learning, clipped to [-1, 1] on both sides."""
    start = 3.0 * POLICY.initial(np.random.default_rng(0), 1, SEEN)
    learner = _learner(start)
    np.testing.assert_array_equal(learner.actor, start.astype(np.float32))
    seen = np.random.default_rng(1).normal(size=SEEN + 2).astype(np.float32)
    for _ in range(2):
        action, _ = learner._model.predict(seen, deterministic=True)
        expected = POLICY.action(torch.as_tensor(learner.actor), torch.as_tensor(seen).double(), 1)
        np.testing.assert_allclose(action, expected, atol=1e-5)
        learner.learn()
    assert not np.array_equal(learner.actor, start.astype(np.float32))


def test_the_exploration_begins_as_asked() -> None:
    """One deviation for every action."""
    assert _learner(POLICY.initial(np.random.default_rng(0), 1, SEEN)).deviation == pytest.approx(0.3)


def test_it_goes_on_from_its_state() -> None:
    """Policy, value function, optimiser and count; the worlds begin again."""
    start = POLICY.initial(np.random.default_rng(0), 1, SEEN)
    first = _learner(start)
    first.learn()
    second = _learner(np.zeros_like(start))
    second.load(unpack(pack(first.state())))
    np.testing.assert_array_equal(second.actor, first.actor)
    assert second.timesteps == first.timesteps == 32
    after = []
    for learner in (first, second):
        torch.manual_seed(0)
        np.random.seed(0)
        learner._worlds._envs._worlds.session._episodes[:] = -1  # the first world that there ever was, and so on
        learner._model._last_obs = None  # begin anew
        learner.learn()
        after.append(learner.actor)
    np.testing.assert_array_equal(after[0], after[1])


def test_parameters_of_another_policy_are_refused() -> None:
    """The message has both counts."""
    with pytest.raises(ValueError, match="parameters"):
        _learner(np.zeros(7))


def test_an_episode_that_reaches_its_length_is_not_one_that_failed() -> None:
    """The value of the last observation counts for a truncated episode only."""
    worlds = ZooVecEnv(ZooVectorEnv.of(Mirror(2, limit=0.5), "muscles"))  # type: ignore[arg-type]
    worlds.reset()
    for _ in range(FRAMES - 1):
        _, _, over, _ = worlds.step(np.zeros((2, 1), np.float32))
        assert not over.any()
    _, rewards, over, infos = worlds.step(np.array([[0.0], [0.9]], np.float32))
    assert over.all()
    assert rewards[1] == 0.0
    assert [info["TimeLimit.truncated"] for info in infos] == [True, False]
    assert all(info["terminal_observation"].shape == (SEEN + 2,) for info in infos)
