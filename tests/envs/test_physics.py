"""Gravity and materials as parameters of environments."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.envs.at_rest import ENVS
from zoobench import registry
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import EQUILIBRATION_FRAMES, Environment, equilibration_frames
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.grid_water import LIGHTEST
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

QUICK = Fidelity(1 / 32)
BOARDS = sorted((Path(__file__).parents[2] / "leaderboards").glob("*.json"))


def _scene(text: str) -> Scene:
    env: Environment = registry.create(Kind.ENV, Ref.parse(text))
    return env.scene(Caterpillar().body(QUICK), QUICK)


def test_the_key_of_a_run_with_the_usual_physics_is_as_before() -> None:
    """Gravity written out is the same run, another one is not."""
    usual, written, weak = (
        registry.resolve(Kind.ENV, Ref.parse(f"ground{params}")) for params in ("", "[gravity=9.81]", "[gravity=3.8]")
    )
    assert str(usual) == "ground-v4[friction=0.5,relief=0.0,terrain_seed=0,wavelength=0.1]"
    assert written == usual
    assert str(weak) == "ground-v4[friction=0.5,gravity=3.8,relief=0.0,terrain_seed=0,wavelength=0.1]"


def test_published_runs_are_found_again() -> None:
    """Each environment of the present version resolves to itself, and its bare name, if it was run, to the one with
    fewest settings."""
    items = [item for board in BOARDS for item in json.loads(board.read_text(encoding="utf-8"))["components"]]
    published = {Ref(item["name"], item["version"], tuple(sorted(item["params"].items()))) for item in items}
    usual = {name: registry.resolve(Kind.ENV, Ref(name)) for name in ENVS}
    envs = {env for env in published if env.name in usual and env.version == usual[env.name].version}
    assert len(envs) >= 3
    for env in envs:
        assert registry.resolve(Kind.ENV, env) == env
    for name in {env.name for env in envs}:
        plainest = min((env for env in envs if env.name == name), key=lambda env: len(env.params))
        assert usual[name] == plainest or usual[name] not in envs
    assert len(envs & set(usual.values())) >= 3


@pytest.mark.parametrize("name", ENVS)
def test_gravity_and_the_robots_material_reach_every_scene(name: str) -> None:
    """All six constants, in SI units."""
    settings = "gravity=3.8,youngs_modulus=2e4,poissons_ratio=0.3,density=1100,muscle_strength=900,damping=5"
    scene = _scene(f"{name}[{settings}]")
    assert scene.gravity == (0.0, -3.8, 0.0)
    robot = scene.robot.material
    assert (robot.youngs_modulus, robot.poissons_ratio, robot.density) == (2e4, 0.3, 1100.0)
    assert (robot.muscle_strength, robot.viscosity) == (900.0, 5.0)


@pytest.mark.parametrize("name", ["desert", "clay", "wetland", "snow"])
def test_the_elasticity_of_a_solid_medium_reaches_the_scene(name: str) -> None:
    """Young's modulus, Poisson's ratio and density."""
    scene = _scene(f"{name}[medium_youngs_modulus=3e5,medium_poissons_ratio=0.25,medium_density=1234]")
    assert scene.medium is not None
    material: Any = scene.medium.material
    assert (material.youngs_modulus, material.poissons_ratio, material.density) == (3e5, 0.25, 1234.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("snow[hardening=1,critical_compression=0.03,critical_stretch=0.0045]", {"critical_stretch": 0.0045}),
        ("snow[critical_compression=0.03]", {"critical_compression": 0.03, "hardening": 10.0}),
        ("wetland[viscosity=2,yield_stress=60]", {"viscosity": 2.0, "yield_stress": 60.0}),
        (
            "ocean[water=particles,viscosity=0.001,medium_density=1025,tait_exponent=1]",
            {"viscosity": 1e-3, "density": 1025.0},
        ),
        ("shallow-water[tait_exponent=4]", {"exponent": 4.0, "density": 1000.0}),
    ],
)
def test_constants_of_a_medium_reach_the_scene(text: str, expected: dict[str, float]) -> None:
    """Each under its own name; wetland's viscosity is the mud's, not the robot's."""
    medium = _scene(text).medium
    assert medium is not None
    assert {name: getattr(medium.material, name) for name in expected} == expected


@pytest.mark.parametrize("name", ["desert", "wetland", "ocean"])
def test_a_bed_is_at_rest_under_the_gravity_that_is_set(name: str) -> None:
    """Its first state carries the weight of the column above, and no more."""
    particles = ",water=particles" if name == "ocean" else ""
    strong, weak = (_scene(f"{name}[gravity={gravity}{particles}]").medium for gravity in (9.81, 0.981))
    assert strong is not None
    assert weak is not None
    loads = (strong.history, weak.history) if name == "ocean" else (-strong.stress[:, 1], -weak.stress[:, 1])
    if name == "ocean":
        loads = (1.0 - loads[0], 1.0 - loads[1])
    assert loads[1] == pytest.approx(0.1 * loads[0], rel=0.05)


def test_waves_are_slower_under_weak_gravity() -> None:
    """So it is equilibrated for longer; never for less than on Earth, and not for ever without gravity."""
    assert [equilibration_frames(gravity) for gravity in (20.0, 9.81, 9.81 / 4, 0.0)] == [
        EQUILIBRATION_FRAMES, EQUILIBRATION_FRAMES, 2 * EQUILIBRATION_FRAMES, 4 * EQUILIBRATION_FRAMES,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("ground[gravity=-1]", "upward"),
        ("ground[youngs_modulus=0]", "youngs_modulus is 0"),
        ("ice[poissons_ratio=0.5]", "between -1 and 0.5"),
        ("ocean[poissons_ratio=-1]", "between -1 and 0.5"),
        ("ground[density=-5]", "density is -5"),
        ("ground[density=1e-300]", "that of no solid"),
        ("ground[muscle_strength=-1]", "muscle_strength is -1"),
        ("ocean[muscle_strength=0]", "moves nothing"),
        ("ground[damping=-1]", "robot's viscosity is -1"),
        ("desert[medium_poissons_ratio=0.7]", "medium's Poisson's ratio 0.7"),
        ("clay[medium_youngs_modulus=-1]", "medium's youngs_modulus"),
        ("snow[critical_compression=1]", "critical_compression is 1"),
        ("snow[critical_stretch=0]", "critical_stretch is 0"),
        ("desert[friction_angle=90]", "friction_angle is 90"),
        ("ocean[water=grid,density=300]", "too light for this water.*density of 500 kg/m.3 or more"),
        ("ocean[water=grid,medium_density=2500]", "density of 1250 kg/m.3 or more"),
        ("ocean[medium_density=-1]", "positive density"),
        ("ocean[water=grid,current=0.1]", "flows in water=surface alone"),
        ("ocean[water=particles,tait_exponent=0]", "exponent is 0"),
        ("ocean[water=particles,gravity=80]", "compressed by 12 %"),
        ("ocean[water=particles,bulk_modulus=1e4]", "compressed by 15 %"),
    ],
)
def test_what_no_matter_is_like_is_refused_before_a_run_is_queued(text: str, told: str) -> None:
    """When the environment is made, with the constant and its range."""
    with pytest.raises(UsageError, match=told):
        registry.create(Kind.ENV, Ref.parse(text))


def test_a_body_of_light_parts_is_refused_in_water_on_a_grid() -> None:
    """Of which a fish as light as is allowed does not diverge, idle."""
    ocean: Environment = registry.create(Kind.ENV, Ref.parse(f"ocean[water=grid,density={1000 * LIGHTEST:g}]"))
    fidelity = Fidelity(1 / 32, precision=64)
    body = registry.create(Kind.DESIGN, Ref("fish")).body(fidelity)
    scene = ocean.scene(body, fidelity)
    solver = Solver(scene, fidelity)
    assert not solver.run(np.zeros((20, 1, solver.muscle_count))).divergences
    with pytest.raises(UsageError, match=r"A robot of 450 kg/m.3 is too light"):
        ocean.scene(replace(body, density_ratio=np.full_like(body.density_ratio, 0.9)), fidelity)
