"""A cell as a Gymnasium environment."""

import warnings

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.passive_env_checker import env_step_passive_checker

from tests.conformance.cells import cell
from zoobench.cell.problem import Problem
from zoobench.errors import UnknownNameError, UsageError
from zoobench.gym.single import ZooEnv
from zoobench.gym.vector import ZooVectorEnv

SMALL = {"fidelity": "smoke", "frames": 4}


@pytest.mark.parametrize("action", ["waves", "muscles"])
def test_it_passes_gymnasiums_check(action: str) -> None:
    """Spaces, seeds, types and independent observations, without a warning."""
    env = gymnasium.make("zoobench/Ground-Caterpillar-MovementSpeed-v0", action=action, **SMALL)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env.unwrapped, skip_render_check=True)
    assert not [str(item.message) for item in caught if item.category is UserWarning]


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


@pytest.mark.parametrize("action", ["waves", "muscles"])
def test_the_parts_of_observation_and_action_have_names(action: str) -> None:
    """As long as the spaces, and each where its name says; of many worlds they are the same."""
    env = ZooEnv("ground", "caterpillar", "waypoint-following", action=action, **SMALL)  # type: ignore[arg-type]
    assert (env.observation_parts[-1].stop,) == env.observation_space.shape
    assert (env.action_parts[-1].stop,) == env.action_space.shape
    env.reset()
    seen, *_ = env.step(np.zeros(env.action_space.shape, np.float32))
    parts = {part.name: seen[part.slice].reshape(part.shape) for part in env.observation_parts}
    np.testing.assert_allclose(parts["time_left"], [0.75])
    np.testing.assert_allclose(parts["phase"], [np.sin(0.16), np.cos(0.16)], rtol=1e-6)
    np.testing.assert_allclose(parts["heading"], [1.0, 0.0], atol=1e-3)
    bounds = {part.name: env.observation_space.high[part.slice] for part in env.observation_parts}
    assert {name for name, high in bounds.items() if (high == 1.0).all()} == {"time_left", "phase"}
    envs = ZooVectorEnv("ground", "caterpillar", "waypoint-following", action=action, **SMALL)  # type: ignore[arg-type]
    assert (envs.observation_parts, envs.action_parts) == (env.observation_parts, env.action_parts)


@pytest.mark.parametrize("drawn", ["pose", "phase", "path"])
def test_a_seed_decides_what_is_drawn(drawn: str) -> None:
    """Equal seeds give equal episodes, others another beginning or path; without a draw they change nothing."""
    env = ZooEnv("ground", "caterpillar", "velocity-tracking[speed=0.1]", draw=drawn, fidelity="smoke", frames=60)
    plain = ZooEnv("ground", "caterpillar", "velocity-tracking[speed=0.1]", fidelity="smoke", frames=60)
    seen = [env.reset(seed=seed)[0] for seed in (1, 1, 2)]
    np.testing.assert_array_equal(seen[0], seen[1])
    tasks = [env._worlds.session._tasks[0].path_seed for seed in (1, 2) if env.reset(seed=seed)]  # type: ignore[attr-defined]
    assert np.array_equal(seen[0], seen[2]) == (drawn == "path")
    assert (tasks[0] == tasks[1]) == (drawn != "path")
    np.testing.assert_array_equal(plain.reset(seed=1)[0], plain.reset(seed=2)[0])


def test_a_drawn_pose_is_not_at_rest_and_begins_the_clock() -> None:
    """The robot moves at the first observation; displacement and time are counted from there."""
    env = ZooEnv("ground", "caterpillar", "turning", draw="pose", **SMALL)
    seen, _ = env.reset(seed=3)
    assert np.abs(seen[:3]).max() > 1e-4
    assert np.abs(seen[3:6]).max() < 1e-6
    assert seen[-3] == 1.0


def test_no_path_can_be_drawn_for_a_task_without_one() -> None:
    """And nothing that is not known."""
    for task, drawn in (("turning", "path"), ("waypoint-following", "mood")):
        with pytest.raises(UsageError, match="path"):
            ZooEnv("ground", "caterpillar", task, draw=[drawn], **SMALL)


def test_the_end_of_an_episode_has_its_score() -> None:
    """The numbers of the same episode in one piece, bit for bit; before the end info is empty."""
    spec = cell(task="waypoint-following", controller="trajectory[frames=4]", frames=4)
    problem = Problem(spec)
    parameters = np.random.default_rng(2).normal(size=problem.parameter_count)
    expected = problem.evaluate(parameters)
    env = ZooEnv("ground", "caterpillar", "waypoint-following", action="muscles", **SMALL)
    env.reset()
    # an action in single precision would be another
    activity = torch.tanh(torch.as_tensor(parameters)).numpy().reshape(4, -1)
    told = [env.step(row)[4] for row in activity]
    assert told[:3] == [{}, {}, {}]
    assert told[3]["score"] == expected.score
    assert told[3]["metrics"] == {name: metric.value for name, metric in expected.metrics.items()}


def test_options_are_refused() -> None:
    """Of reset all; of an environment those that it does not have."""
    env = ZooEnv("ground", "caterpillar", "turning", **SMALL)
    with pytest.raises(UsageError, match="takes no options"):
        env.reset(options={"low": 0.0})
    with pytest.raises(TypeError, match="colour"):
        gymnasium.make("zoobench/Ground-Caterpillar-Turning-v0", colour="red")
    with pytest.raises(UsageError, match="Choose human or rgb_array"):
        ZooEnv("ground", "caterpillar", "turning", render_mode="ansi", **SMALL)
