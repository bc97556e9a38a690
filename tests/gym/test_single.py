"""A cell as a Gymnasium environment."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.passive_env_checker import env_step_passive_checker

from zoobench.errors import UnknownNameError, UsageError
from zoobench.gym.single import ZooEnv

SMALL = {"fidelity": "smoke", "frames": 4}


@pytest.mark.parametrize("action", ["waves", "muscles"])
def test_it_passes_gymnasiums_check(action: str) -> None:
    """Spaces, seeds, types and independent observations, with a warning for unbounded observations only."""
    env = gymnasium.make("zoobench/Ground-Caterpillar-MovementSpeed-v0", action=action, **SMALL)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env.unwrapped)
    assert all("infinity" in str(warning.message) for warning in caught), [str(item.message) for item in caught]


def test_an_episode_has_its_length_and_repeats_itself() -> None:
    """Truncated at the last frame; equal actions give equal numbers."""
    env = ZooEnv("ground", "caterpillar", "turning", **SMALL)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (4, *env.action_space.shape)).astype(np.float32)
    episodes = []
    for _ in range(2):
        first, info = env.reset(seed=1)
        assert info == {}
        steps = [env_step_passive_checker(env, action) for action in actions]
        assert [step[3] for step in steps] == [False, False, False, True]
        assert not any(step[2] for step in steps)
        episodes.append((first, [step[0] for step in steps], [step[1] for step in steps]))
    np.testing.assert_array_equal(episodes[0][1], episodes[1][1])
    assert episodes[0][2] == episodes[1][2]
    assert any(reward != 0.0 for reward in episodes[0][2])


def test_a_diverged_simulation_terminates_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reward 0, no truncation, and the reason in info."""
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 1e-5)
    env = ZooEnv("ground", "caterpillar", "turning", action="muscles", **SMALL)
    env.reset()
    _, reward, terminated, truncated, info = env.step(np.ones(env.action_space.shape, np.float32))
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert "diverged" in info["failure"]


def test_invalid_input_is_refused() -> None:
    """An unknown name with a suggestion, and an action of another shape."""
    with pytest.raises(UnknownNameError, match="caterpillar"):
        ZooEnv("ground", "caterpilar", "turning", **SMALL)
    env = ZooEnv("ground", "caterpillar", "turning", **SMALL)
    env.reset()
    with pytest.raises(UsageError, match="shape"):
        env.step(np.zeros(2, np.float32))


def test_the_observation_tells_of_the_task() -> None:
    """The space has what the task adds and the time left, and an observation fits in it."""
    added = {"turning": 0, "movement-speed": 2, "velocity-tracking": 2, "waypoint-following": 4}
    for task, count in added.items():
        env = ZooEnv("ground", "caterpillar", task, **SMALL)
        muscles = env.action_space.shape[0] // 9  # eight weights and a bias each
        seen, _ = env.reset()
        assert env.observation_space.shape == (8 + 6 * muscles + count + 1 + 2,)
        assert env.observation_space.contains(seen)
