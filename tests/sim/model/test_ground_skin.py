"""The skin of firm ground by closed forms: its force is the gradient of its energy, and it carries a block's weight."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import SceneError
from zoobench.sim.model.ground_skin import SKIN, GroundSkin, heights_above
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench.sim.model.terrain import Terrain

BLOCK = scenes.passive_block((0.2, 0.0, 0.3), (6, 3, 3), np.zeros(3))
SCENE = Scene(BLOCK, (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(0.5))


@pytest.mark.parametrize("edge", [1e-3, 4e-3, 16e-3])
def test_force_is_the_gradient_of_the_energy(edge: float) -> None:
    """By central differences, for cubes that lie deep in the layer, reach into it, and are out of its reach."""
    height, e = np.linspace(-0.02, 0.02, 801), 1e-7
    gradient = (SKIN.energy(height + e, edge) - SKIN.energy(height - e, edge)) / (2 * e)
    assert np.abs(SKIN.force(height, edge) + gradient).max() <= 1e-6 * SKIN.force(height, edge).max()
    assert not SKIN.force(np.array([SKIN.thickness + edge / 2]), edge).any()


def test_a_column_through_the_whole_layer_feels_half_the_stiffness() -> None:
    """However finely it is cut into cubes."""
    for count in (1, 2, 7, 100):
        edge = 0.02 / count
        middles = edge * (np.arange(count) + 0.5)
        assert edge * SKIN.force(middles, edge).sum() == pytest.approx(SKIN.stiffness / 2, rel=1e-12)


def test_a_block_stands_where_the_layer_carries_its_weight() -> None:
    """Its underside is at delta (1 - sqrt(2 rho g H / K)), whatever the edge of its particles."""
    weight = BLOCK.material.density * 9.81 * 3 * scenes.SPACING  # [Pa]
    exact = SKIN.thickness * (1.0 - np.sqrt(2.0 * weight / SKIN.stiffness))
    lifted = replace(SCENE, robot=replace(BLOCK, positions=BLOCK.positions + np.array([0.0, 0.1, 0.0])))
    for scene in (SCENE, lifted):
        bottom = standing(scene, scenes.EDGE).robot.positions[:, 1].min() - scenes.EDGE / 2
        assert bottom == pytest.approx(exact, abs=1e-12)


def test_a_weightless_body_just_touches_the_layer() -> None:
    """And a scene without ground, or with a medium on it, is left as it is."""
    scene = standing(replace(SCENE, gravity=scenes.NO_GRAVITY), scenes.EDGE)
    assert scene.robot.positions[:, 1].min() - scenes.EDGE / 2 == pytest.approx(SKIN.thickness, abs=1e-12)
    for other in (scenes.flight_scene(), scenes.medium_scene()):
        assert standing(other, scenes.EDGE) is other


def test_distance_from_a_slope_is_along_its_normal() -> None:
    """Of points above and below it; a block on a slope feels its weight's component along the normal."""
    rise = 0.3
    heights = np.repeat(0.1 + rise * 0.1 * np.arange(9)[:, None], 9, axis=1)
    terrain = Terrain(heights, 0.1)
    points = np.array([[0.2, 0.3, 0.3], [0.4, 0.2, 0.5]])
    gap, normal = heights_above(points, terrain)
    slope = np.hypot(1.0, rise)
    assert gap == pytest.approx((points[:, 1] - 0.1 - rise * points[:, 0]) / slope, abs=1e-9)
    assert normal == pytest.approx(np.tile([-rise / slope, 1 / slope, 0.0], (2, 1)), abs=1e-9)
    scene = standing(replace(SCENE, ground=Ground(0.5, terrain)), scenes.EDGE)
    gap, _ = heights_above(scene.robot.positions, terrain)
    weight = 9.81 * BLOCK.material.density * BLOCK.volumes.sum()
    assert scene.robot.volumes @ SKIN.force(gap, scenes.EDGE) == pytest.approx(weight / slope, rel=1e-9)


@pytest.mark.parametrize(("thickness", "stiffness"), [(0.0, 1e4), (4e-3, -1.0), (np.inf, 1e4)])
def test_an_impossible_skin_is_refused(thickness: float, stiffness: float) -> None:
    """With its two numbers."""
    with pytest.raises(SceneError, match="Give positive numbers"):
        GroundSkin(thickness, stiffness)
