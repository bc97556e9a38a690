"""What a scene refuses, and the effects that follow from it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import SceneError
from zoobench.sim.scene import Effect, ElasticBody, Ground, Scene, lame_parameters


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
    bed = scenes.sand_bed()
    bed = replace(bed, positions=bed.positions + np.array([0.0, 0.0, 0.3]))
    with pytest.raises(SceneError, match="particles of the sand lie outside"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, sand=bed)


def test_effects_follow_from_the_scene() -> None:
    """Nothing that a scene does not call for is among its effects."""
    assert scenes.flight_scene().effects == {Effect.ELASTICITY, Effect.MUSCLE}
    assert scenes.ground_scene().effects == {Effect.ELASTICITY, Effect.MUSCLE, Effect.FRICTION}
    assert scenes.ground_scene(friction=0.0).effects == {Effect.ELASTICITY, Effect.MUSCLE}
    assert scenes.sand_scene().effects == set(Effect)
    block = scenes.passive_block((0.3, 0.3, 0.3), (2, 2, 2), np.zeros(3))
    assert Scene(block, (0.0, 0.0, 0.0), scenes.ARENA).effects == {Effect.ELASTICITY}
    limp = replace(scenes.SOFT, muscle_strength=0.0)
    assert _scene_of(material=limp).effects == {Effect.ELASTICITY}


def test_particles_of_all_matter_are_counted() -> None:
    """Robot and sand together."""
    scene = scenes.sand_scene()
    assert scene.sand is not None
    assert scene.particle_count == scene.robot.particle_count + scene.sand.particle_count == 216 + 7 * 7 * 2 * 8


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
        ({"strains": np.zeros((1, 3))}, "strains have shape"),
        ({"positions": np.full_like(scenes.sand_bed().positions, np.nan)}, "positions hold values that are not finite"),
        ({"volumes": np.zeros_like(scenes.sand_bed().volumes)}, "without volume"),
        ({"material": replace(scenes.sand_bed().material, friction_angle=95.0)}, "friction angle of 95"),
        ({"material": replace(scenes.sand_bed().material, density=0.0)}, "density is 0"),
    ],
)
def test_impossible_sand_is_refused(changes: dict[str, object], message: str) -> None:
    """A bed must have particles, volume and a material that exists."""
    bed = replace(scenes.sand_bed(), **changes)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=message):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, sand=bed)


def test_gravity_and_friction_must_be_finite() -> None:
    """A NaN would reach every node in one substep."""
    with pytest.raises(SceneError, match=r"gravity .* is not finite"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, gravity=(0.0, float("nan"), 0.0))
    with pytest.raises(SceneError, match="negative or not finite"):
        Scene(scenes.muscle_body(), (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(float("nan")))
