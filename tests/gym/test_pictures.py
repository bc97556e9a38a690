"""Pictures of environments: by Gymnasium's wrappers, in a browser, and of many worlds."""

import itertools
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import imageio.v2 as imageio
import numpy as np
import pytest

from tests.test_readme import GUIDE, blocks
from zoobench.errors import UsageError
from zoobench.gym.single import ZooEnv
from zoobench.gym.vector import ZooVectorEnv

NAME = "zoobench/Ground-Caterpillar-WaypointFollowing-v0"
SMALL = {"fidelity": "smoke", "frames": 4}


@pytest.mark.slow
def test_every_world_has_a_picture() -> None:
    """Of its own robot; an environment without a render mode has none."""
    envs = ZooVectorEnv("ground", "caterpillar", "turning", num_envs=2, render_mode="rgb_array", **SMALL)
    envs.reset()
    before = envs.render()
    actions = np.zeros(envs.action_space.shape, np.float32)
    actions[1] = 1.0
    envs.step(actions)
    after = envs.render()
    assert before is not None
    assert after is not None
    assert before[0].shape == (360, 640, 3)
    np.testing.assert_array_equal(before[0], before[1])
    assert (after[0] != after[1]).any(axis=2).mean() > 0.01
    envs.close()
    assert ZooVectorEnv("ground", "caterpillar", "turning", **SMALL).render() is None


def test_gymnasium_shows_it_in_a_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every step while somebody looks, in real time; the address is said, and ends with the environment."""
    viewer = pytest.importorskip("zoobench.render.viewer").Viewer
    pytest.importorskip("viser")
    shown: list[float] = []
    monkeypatch.setattr(viewer, "is_due", True)
    monkeypatch.setattr(viewer, "show", lambda self, present: shown.append(present.seconds))
    env = gymnasium.make(NAME, render_mode="human", **SMALL)
    with pytest.warns(UserWarning, match=r"Open http://127\.0\.0\.1:\d+ in a browser"):
        env.reset()
    env.step(env.action_space.sample())
    assert shown == [0.0], "nobody looks"
    monkeypatch.setattr(viewer, "is_watched", True)
    for _ in range(2):
        env.step(env.action_space.sample())
    env.reset()
    np.testing.assert_allclose(shown, [0.0, 0.016, 0.024, 0.0])
    assert env.render() is None
    env.close()


def test_the_first_of_many_worlds_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also when it begins again by itself."""
    viewer = pytest.importorskip("zoobench.render.viewer").Viewer
    pytest.importorskip("viser")
    begun: list[float] = []
    monkeypatch.setattr(viewer, "begin", lambda self, problem, present, task: begun.append(present.seconds))
    envs = ZooVectorEnv("ground", "caterpillar", "turning", num_envs=2, render_mode="human", **SMALL)
    with pytest.warns(UserWarning, match="in a browser"):
        envs.reset()
    for _ in range(4):
        envs.step(np.zeros(envs.action_space.shape, np.float32))
    assert begun == [0.0, 0.0]
    assert envs.render() is None
    envs.close()


@pytest.mark.slow
def test_stable_baselines_trains_and_gymnasium_films(tmp_path: Path) -> None:
    """The guide's example, with less of everything: it trains, and films an episode that it scores."""
    pytest.importorskip("moviepy")
    (source,) = blocks(GUIDE / "reinforcement-learning.md", "python")
    less = {"20_000": "80", "n_steps=250, batch_size=100": "n_steps=20, batch_size=20", '"draft"': '"smoke", frames=20'}
    for usual, small in less.items():
        assert usual in source
        source = source.replace(usual, small)
    done = subprocess.run([sys.executable, "-c", source], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "rms_error" in done.stdout
    assert (tmp_path / "agent.zip").exists()
    (film,) = (tmp_path / "films").glob("*.mp4")
    with imageio.get_reader(film) as reader:
        images = list(reader.iter_data())
    assert len(images) == 21
    assert (np.abs(images[0].astype(int) - images[-1]).max(axis=2) > 8).mean() > 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("cameras", [("film", "top"), ("film", "follow", "side", "top")], ids=len)
def test_a_picture_has_the_size_and_camera_that_were_asked_for(cameras: tuple[str, ...]) -> None:
    """Through `gymnasium.make`, alone and many; every camera shows another picture, and that of films is the usual."""
    pictures = {}
    for camera in cameras:
        env = gymnasium.make(NAME, render_mode="rgb_array", width=320, height=240, camera=camera, **SMALL)
        env.reset()
        pictures[camera] = env.render()
        env.close()
    assert {picture.shape for picture in pictures.values()} == {(240, 320, 3)}  # type: ignore[union-attr]
    for one, other in itertools.combinations(pictures, 2):
        assert (pictures[one] != pictures[other]).any(axis=2).mean() > 0.05, (one, other)  # type: ignore[union-attr]
    envs = gymnasium.make_vec(NAME, num_envs=2, render_mode="rgb_array", width=320, height=240, **SMALL)
    envs.reset()
    (first, _) = envs.render()  # type: ignore[misc]
    np.testing.assert_array_equal(first, pictures["film"])
    envs.close()


@pytest.mark.parametrize("make", [ZooEnv, ZooVectorEnv])
@pytest.mark.parametrize(
    ("view", "message"),
    [
        ({"width": 0}, "0 x 360 pixels"),
        ({"height": 240.5}, "640 x 240.5 pixels"),
        ({"height": 100_000}, "16 to 4096"),
        ({"camera": "below"}, "'below' is not offered. Choose film, follow, side or top"),
    ],
)
def test_a_view_that_cannot_be_drawn_is_refused(make: Any, view: dict[str, Any], message: str) -> None:
    """When the environment is made, whatever its render mode."""
    with pytest.raises(UsageError, match=message):
        make("ground", "caterpillar", "turning", **view, **SMALL)
