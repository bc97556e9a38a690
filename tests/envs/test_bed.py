"""Beds at rest under their own weight."""

from dataclasses import replace

import numpy as np
import pytest

from tests.envs.at_rest import made
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.envs.bed import sharing
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import MediumBed

MEDIA = ["desert", "clay", "wetland", "snow", "shallow-water", "ocean[water=particles]"]
FIDELITY = Fidelity(1 / 32)


def _bed(name: str) -> tuple[Environment, MediumBed]:
    env = made(name)
    assert env.bed is not None
    return env, env.bed.fill(np.array(env.arena), 9.81, FIDELITY)


@pytest.mark.parametrize("name", MEDIA)
def test_the_bed_carries_its_own_weight(name: str) -> None:
    """The vertical stress of the initial strain is the weight of the column above."""
    env, bed = _bed(name)
    assert env.bed is not None
    weight = bed.material.density * 9.81 * (env.bed.thickness - bed.positions[:, 1])
    # the closed form is that of small strains: an error of the order of the strain itself, 2 % at most
    assert -bed.stress[:, 1] == pytest.approx(weight, rel=0.05)


@pytest.mark.parametrize(
    "material",
    [
        SandMaterial(1e5, 0.2, 1600.0, 45.0),
        ClayMaterial(1e5, 0.2, 1800.0, 200.0),
        MudMaterial(1e5, 0.2, 1400.0, 50.0, 1.0),
    ],
)
def test_the_bed_starts_inside_its_yield_surface(material: SandMaterial | ClayMaterial | MudMaterial) -> None:
    """Otherwise the bed would flow before the robot moves."""
    strains = material.rest_strains(np.linspace(0.0, 2000.0, 50))
    deviator = strains - strains.mean(axis=1, keepdims=True)
    size = np.linalg.norm(deviator, axis=1)
    assert (size <= material.largest_deviator(strains.sum(axis=1)) * (1 + 1e-12) + 1e-15).all()


def test_water_is_as_dense_as_its_pressure_says() -> None:
    """Mass by volume times J is the density at rest everywhere, so that the stratification is stable."""
    env, bed = _bed("ocean[water=particles]")
    assert env.bed is not None
    place = np.prod(env.arena) * env.bed.thickness / env.arena[1] / len(bed.positions)
    assert bed.volumes * bed.history == pytest.approx(place, rel=1e-12)
    assert bed.history.min() < 0.99


def test_a_malleable_body_shares_its_place_with_water() -> None:
    """Every particle below the surface has a water particle at its place, at the pressure there; not on land."""
    body = replace(Caterpillar(height=0.06).body(FIDELITY), malleable=True)
    robot_only = replace(body, malleable=False)
    for name in ("ocean[water=particles]", "shallow-water", "desert"):
        env = made(name)
        shared, alone = env.scene(body, FIDELITY), env.scene(robot_only, FIDELITY)
        assert shared.medium is not None
        assert alone.medium is not None
        assert env.bed is not None
        if name == "desert":
            assert shared.medium.hosts is None
            continue
        guests = shared.medium.particle_count - alone.medium.particle_count
        wet = shared.robot.positions[:, 1] < env.bed.thickness
        assert guests == wet.sum() > 0
        assert shared.medium.hosts is not None
        assert isinstance(env.bed.material, WaterMaterial)
        np.testing.assert_array_equal(shared.medium.hosts, [*[-1] * alone.medium.particle_count, *np.flatnonzero(wet)])
        np.testing.assert_array_equal(shared.medium.positions[-guests:], shared.robot.positions[wet])
        strain = 9.81 * 1000.0 * (env.bed.thickness - shared.robot.positions[wet, 1]) / env.bed.material.bulk_modulus
        assert -np.log(shared.medium.history[-guests:]) == pytest.approx(strain, rel=1e-9)


def test_what_joins_a_bed_must_name_robots_that_exist() -> None:
    """A host beyond the robot's particles is refused when the scene is created."""
    env, bed = _bed("ocean[water=particles]")
    scene = env.scene(Caterpillar().body(FIDELITY), FIDELITY)
    with pytest.raises(SceneError, match="hosts range"):
        replace(scene, medium=sharing(bed, bed, np.full(bed.particle_count, 10**6)))


@pytest.mark.parametrize("name", ["wetland[thickness=0.001]", "desert[thickness=0.031]"])
def test_a_bed_thinner_than_a_cell_is_refused(name: str) -> None:
    """Its nodes would be those of the ground, so that it would be no bed; one of a cell is possible."""
    with pytest.raises(SceneError, match=r"thinner than a cell of 0.03125 m. Give more, or a finer fidelity"):
        _bed(name)
    _bed("wetland[thickness=0.03125]")
