"""The ocean in its three kinds of water."""

from dataclasses import replace

import numpy as np
import pytest

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Effect
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

SMOKE = Fidelity(1 / 32)


def _made(text: str) -> Environment:
    env: Environment = registry.create(Kind.ENV, Ref.parse(text))
    return env


def _body(design: str, fidelity: Fidelity) -> Body:
    body: Body = registry.create(Kind.DESIGN, Ref.parse(design)).body(fidelity)
    return body


def test_water_by_forces_has_its_robot_in_its_rest_frame() -> None:
    """Whatever the fidelity says, on a GPU, too; the others leave it as it is."""
    surface = _made("ocean")
    assert surface.simulated(SMOKE).robot == "lagrangian"
    assert _made("ocean[water=grid]").simulated(SMOKE) is SMOKE
    assert surface.simulated(Fidelity(1 / 32, device="cuda")).device == "cuda"
    with pytest.raises(UsageError, match="particles_per_cell=8 or 27") as refusal:
        surface.simulated(Fidelity(1 / 32, particles_per_cell=1))
    assert "robot=mpm" not in str(refusal.value)  # which would change nothing


def test_water_by_forces_has_no_bounds() -> None:
    """A robot that a current takes out of its arena goes as in one of three times the size."""
    env = _made("ocean[current=2]")
    fidelity, (length, height, width) = env.simulated(replace(SMOKE, precision=64)), env.arena
    body, paths = _body("block", fidelity), []
    for factor in (1.0, 3.0):
        wide = replace(env, arena=(factor * length, factor * height, factor * width))
        solver = Solver(wide.scene(body, fidelity), fidelity)
        rollout = solver.run(np.full((100, 1, solver.muscle_count), 0.3))
        assert not rollout.divergences
        paths.append(rollout.positions[:, 0] - rollout.positions[0, 0].mean(axis=0))
    assert paths[0][-1, :, 0].min() > length
    np.testing.assert_allclose(*paths, atol=1e-5)


@pytest.mark.slow
def test_bodies_of_any_height_float_in_water_by_forces() -> None:
    """There is no ground, and bodies of any height are in the middle of the picture."""
    env = _made("ocean")
    scene = env.scene(_body("panda[length=0.4]", env.simulated(SMOKE)), env.simulated(SMOKE))
    assert scene.ground is None
    assert scene.follows
    assert Effect.FLUID in scene.effects
    middle = (scene.robot.positions.max(axis=0) + scene.robot.positions.min(axis=0)) / 2
    assert middle[1] == pytest.approx(scene.upper[1] / 2, rel=0.05)


@pytest.mark.parametrize(
    ("place", "longer", "moved"),
    [
        ("ahead", (0.09375, 0.0), (0.0, 0.0)),
        ("behind", (0.09375, 0.0), (0.09375, 0.0)),
        ("left", (0.0, 0.09375), (0.0, 0.09375)),
        ("right", (0.0, 0.09375), (0.0, 0.0)),
    ],
)
def test_an_object_in_water_begins_beside_the_robot(
    place: str, longer: tuple[float, float], moved: tuple[float, float]
) -> None:
    """As high as that, on the side where the tank is larger for it."""
    made = _made(f"ocean[water=grid,object=box,object_place={place}]")
    scene, empty = (env.scene(_body("caterpillar", SMOKE), SMOKE) for env in (made, _made("ocean[water=grid]")))
    robot, (thing,) = scene.robot.positions, scene.objects
    middle, other = (p[:, 1].min() + p[:, 1].max() for p in (robot, thing.body.positions))
    assert middle == pytest.approx(other, abs=1e-12)
    size, start = made.standing_size(1.6, SMOKE.grid_spacing)
    np.testing.assert_allclose((size - made.arena)[[0, 2]], longer)
    np.testing.assert_allclose((start - made.arena * np.array([0.4, 0.0, 0.5]))[[0, 2]], moved)
    assert not scene.follows
    assert empty.follows
    assert not empty.objects


@pytest.mark.parametrize("setting", ["object=box", "object=ball,object_size=0.1", "object=box,medium_density=1500"])
def test_an_object_in_water_is_as_dense_as_that_by_default(setting: str) -> None:
    """Whatever its form and size."""
    made = _made(f"ocean[water=grid,width=0.4,depth=0.3,{setting}]")
    assert made.water is not None
    (thing,) = made.scene(_body("caterpillar", SMOKE), SMOKE).objects
    assert thing.body.material.density == pytest.approx(made.water.density)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("water=surface,object=box", "possible in water on a grid, not with water=surface. Give water=grid"),
        ("water=particles,object=box", "not with water=particles"),
        ("water=grid,object=box,object_friction=0.1", "object_friction has no effect in water on a grid"),
        ("water=grid,object=box,object_height=0.1", "object_height has no effect"),
        ("water=grid,object=box,object_place=back", "object_place of back is not possible in water"),
        ("water=grid,object=box,object_mass=0.1", "An object of 0.1 kg, .* Give 0.123 kg or more, or none"),
        ("water=grid,object=box,object_mass_spread=0.9", "with the draw of object_mass_spread"),
        ("water=grid,object=beam,object_size=0.3", "or give the water a greater length, width or depth"),
    ],
)
def test_objects_that_water_does_not_take_are_refused(setting: str, told: str) -> None:
    """With what it takes."""
    with pytest.raises(UsageError, match=told):
        _made(f"ocean[{setting}]").scene(_body("caterpillar", SMOKE), SMOKE)


@pytest.mark.parametrize("setting", ["slope=5", "relief=0.02"])
def test_ground_is_refused_where_water_has_none(setting: str) -> None:
    """With the water that has one."""
    with pytest.raises(UsageError, match="use water=particles"):
        _made(f"ocean[{setting}]")


@pytest.mark.parametrize(
    ("setting", "remedy"), [("water=surface,onset=-1", "Give 0 or more"), ("water=grid,onset=0.1", "alone")]
)
def test_an_onset_is_refused_where_there_is_none(setting: str, remedy: str) -> None:
    """It is a time, and one of water by forces on the surface."""
    with pytest.raises(UsageError, match=remedy):
        _made(f"ocean[{setting}]")


@pytest.mark.slow
def test_a_current_takes_a_robot_along() -> None:
    """One that does not move its muscles drifts with it in the end."""
    env = _made("ocean[current=0.3]")
    fidelity = env.simulated(SMOKE)
    solver = Solver(env.scene(_body("block", fidelity), fidelity), fidelity)
    moved = solver.run(np.zeros((100, 1, solver.muscle_count))).positions[[0, -1], 0].mean(axis=1)
    assert 0.3 * 0.4 * 0.8 > moved[1, 0] - moved[0, 0] > 0.3 * 0.1 * 0.8
    assert moved[1, 1:] == pytest.approx(moved[0, 1:], abs=2e-3)


@pytest.mark.parametrize(
    ("setting", "remedy"),
    [
        ("current=20", "Give 10 m/s at most"),
        ("current=-300", "Give 10 m/s at most"),
        ("viscosity=5", "Leave it out"),
        ("viscosity=-1", "Leave it out"),
        ("depth=0.3", "depth=0.3 has no effect with water=surface"),
        ("length=1", "length=1 has no effect"),
        ("width=1", "width=1 has no effect"),
        ("bulk_modulus=2e5", "bulk_modulus=200000 has no effect"),
        ("tait_exponent=3", "tait_exponent=3 has no effect"),
    ],
)
def test_a_current_that_tears_bodies_and_settings_without_effect_are_refused(setting: str, remedy: str) -> None:
    """A current that is too fast is not simulated until all is NaN, and no setting is ignored in silence."""
    with pytest.raises(UsageError, match=remedy):
        _made(f"ocean[{setting}]")


def test_settings_at_their_defaults_and_those_of_other_water_are_not_refused() -> None:
    """What a run's reference holds without being typed stays as it was."""
    _made("ocean[depth=0.15625,length=0.4375,width=0.1875,bulk_modulus=1e5,tait_exponent=7,viscosity=0]")
    _made("ocean[water=particles,depth=0.3,length=1,width=1,bulk_modulus=2e5,tait_exponent=3,viscosity=5]")


def test_impossible_water_on_a_grid_is_refused_with_the_environment() -> None:
    """And not when its first run begins."""
    with pytest.raises(SceneError, match="viscosity of 0 or more"):
        _made("ocean[water=grid,viscosity=-1]")


def test_the_reason_why_scores_are_provisional_says_of_which_water() -> None:
    """How far swimmers go is not the same in water on a grid and by forces on the surface."""
    reason = registry.get(Kind.ENV, "ocean").provisional
    assert "in water on a grid" in reason
    for water, caveat in (("grid", reason), ("particles", reason), ("surface", "")):
        ref = registry.resolve(Kind.ENV, Ref.parse(f"ocean[water={water}]"))
        assert registry.caveat(Kind.ENV, ref) == caveat
