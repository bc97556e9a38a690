"""Pictures of water on a grid."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.render.filmed import ENVS, needs_drawing, smoke_snapshots
from zoobench.render.canvas import Canvas, Image
from zoobench.render.stills import snapshot_image
from zoobench.render.vortices import STRONG, put_water


@pytest.fixture(autouse=True)
def _drawing() -> None:
    needs_drawing()


def test_water_that_turns_is_lighter_to_the_left_and_darker_to_the_right() -> None:
    """The half of the layer at the robot's tail turns left here, the half before it right; the slower, the less."""
    shot = smoke_snapshots()[ENVS.index("ocean")]
    assert shot.vorticity is not None
    spin = np.zeros_like(shot.vorticity)
    middle = spin.shape[1] // 2
    spin[:, :middle], spin[:, middle:] = STRONG, -STRONG

    def drawn(share: float) -> Image:
        return snapshot_image(replace(shot, vorticity=share * spin), (480, 270), small=True)

    def columns(image: Image, colour: tuple[int, int, int]) -> NDArray[np.int64]:
        """Of the pixels of a colour, from the left, where the tail is."""
        return np.nonzero(np.abs(image.astype(int) - colour).max(axis=2) < 4)[1]

    still, half, strong = (drawn(share) for share in (0.0, 0.5, 1.0))
    light, dark = columns(strong, (255, 255, 255)), columns(strong, (12, 25, 76))
    assert len(light) > 2000
    assert len(dark) > 2000
    assert dark.mean() - light.mean() > 100
    assert len(columns(half, (255, 255, 255))) < 100
    assert len(columns(half, (173, 206, 239))) > 2000
    assert len(columns(still, (91, 158, 224))) > 4000


def test_water_goes_with_the_arena_that_follows_the_robot() -> None:
    """Layer and box are drawn where the arena is at the moment."""
    shot = smoke_snapshots()[ENVS.index("ocean")]
    assert shot.vorticity is not None
    way = (0.125, 0.0, -0.0625)
    moved = replace(shot, vorticity=np.repeat(shot.vorticity, 2, axis=0), offsets=np.array([(0.0, 0.0, 0.0), way]))
    with Canvas(320, 180) as canvas:
        update = put_water(canvas, moved)
        places = []
        for moment in range(2):
            update(moment)
            places.append([actor.bounds for actor in canvas.plotter.actors.values()])
    assert np.shape(places) == (2, 2, 6)
    assert np.array(places[1]) - places[0] == pytest.approx(np.broadcast_to(np.repeat(way, 2), (2, 6)))
