"""Scenes: what stands where, and the bed at rest."""

import numpy as np
import pytest

from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.envs.desert import desert
from zoobench.envs.ground import ground
from zoobench.envs.ice import ice
from zoobench.errors import SceneError
from zoobench.sim.fidelity import Fidelity
from zoobench.sim.scene import Effect

QUICK = Fidelity(1 / 64)


@pytest.mark.parametrize(("env", "friction"), [(ground(), 0.5), (ice(), 0.05)])
def test_land_without_a_medium(env: Environment, friction: float) -> None:
    """Ground and ice differ in friction only; the robot's lowest particles lie just above the plane."""
    scene = env.scene(Caterpillar().body(QUICK), QUICK)
    assert scene.sand is None
    assert scene.ground is not None
    assert scene.ground.friction == friction
    assert 0.0 < scene.robot.positions[:, 1].min() < QUICK.grid_spacing / 2
    assert scene.effects == {Effect.ELASTICITY, Effect.MUSCLE, Effect.FRICTION}


def test_the_desert_robot_stands_on_the_sand() -> None:
    """It neither overlaps the bed nor falls on it from a height."""
    scene = desert().scene(Caterpillar().body(QUICK), QUICK)
    assert scene.sand is not None
    gap = scene.robot.positions[:, 1].min() - scene.sand.positions[:, 1].max()
    assert 0.0 < gap < QUICK.grid_spacing
    assert Effect.SAND_PLASTICITY in scene.effects


@pytest.mark.parametrize("spacing", [1 / 40, 1 / 64, 1 / 100, 1 / 128])
@pytest.mark.parametrize("particles_per_cell", [1, 4, 8, 27])
def test_the_bed_has_its_mass_and_fills_its_box(spacing: float, particles_per_cell: int) -> None:
    """Volume exact at every sampling; centred between the walls, and no thicker than it should be."""
    fidelity = Fidelity(spacing, particles_per_cell=particles_per_cell)
    bed = desert(length=0.3, width=0.2).scene(Caterpillar().body(fidelity), fidelity).sand
    assert bed is not None
    assert bed.volumes.sum() == pytest.approx(0.3 * 0.2 * 0.02, rel=1e-12)
    assert bed.positions.mean(axis=0) == pytest.approx([0.15, 0.01, 0.1], rel=1e-6)
    assert bed.positions[:, 1].max() < 0.02


def test_the_bed_carries_its_own_weight() -> None:
    """The stress of the initial strain, (lambda + 2 mu) eps, is the weight of the sand above."""
    bed = desert().scene(Caterpillar().body(QUICK), QUICK).sand
    assert bed is not None
    modulus = 1e5 * (1 - 0.2) / ((1 + 0.2) * (1 - 2 * 0.2))
    weight = 1600.0 * 9.81 * (0.02 - bed.positions[:, 1])
    assert -modulus * bed.strains[:, 1] == pytest.approx(weight)
    assert not bed.strains[:, [0, 2]].any()


def test_a_body_larger_than_the_arena_is_refused() -> None:
    """The message names both sizes."""
    with pytest.raises(SceneError, match="does not fit"):
        desert(length=0.15).scene(Caterpillar(length=0.2).body(QUICK), QUICK)


def test_all_bed_parameters_reach_the_scene() -> None:
    """Thickness and friction angle are not swallowed."""
    scene = desert(thickness=0.04, friction_angle=30.0).scene(Caterpillar().body(QUICK), QUICK)
    assert scene.sand is not None
    assert scene.sand.material.friction_angle == 30.0
    assert np.ptp(scene.sand.positions[:, 1]) > 0.03
