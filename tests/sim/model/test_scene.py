"""Scenes that are refused, and the effects that follow from a scene."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import SceneError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.sim.model.scene import Effect, Ground, MediumBed, Scene


def _scene_of(**changes: object) -> Scene:
    body = replace(scenes.muscle_body(), **changes)  # type: ignore[arg-type]
    return Scene(body, (0.0, 0.0, 0.0), scenes.ARENA)


BODY = scenes.muscle_body()
COUNT = BODY.particle_count
NAMES = ("positions", "volumes", "stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres", "velocities")


def _with(name: str, value: float) -> dict[str, np.ndarray]:
    """An array of the body with another value in one place."""
    array = getattr(BODY, name).copy()
    array.flat[7] = value
    return {name: array}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"positions": BODY.positions[:, :2]}, "positions have shape"),
        *(
            ({name: np.ones(shape)}, f"body's {name} have shape .*; .* was expected")
            for name, shape in {
                "volumes": (COUNT - 1,),
                "stiffness": (COUNT, 1),
                "density_ratio": (COUNT + 1,),
                "occupancy": (1,),
                "muscle_membership": (COUNT - 1, 3),
                "fibres": (COUNT, 2),
                "velocities": (3, COUNT),
                "velocity_gradients": (COUNT, 3),
            }.items()
        ),
        *((_with(name, np.nan), f"body's {name} hold values that are not finite") for name in NAMES),
        ({"velocity_gradients": np.full((COUNT, 3, 3), np.nan)}, "velocity_gradients hold values that are not finite"),
        *((_with(name, -0.25), f"{name} must be positive; the smallest is -0.25") for name in NAMES[1:4]),
        ({"occupancy": np.full(COUNT, 1.5)}, "occupancy reaches 1.5 to 1.5"),
        ({"occupancy": np.zeros(COUNT)}, "empty"),
        ({"material": replace(scenes.SOFT, density=-1.0)}, "density is -1"),
        ({"material": replace(scenes.SOFT, youngs_modulus=0.0)}, "youngs_modulus is 0"),
        *(({"material": replace(scenes.SOFT, poissons_ratio=nu)}, "Poisson's ratio") for nu in (0.5, 0.7, -1.0)),
    ],
)
def test_impossible_body_is_refused(changes: dict[str, object], message: str) -> None:
    """Arrays of another shape, not finite or out of range, no mass, and material constants without sense."""
    with pytest.raises(SceneError, match=message):
        _scene_of(**changes)


def test_body_without_a_particle_is_refused() -> None:
    """It is empty."""
    with pytest.raises(SceneError, match="empty"):
        Scene(ElasticBody.passive(scenes.SOFT, np.zeros((0, 3)), np.zeros(0)), (0.0, 0.0, 0.0), scenes.ARENA)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ground": Ground(-0.1)}, r"friction coefficient of -0\.1 is negative"),
        ({"ground": Ground(float("nan"))}, "negative or not finite"),
        ({"ground": Ground(0.5), "lower": (0.0, -0.5, 0.0)}, "begins at y = -0.5 m"),
        ({"gravity": (0.0, float("nan"), 0.0)}, "gravity .* is not finite"),
    ],
)
def test_impossible_surroundings_are_refused(changes: dict[str, object], message: str) -> None:
    """Friction takes energy, the ground is y = 0, and a NaN would reach every node in one substep."""
    with pytest.raises(SceneError, match=message):
        replace(scenes.flight_scene(), **changes)  # type: ignore[arg-type]


def test_matter_outside_the_arena_is_refused() -> None:
    """The message counts the particles and names the body and the first place."""
    with pytest.raises(SceneError, match=r"216 particles of the robot lie outside .*Move the robot or widen"):
        Scene(scenes.muscle_body((0.8, 0.3, 0.3)), (0.0, 0.0, 0.0), scenes.ARENA)
    bed = scenes.medium_bed()
    bed = replace(bed, positions=bed.positions + np.array([0.0, 0.0, 0.3]))
    with pytest.raises(SceneError, match="particles of the medium lie outside"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, medium=bed)


BLOCK = scenes.passive_block((0.3, 0.3, 0.3), (2, 2, 2), np.zeros(3))


@pytest.mark.parametrize(
    ("scene", "effects"),
    [
        (Scene(BLOCK, (0.0, 0.0, 0.0), scenes.ARENA), ""),
        (_scene_of(material=replace(scenes.SOFT, muscle_strength=0.0)), ""),
        (scenes.flight_scene(), "muscle"),
        (scenes.ground_scene(friction=0.0), "muscle"),
        (scenes.ground_scene(), "muscle friction"),
        (scenes.medium_scene("sand"), "muscle friction plasticity"),
        (scenes.medium_scene("clay"), "muscle friction plasticity"),
        (scenes.medium_scene("snow"), "muscle friction plasticity"),
        (scenes.medium_scene("mud"), "muscle friction plasticity fluid"),
        (scenes.medium_scene("water"), "muscle friction fluid"),
    ],
    ids=["passive", "limp", "flight", "smooth", "ground", *("sand", "clay", "snow", "mud", "water")],
)
def test_effects_follow_from_the_scene(scene: Scene, effects: str) -> None:
    """Nothing that a scene does not call for is among its effects; mud is a solid and a fluid."""
    assert scene.effects == {Effect.ELASTICITY, *(Effect[name.upper()] for name in effects.split())}


@pytest.mark.parametrize("name", scenes.MEDIA)
def test_bed_at_rest_carries_its_strain(name: str) -> None:
    """b, history and stress are those of the strain; without one the bed is free of stress."""
    material, positions = scenes.MEDIA[name], np.full((2, 3), 0.1)
    free = MediumBed.at_rest(material, positions, np.ones(2))
    assert not free.stress.any()
    assert np.array_equal(free.left_cauchy_green, [[1, 1, 1, 0, 0, 0]] * 2)
    assert np.array_equal(free.history, np.full(2, 1.0 if name in ("snow", "water") else 0.0))
    strain = np.array([-0.0032, -0.003, -0.0031])
    bed = MediumBed.at_rest(material, positions, np.ones(2), np.tile(strain, (2, 1)))
    assert np.allclose(bed.left_cauchy_green[1], [*np.exp(2 * strain), 0, 0, 0], rtol=1e-15)
    assert bed.history[1] == (np.exp(strain.sum()) if name == "water" else free.history[1])
    assert np.allclose(bed.stress[1], [*material.stress(strain), 0, 0, 0], rtol=1e-14)
    assert (bed.stress[:, :3] < 0).all()


def test_particles_of_all_matter_are_counted() -> None:
    """Robot and sand together."""
    scene = scenes.medium_scene()
    assert scene.medium is not None
    assert scene.particle_count == scene.robot.particle_count + scene.medium.particle_count == 216 + 7 * 7 * 2 * 8


def test_lame_parameters_give_back_the_moduli() -> None:
    """E = mu (3 lambda + 2 mu) / (lambda + mu) and nu = lambda / (2 (lambda + mu))."""
    mu, lam = lame_parameters(12.0, 0.3)
    assert mu * (3 * lam + 2 * mu) / (lam + mu) == pytest.approx(12.0)
    assert lam / (2 * (lam + mu)) == pytest.approx(0.3)


def test_cone_slope_is_that_of_triaxial_compression() -> None:
    """At the friction angle the principal stresses of the cone stand at (1 + sin) / (1 - sin)."""
    slope = scenes.SAND.cone_slope
    sine = np.sin(np.radians(scenes.SAND.friction_angle))
    stress = -np.array([(1 + sine) / (1 - sine), 1.0, 1.0])
    deviator = stress - stress.mean()
    assert np.linalg.norm(deviator) == pytest.approx(-slope * stress.sum())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"left_cauchy_green": np.ones((1, 6))}, "left_cauchy_green have shape"),
        ({"history": np.zeros((1, 1))}, "history have shape"),
        ({"stress": np.zeros((1, 3))}, "stress have shape"),
        ({"velocities": np.zeros((1, 3))}, "velocities have shape"),
        ({"history": np.full_like(scenes.medium_bed().history, np.inf)}, "history hold values that are not finite"),
        (
            {"positions": np.full_like(scenes.medium_bed().positions, np.nan)},
            "positions hold values that are not finite",
        ),
        ({"volumes": np.zeros_like(scenes.medium_bed().volumes)}, "without volume"),
        ({"material": replace(scenes.medium_bed().material, friction_angle=95.0)}, "friction_angle is 95"),
        ({"material": replace(scenes.medium_bed().material, density=0.0)}, "density is 0"),
    ],
)
def test_impossible_sand_is_refused(changes: dict[str, object], message: str) -> None:
    """A bed must have particles, volume and a material that exists."""
    bed = replace(scenes.medium_bed(), **changes)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=message):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, medium=bed)
