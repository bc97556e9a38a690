"""The vector environment: every world is as it is alone."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from zoobench.errors import UsageError
from zoobench.gym.single import ZooEnv
from zoobench.gym.vector import ZooVectorEnv

SMALL = {"fidelity": "smoke", "frames": 3}


@pytest.mark.parametrize("drawn", [(), ("pose", "phase", "path")])
def test_every_world_is_as_alone(drawn: tuple[str, ...]) -> None:
    """Observations, rewards and what is told at the end, bit for bit, beyond the end of an episode; seeds go up."""
    envs = gymnasium.make_vec("zoobench/Ground-Caterpillar-WaypointFollowing-v0", num_envs=2, draw=drawn, **SMALL)
    assert isinstance(envs.unwrapped, ZooVectorEnv)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (5, *envs.action_space.shape)).astype(np.float32)
    first, _ = envs.reset(seed=5)
    together = [envs.step(action) for action in actions]
    alone = ZooEnv("ground", "caterpillar", "waypoint-following", draw=drawn, **SMALL)
    assert (first[0] == first[1]).all() == (not drawn)
    for world in range(2):
        start, _ = alone.reset(seed=5 + world)
        np.testing.assert_array_equal(first[world], start)
        for action, (seen, rewards, terminated, truncated, info) in zip(actions, together, strict=True):
            expected, reward, _, is_over, told = alone.step(action[world])
            assert rewards[world] == reward
            assert (truncated[world], terminated[world]) == (is_over, False)
            if is_over:
                np.testing.assert_array_equal(info["final_obs"][world], expected)
                assert info["final_info"]["score"][world] == told["score"]
                assert info["final_info"]["metrics"]["rms_error"][world] == told["metrics"]["rms_error"]
                expected, _ = alone.reset()
            np.testing.assert_array_equal(seen[world], expected)
    assert [bool(step[3].all()) for step in together] == [False, False, True, False, False]


def test_a_diverged_world_begins_again_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its reason is in info; the other episode continues."""
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 0.002)
    envs = ZooVectorEnv("ground", "caterpillar", "turning", num_envs=2, action="muscles", fidelity="smoke", frames=40)
    envs.reset()
    actions = np.zeros(envs.action_space.shape, np.float32)
    for frame in range(40):
        actions[1] = (-1.0) ** (frame // 3)
        seen, rewards, terminated, _, info = envs.step(actions)
        if terminated.any():
            break
    assert terminated.tolist() == [False, True]
    assert rewards[1] <= 0.0
    assert "diverged" in info["final_info"]["failure"][1]
    assert info["_final_info"].tolist() == [False, True]
    assert info["_final_obs"].tolist() == [False, True]
    np.testing.assert_array_equal(seen[1], envs.reset()[0][1])


def test_actions_of_another_shape_are_refused() -> None:
    """Of another number of worlds."""
    envs = ZooVectorEnv("ground", "caterpillar", "turning", num_envs=2, **SMALL)
    envs.reset()
    with pytest.raises(UsageError, match="shape"):
        envs.step(np.zeros((1, envs.action_space.shape[1]), np.float32))


@pytest.mark.parametrize("forbidden", [{"max_episode_steps": 2}, {"render_mode": "ansi"}, {"draw": "mood"}])
def test_options_that_cannot_be_used_are_refused(forbidden: dict[str, Any]) -> None:
    """Of the environment; of reset, all, and seeds for another number of worlds."""
    with pytest.raises(UsageError, match=r"Give|Choose"):
        ZooVectorEnv("ground", "caterpillar", "turning", **SMALL, **forbidden)
    envs = ZooVectorEnv("ground", "caterpillar", "turning", num_envs=2, **SMALL)
    with pytest.raises(UsageError, match="no options"):
        envs.reset(options={"reset_mask": np.ones(2, bool)})
    with pytest.raises(UsageError, match="Give one for each"):
        envs.reset(seed=[1])
