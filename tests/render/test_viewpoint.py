"""The camera sees all that a film is about."""

from dataclasses import replace

import numpy as np
import pytest

from tests.render.filmed import short_film
from zoobench.envs.bed import BED_THICKNESS
from zoobench.render.viewpoint import camera_for, region_of


@pytest.mark.parametrize("aspect", [16 / 9, 1.0])
def test_the_camera_holds_the_region(aspect: float) -> None:
    """Robot, medium and target are in the picture at all moments, below the words at its top."""
    film = short_film()
    camera = camera_for(region_of(film), aspect)
    assert film.target is not None
    offset = np.vstack([film.robot.reshape(-1, 3), film.medium.reshape(-1, 3), film.target]) - camera.focus
    across = offset @ camera.right / (camera.half_height * aspect)
    along = offset @ camera.up / camera.half_height
    assert -1.0 < across.min() < across.max() < 0.8
    assert -1.0 < along.min() < along.max() < 0.8
    axes = np.array([camera.right, camera.up, camera.towards])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert camera.right[0] > 0.5  # ahead is to the right


def test_on_bare_ground_the_region_grows_with_the_paths() -> None:
    """A target that runs far off is on it; one of a robot that stands still makes it no smaller than a patch."""
    film = replace(short_film(), medium=short_film().medium[:, :0])
    near = region_of(film)
    assert film.target is not None
    far = region_of(replace(film, target=film.target + np.array([0.0, 0.0, 0.05])))
    assert far.high[2] >= film.target[:, 2].max() + 0.05
    assert far.high[2] > near.high[2]
    assert near.high[0] - near.low[0] > 0.19
    assert not near.immersed


def test_where_the_arena_goes_is_in_the_region() -> None:
    """From the first place of its sides to the last."""
    film = short_film()
    still = region_of(film)
    ways = np.zeros((len(film.times), 3))
    ways[-1] = [0.5, 0.0, -0.25]
    went = region_of(replace(film, offsets=ways))
    np.testing.assert_allclose(went.high[[0, 2]] - still.high[[0, 2]], [0.5, 0.0])
    np.testing.assert_allclose(went.low[[0, 2]] - still.low[[0, 2]], [0.0, -0.25])


def test_a_robot_under_the_surface_is_immersed() -> None:
    """One on a bed is not."""
    film = short_film()
    assert not region_of(film).immersed
    assert region_of(film).level == pytest.approx(BED_THICKNESS, abs=0.01)
    assert region_of(replace(film, robot=film.robot - np.float32([0.0, 0.2, 0.0]))).immersed
