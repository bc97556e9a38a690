"""Pictures of water on a grid."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.render.filmed import needs_drawing, smoke_snapshot
from zoobench.render.canvas import Canvas, Image
from zoobench.render.stills import snapshot_image
from zoobench.render.vortices import STRONG, put_water


@pytest.fixture(autouse=True)
def _drawing() -> None:
    needs_drawing()


@pytest.mark.slow
def test_water_that_turns_is_lighter_to_the_left_and_darker_to_the_right() -> None:
    """The half of the layer at the robot's tail turns left here, the half before it right; the slower, the less."""
    shot = smoke_snapshot("ocean[water=grid]")
    assert shot.vorticity is not None
    spin = np.zeros_like(shot.vorticity)
    middle = spin.shape[1] // 2
    spin[:, :middle], spin[:, middle:] = STRONG, -STRONG

    def drawn(share: float) -> Image:
        return snapshot_image(replace(shot, vorticity=share * spin), (480, 270), small=True)

    def brighter(image: Image) -> NDArray[np.int64]:
        """By how much, than where the water is still."""
        return image.astype(int).sum(axis=2) - calm

    calm = drawn(0.0).astype(int).sum(axis=2)
    half, strong = (brighter(drawn(share)) for share in (0.5, 1.0))
    # columns of pixels, from the left, where the tail is
    light, dark = (np.nonzero(sign * strong > 100)[1] for sign in (1, -1))
    assert len(light) > 2000
    assert len(dark) > 2000
    assert dark.mean() - light.mean() > 100
    for there in (strong > 100, strong < -100):
        assert 0.2 < np.median(half[there] / strong[there]) < 0.8


def test_water_goes_with_the_arena_that_follows_the_robot() -> None:
    """Layer, sides and edges are drawn where the arena is at the moment."""
    shot = smoke_snapshot("ocean[water=grid]")
    assert shot.vorticity is not None
    way = (0.125, 0.0, -0.0625)
    moved = replace(shot, vorticity=np.repeat(shot.vorticity, 2, axis=0), offsets=np.array([(0.0, 0.0, 0.0), way]))
    with Canvas(320, 180) as canvas:
        update = put_water(canvas, moved)
        places = []
        for moment in range(2):
            update(moment)
            places.append([actor.bounds for actor in canvas.plotter.actors.values()])
    assert np.shape(places) == (2, 3, 6)
    assert np.array(places[1]) - places[0] == pytest.approx(np.broadcast_to(np.repeat(way, 2), (3, 6)))
