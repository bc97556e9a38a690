"""Scenes that are refused, and the effects that follow from a scene."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import SceneError
from zoobench.sim.model.laws_numpy import principal_stress
from zoobench.sim.model.matter import lame_parameters
from zoobench.sim.model.scene import Effect, ElasticBody, Ground, MediumBed, Scene


def _scene_of(**changes: object) -> Scene:
    body = replace(scenes.muscle_body(), **changes)  # type: ignore[arg-type]
    return Scene(body, (0.0, 0.0, 0.0), scenes.ARENA)


COUNT = scenes.muscle_body().particle_count


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("volumes", np.ones(COUNT - 1)),
        ("stiffness", np.ones((COUNT, 1))),
        ("density_ratio", np.ones(COUNT + 1)),
        ("occupancy", np.ones(1)),
        ("muscle_membership", np.ones((COUNT - 1, 3))),
        ("fibres", np.ones((COUNT, 2))),
        ("velocities", np.zeros((3, COUNT))),
    ],
)
def test_array_of_another_shape_is_refused(name: str, value: np.ndarray) -> None:
    """The message names the array, its shape and the one expected."""
    with pytest.raises(SceneError, match=rf"body's {name} have shape .*; .* was expected"):
        _scene_of(**{name: value})


def test_positions_must_be_points() -> None:
    """Positions of two coordinates are refused."""
    with pytest.raises(SceneError, match="positions have shape"):
        _scene_of(positions=scenes.muscle_body().positions[:, :2])


@pytest.mark.parametrize(
    "name",
    ["positions", "volumes", "stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres", "velocities"],
)
def test_array_with_a_nan_is_refused(name: str) -> None:
    """A value that is not finite is named."""
    value = getattr(scenes.muscle_body(), name).copy()
    value.flat[7] = np.nan
    with pytest.raises(SceneError, match=rf"body's {name} hold values that are not finite"):
        _scene_of(**{name: value})


@pytest.mark.parametrize("name", ["volumes", "stiffness", "density_ratio"])
def test_value_that_is_not_positive_is_refused(name: str) -> None:
    """The smallest value is quoted."""
    value = getattr(scenes.muscle_body(), name).copy()
    value[7] = -0.25
    with pytest.raises(SceneError, match=rf"{name} must be positive; the smallest is -0.25"):
        _scene_of(**{name: value})


def test_empty_body_is_refused() -> None:
    """No particle, or none with an occupancy above 0."""
    with pytest.raises(SceneError, match="empty"):
        _scene_of(occupancy=np.zeros(COUNT))
    with pytest.raises(SceneError, match="empty"):
        Scene(ElasticBody.passive(scenes.SOFT, np.zeros((0, 3)), np.zeros(0)), (0.0, 0.0, 0.0), scenes.ARENA)


@pytest.mark.parametrize("ratio", [0.5, 0.7, -1.0])
def test_impossible_poissons_ratio_is_refused(ratio: float) -> None:
    """Outside (-1, 0.5) matter is incompressible or unstable."""
    with pytest.raises(SceneError, match="Poisson's ratio"):
        _scene_of(material=replace(scenes.SOFT, poissons_ratio=ratio))


def test_negative_friction_is_refused() -> None:
    """Friction takes energy, never gives it."""
    with pytest.raises(SceneError, match=r"friction coefficient of -0\.1 is negative"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(-0.1))


def test_ground_must_be_the_floor_of_the_arena() -> None:
    """The ground plane is y = 0."""
    with pytest.raises(SceneError, match=r"begins at y = -0.5 m"):
        Scene(scenes.muscle_body(), (0.0, -0.5, 0.0), scenes.ARENA, ground=Ground(0.5))


def test_matter_outside_the_arena_is_refused() -> None:
    """The message counts the particles and names the body and the first place."""
    with pytest.raises(SceneError, match=r"216 particles of the robot lie outside .*Move the robot or widen"):
        Scene(scenes.muscle_body((0.8, 0.3, 0.3)), (0.0, 0.0, 0.0), scenes.ARENA)
    bed = scenes.medium_bed()
    bed = replace(bed, positions=bed.positions + np.array([0.0, 0.0, 0.3]))
    with pytest.raises(SceneError, match="particles of the medium lie outside"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, medium=bed)


def test_effects_follow_from_the_scene() -> None:
    """Nothing that a scene does not call for is among its effects."""
    assert scenes.flight_scene().effects == {Effect.ELASTICITY, Effect.MUSCLE}
    assert scenes.ground_scene().effects == {Effect.ELASTICITY, Effect.MUSCLE, Effect.FRICTION}
    assert scenes.ground_scene(friction=0.0).effects == {Effect.ELASTICITY, Effect.MUSCLE}
    block = scenes.passive_block((0.3, 0.3, 0.3), (2, 2, 2), np.zeros(3))
    assert Scene(block, (0.0, 0.0, 0.0), scenes.ARENA).effects == {Effect.ELASTICITY}
    limp = replace(scenes.SOFT, muscle_strength=0.0)
    assert _scene_of(material=limp).effects == {Effect.ELASTICITY}


@pytest.mark.parametrize(
    ("name", "own"),
    [
        ("sand", {Effect.PLASTICITY}),
        ("clay", {Effect.PLASTICITY}),
        ("snow", {Effect.PLASTICITY}),
        ("mud", {Effect.PLASTICITY, Effect.FLUID}),
        ("water", {Effect.FLUID}),
    ],
)
def test_effects_of_a_medium_are_its_laws(name: str, own: set[Effect]) -> None:
    """Plasticity for solids, fluid for water; mud is both."""
    common = {Effect.ELASTICITY, Effect.MUSCLE, Effect.FRICTION}
    assert scenes.medium_scene(name).effects == common | own


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
    assert np.allclose(bed.stress[1], [*principal_stress(material, strain), 0, 0, 0], rtol=1e-14)
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
        ({"material": replace(scenes.SOFT, density=-1.0)}, "density is -1"),
        ({"material": replace(scenes.SOFT, youngs_modulus=0.0)}, "youngs_modulus is 0"),
        ({"occupancy": np.full(COUNT, 1.5)}, "occupancy reaches 1.5 to 1.5"),
        ({"velocity_gradients": np.zeros((COUNT, 3))}, "velocity_gradients have shape"),
        ({"velocity_gradients": np.full((COUNT, 3, 3), np.nan)}, "velocity_gradients hold values that are not finite"),
    ],
)
def test_impossible_body_is_refused(changes: dict[str, object], message: str) -> None:
    """Density, stiffness, occupancy and initial velocity gradient must mean something."""
    with pytest.raises(SceneError, match=message):
        _scene_of(**changes)


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
        ({"material": replace(scenes.medium_bed().material, friction_angle=95.0)}, "friction angle of 95"),
        ({"material": replace(scenes.medium_bed().material, density=0.0)}, "density is 0"),
    ],
)
def test_impossible_sand_is_refused(changes: dict[str, object], message: str) -> None:
    """A bed must have particles, volume and a material that exists."""
    bed = replace(scenes.medium_bed(), **changes)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=message):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, medium=bed)


def test_gravity_and_friction_must_be_finite() -> None:
    """A NaN would reach every node in one substep."""
    with pytest.raises(SceneError, match=r"gravity .* is not finite"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, gravity=(0.0, float("nan"), 0.0))
    with pytest.raises(SceneError, match="negative or not finite"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(float("nan")))
