"""Parameters of the environment that are drawn anew for every episode."""

import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from zoobench.errors import UnknownNameError, UsageError
from zoobench.gym.single import ZooEnv
from zoobench.gym.vector import ZooVectorEnv

NAME = "zoobench/Ground-Caterpillar-Turning-v0"
SMALL = {"fidelity": "smoke", "frames": 3}
DRAWN = {"friction": (0.2, 0.8), "youngs_modulus": "8e3|1e4|12000", "terrain_seed": (0, 1000)}


def episode(env: ZooEnv, seed: int | None = None) -> tuple[dict[str, Any], list[Any]]:
    """What `reset` tells, and the observations of an episode with equal actions."""
    seen, info = env.reset(seed=seed)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (3, *env.action_space.shape)).astype(np.float32)
    return info, [seen, *(env.step(action)[0] for action in actions)]


def test_a_seed_decides_the_physics_of_an_episode() -> None:
    """What was drawn is told, in the parameters' types and in what was asked for; equal seeds repeat all numbers."""
    env = ZooEnv("ground", "caterpillar", "turning", physics=DRAWN, **SMALL)
    told, seen = zip(*(episode(env, seed) for seed in (1, None, 1)), strict=True)
    np.testing.assert_array_equal(seen[0], seen[2])
    assert told[0] == told[2] != told[1]
    for each in told:
        drawn = each["physics"]
        assert list(drawn) == sorted(DRAWN)
        assert 0.2 <= drawn["friction"] <= 0.8
        assert drawn["youngs_modulus"] in (8e3, 1e4, 12e3)
        assert {name: type(value) for name, value in drawn.items()} == {
            "friction": float,
            "youngs_modulus": float,
            "terrain_seed": int,
        }


def test_an_episode_is_that_of_an_environment_with_what_was_drawn() -> None:
    """Bit for bit; what the environment was made with is kept beside it."""
    env = ZooEnv("ground[gravity=3.8]", "caterpillar", "turning", physics={"friction": (0.2, 0.8)}, **SMALL)
    told, seen = episode(env, 7)
    friction = told["physics"]["friction"]
    same = ZooEnv(f"ground[gravity=3.8,friction={friction!r}]", "caterpillar", "turning", **SMALL)
    np.testing.assert_array_equal(seen, episode(same)[1])
    other = ZooEnv("ground[gravity=3.8]", "caterpillar", "turning", **SMALL)
    assert not np.array_equal(seen, episode(other)[1])


@pytest.mark.slow
def test_what_else_is_drawn_does_not_depend_on_the_physics() -> None:
    """The drawn path has room in the drawn arena, and the picture is that of the drawn ground."""
    drawn = {"physics": {"slope": "0|5"}, "draw": ("pose", "path")}
    env = ZooEnv("ground", "caterpillar", "waypoint-following", render_mode="rgb_array", **drawn, **SMALL)
    pictures = {}
    for seed in range(6):
        told, _ = episode(env, seed)
        if told["physics"]["slope"] not in pictures:
            pictures[told["physics"]["slope"]] = env.render()
        if len(pictures) == 2:
            break
    assert set(pictures) == {0.0, 5.0}
    assert not np.array_equal(pictures[0.0], pictures[5.0])
    env.close()


def test_it_passes_gymnasiums_check_and_is_written_as_json() -> None:
    """A pair stays a range when its specification has been a list of JSON meanwhile."""
    env = gymnasium.make(NAME, physics=DRAWN, **SMALL)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env.unwrapped, skip_render_check=True)
    assert not [str(item.message) for item in caught if item.category is UserWarning]
    assert env.spec is not None
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.reset(seed=3)[1] == env.reset(seed=3)[1]


def test_worlds_with_solvers_of_their_own_draw_each() -> None:
    """The vector environment of one solver says how to make them."""
    asked = {"physics": {"friction": (0.2, 0.8)}, **SMALL}
    with pytest.raises(UsageError, match="vectorization_mode='sync'"):
        gymnasium.make_vec(NAME, num_envs=2, **asked)
    with pytest.raises(UsageError, match="share"):
        ZooVectorEnv("ground", "caterpillar", "turning", num_envs=2, **asked)
    envs = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode="sync", **asked)
    _, told = envs.reset(seed=1)
    frictions = told["physics"]["friction"]
    assert len(set(frictions.tolist())) == 2


@pytest.mark.parametrize(
    ("physics", "message"),
    [
        ({"friction": 0.3}, r"friction.*0\.3.*\(low, high\)"),
        ({"friction": (0.8, 0.2)}, r"\(low, high\)"),
        ({"friction": (0.1, float("inf"))}, r"\(low, high\)"),
        ({"friction": [0.1, 0.2, 0.3]}, r"'0\.1\|0\.2\|0\.3'"),
        ({"friction": ("0.1", "0.2")}, r"'0\.1\|0\.2'"),
        ({"friction": "0.2|high"}, "must be a finite number"),
        ({"friction": ""}, "key=value"),
        ({"friction": (-1.0, 0.5)}, "friction of -1 is not possible"),
        ({"slope": "0|60"}, "too steep"),
        ({"terrain_seed": (0.5, 3.0)}, "whole"),
        (["friction"], "dictionary"),
    ],
)
def test_what_cannot_be_drawn_is_refused(physics: Any, message: str) -> None:
    """When the environment is made: what was given, and what to give."""
    with pytest.raises(UsageError, match=message):
        ZooEnv("ground", "caterpillar", "turning", physics=physics, **SMALL)


def test_unknown_parameters_are_refused_with_the_nearest() -> None:
    """As on the command line; what has two words or none is no number of a range."""
    with pytest.raises(UnknownNameError, match="friction"):
        ZooEnv("ground", "caterpillar", "turning", physics={"fricton": (0.1, 0.2)}, **SMALL)
    with pytest.raises(UsageError, match=r"'true\|false'"):
        ZooEnv("desert", "caterpillar", "turning", physics={"slip": (0, 1)}, **SMALL)


def test_scenes_that_do_not_come_again_are_not_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Thousands of episodes would push other scenes at rest out of the cache; those of a few values are kept there."""
    monkeypatch.setattr("zoobench.sim.equilibrium.state_folder", lambda: tmp_path)
    kept = {}
    for name, values in (("range", (0.2, 0.8)), ("choice", "0.3|0.4")):
        env = ZooEnv("ground", "caterpillar", "turning", physics={"friction": values}, **SMALL)
        for seed in range(4):
            env.reset(seed=seed)
        kept[name] = len(list(tmp_path.iterdir()))
    assert kept == {"range": 0, "choice": 2}
