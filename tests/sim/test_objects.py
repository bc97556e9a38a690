"""Elastic bodies beside the robot, on firm ground and on a bed: closed forms, conservation, and the gradient."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.test_adjoint import Probe
from zoobench.arrays import Array
from zoobench.designs.sampling import Shape
from zoobench.errors import SceneError
from zoobench.sim.model.elastic_bodies import ElasticBody, SceneObject, in_fields
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.rollout import Gradient
from zoobench.sim.model.scene import Effect, Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench.sim.model.terrain import Terrain
from zoobench.sim.solver import Solver
from zoobench_verify.energies import energy_balance
from zoobench_verify.validate.object_contacts import on_a_back

H = scenes.SPACING
GRAVITY = 9.81


def _block(lower: tuple[float, float, float], cells: int = 3, velocity: Array | None = None) -> ElasticBody:
    """A block of an edge [cells], stiffer and heavier than the robot and of another Poisson's ratio."""
    body = scenes.passive_block(lower, (cells, cells, cells), np.zeros(3) if velocity is None else velocity)
    return replace(body, material=replace(body.material, density=1500.0, poissons_ratio=0.2))


def _beside(scene: Scene, **given: Any) -> Scene:
    """The scene with a block half a cell beside its robot."""
    right = scene.robot.positions.max(0)[0] + 0.5 * H
    low, front = scene.robot.positions.min(0)[1:] - 0.25 * H
    return replace(scene, objects=(SceneObject("block", _block((float(right), float(low), float(front)))),), **given)


def _inside(deep: float) -> ElasticBody:
    """A block of two cells that begins so deep in the muscle cube [cells]."""
    robot = scenes.ground_scene().robot
    low, _, front = (float(each) for each in robot.positions.min(axis=0) - 0.5 * scenes.EDGE)
    return _block((low - 2 * H + deep * H, 0.0, front), 2)


def _sharing(friction: float = 0.5, edge: float | None = None) -> tuple[SceneObject, ...]:
    """A block, and one with this friction and edge of its cubes [m] that shares its velocity field."""
    other = replace(_block((0.1, 0.0, 0.1)), edge=edge)
    return SceneObject("a", _block((0.5, 0.0, 0.5))), SceneObject("b", other, friction, shares=True)


def ground_scene() -> Scene:
    """The muscle cube thrown at a block on the ground."""
    scene = scenes.ground_scene()
    thrown = replace(scene.robot, velocities=scene.robot.velocities + np.array([0.5, 0.0, 0.0]))
    return _beside(replace(scene, robot=thrown))


def bed_scene() -> Scene:
    """The same on a bed of sand, into which both sink: three bodies with velocity fields of their own."""
    scene = scenes.interface_scene()
    thrown = replace(scene.robot, velocities=scene.robot.velocities + np.array([0.5, 0.0, 0.0]))
    return _beside(replace(scene, robot=thrown))


def hill_scene() -> Scene:
    """The same on a slope that bends, whose nodes are above and below its surface."""
    scene = ground_scene()
    x = np.arange(13) * 0.1
    hills = Terrain(np.repeat((0.08 * x + 0.02 * np.sin(7.0 * x) + 0.03)[:, None], 13, axis=1), 0.1)
    bodies = scene.robot, scene.objects[0].body
    robot, block = (replace(body, positions=body.positions + np.array([0.0, 0.07, 0.0])) for body in bodies)
    return replace(
        scene, robot=robot, objects=(replace(scene.objects[0], body=block),), ground=Ground(0.5, terrain=hills)
    )


SCENES = {"ground": ground_scene, "hills": hill_scene, "bed": bed_scene}
# each compiles kernels of its own, and those of three bodies on a bed take longest
_PARAMS = ["ground", pytest.param("hills", marks=pytest.mark.slow), pytest.param("bed", marks=pytest.mark.slow)]
EVERY_SCENE = pytest.mark.parametrize("name", _PARAMS)


@pytest.fixture(scope="module", params=_PARAMS)
def probed(request: pytest.FixtureRequest) -> tuple[Probe, Gradient]:
    """A random functional of the paths of robot and block in an episode, and its gradient."""
    probe = Probe(SCENES[request.param](), 10)
    return probe, probe.gradient()


@pytest.mark.slow  # the conformance suite has the tasks with an object
@pytest.mark.parametrize("name", scenes.GROUPS)
def test_the_gradient_matches_central_differences(name: str, probed: tuple[Probe, Gradient]) -> None:
    """By every group of the robot's parameters, through the contact with the block."""
    probe, gradient = probed
    direction = np.random.default_rng(5).normal(size=probe.base[name].shape)
    assert probe.error(gradient, name, direction, 1e-6) <= 1e-5


@pytest.mark.slow  # the conformance suite has the gradient through what is pushed
@EVERY_SCENE
def test_the_block_is_pushed_and_its_path_differentiated(name: str) -> None:
    """It moves by a tenth of a cell, and its last place alone has a gradient by the robot's actuation."""
    scene = SCENES[name]()
    solver = Solver(scene, scenes.fidelity(), gradients=True)
    rollout = solver.run(scenes.actuation(solver, 10))
    block = scene.slice_of("block")
    path = rollout.positions[:, 0, block, 0].mean(1)
    assert path[-1] - path[0] > 0.1 * H
    weights = np.zeros_like(rollout.positions)
    weights[-1, 0, block, 0] = 1.0
    gradient = solver.backward(rollout, weights, np.zeros_like(weights))
    assert np.abs(gradient.actuation).max() > 0.0
    assert gradient.stiffness.shape == (1, scene.robot.particle_count)


def test_without_ground_and_gravity_momentum_stays_and_energy_falls() -> None:
    """The impulse between robot and block is equal and opposite, and inelastic."""
    scene = replace(ground_scene(), ground=None, gravity=scenes.NO_GRAVITY)
    bodies = (scene.robot, scene.objects[0].body)
    robot, block = (replace(body, positions=body.positions + np.array([0.0, 0.4, 0.0])) for body in bodies)
    scene = replace(scene, robot=robot, objects=(SceneObject("block", block),))
    solver = Solver(scene, scenes.fidelity())
    balances = [energy_balance(solver)]
    for _ in range(60):
        solver.substeps(1)
        balances.append(energy_balance(solver))
    momenta = np.array([balance.momentum for balance in balances])
    assert np.abs(momenta - momenta[0]).max() <= 1e-13 * np.abs(momenta[0]).max()
    assert max(balance.total for balance in balances) <= balances[0].total * (1 + 1e-12)
    assert balances[-1].total < 0.99 * balances[0].total
    assert solver.matter.v[0, 0, scene.slice_of("block"), 0].mean() > 0.01


@pytest.mark.slow  # the conformance suite has an object's motion, and its gradient
def test_a_body_moves_as_an_object_as_it_does_as_the_robot() -> None:
    """Out of reach of each other, each with moduli, density and velocity field of its own."""
    rng = np.random.default_rng(1)
    blocks = {"first": _block((0.5, 0.4, 0.5)), "second": _block((0.5, 0.4, 0.1))}
    blocks["second"] = replace(blocks["second"], material=ElasticMaterial(2e5, 0.4, 700.0, viscosity=3.0))
    for name, block in blocks.items():
        gradients = rng.normal(scale=3.0, size=(block.particle_count, 3, 3))
        velocities = block.velocities + np.array([0.3, 0.2, -0.1])
        blocks[name] = replace(block, velocities=velocities, velocity_gradients=gradients)
    far = scenes.with_idle_muscle(scenes.passive_block((0.1, 0.4, 0.1), (2, 2, 2), np.zeros(3)))
    objects = tuple(SceneObject(name, block) for name, block in blocks.items())
    found = Solver(replace(scenes.weightless(far), objects=objects), scenes.fidelity())
    found.substeps(40, 1e-4)
    for name, block in blocks.items():
        alone = Solver(scenes.weightless(block), scenes.fidelity())
        alone.substeps(40, 1e-4)
        places = found.matter.x[0, 0, found.scene.slice_of(name)]
        assert np.abs((places - alone.matter.x[0, 0]).numpy()).max() <= 1e-13, name


def test_a_lighter_object_than_the_robot_is_possible() -> None:
    """Its density is its own, and not one that a design of the robot may have."""
    scene = replace(ground_scene(), ground=None, gravity=scenes.NO_GRAVITY)  # in flight, as above, for its kernels
    light = replace(scene.objects[0].body, material=replace(scene.objects[0].body.material, density=200.0))
    solver = Solver(replace(scene, objects=(SceneObject("block", light),)), scenes.fidelity())
    rollout = solver.run(scenes.actuation(solver, 2))
    assert not rollout.divergences


def _pair(speed: float, apart: float) -> Scene:
    """Two blocks of one velocity field in flight, far from the robot, of which one goes towards the other [m/s] over a
    gap [cells]."""
    near = _block((0.1, 0.4, 0.4), velocity=np.array([speed, 0.0, 0.0]))
    far = _block((0.1 + (3 + apart) * H, 0.4, 0.4))
    objects = (SceneObject("near", near), SceneObject("far", far, shares=True))
    return replace(ground_scene(), ground=None, gravity=scenes.NO_GRAVITY, objects=objects)


def test_objects_are_sorted_by_their_fields() -> None:
    """Each field's in their order, of which all but the first share it; with a field each nothing changes."""
    things = [SceneObject(name, _block((0.5, 0.0, 0.5))) for name in "abcd"]
    found = [(each.name, each.shares) for each in in_fields(things, (0, 1, 0, 1))]
    assert found == [("a", False), ("c", True), ("b", False), ("d", True)]
    assert in_fields(things, range(4)) == tuple(things)


def test_bodies_of_one_field_stick_where_they_meet() -> None:
    """They go on together with their momentum, and do not come apart again."""
    scene = _pair(0.5, 1.0)
    solver = Solver(scene, scenes.fidelity())
    near, far = (scene.slice_of(name) for name in ("near", "far"))
    mass = scene.elastic.masses[near, None]
    before = (mass * (scene.elastic.velocities[near] + scene.elastic.velocities[far])).sum(axis=0)
    rollout = solver.run(np.zeros((40, 1, solver.muscle_count)))
    velocities = rollout.velocities[:, 0]
    after = (mass * (velocities[-1, near] + velocities[-1, far])).sum(axis=0)
    np.testing.assert_allclose(after, before, atol=1e-12 * np.abs(before).max())
    apart = (rollout.positions[:, 0, far] - rollout.positions[:, 0, near])[..., 0].mean(axis=1)
    assert np.ptp(apart[20:]) < 0.1 * H
    assert velocities[20:, far, 0].mean() == pytest.approx(0.25, rel=0.02)


def test_bodies_of_one_field_move_each_alone_out_of_reach() -> None:
    """To rounding, as does one that has the field to itself."""
    scene = _pair(0.3, 4.0)
    both = Solver(scene, scenes.fidelity())
    both.substeps(40, 1e-4)
    for each in scene.objects:
        alone = Solver(replace(scene, objects=(replace(each, shares=False),)), scenes.fidelity())
        alone.substeps(40, 1e-4)
        places = (solver.matter.x[0, 0, solver.scene.slice_of(each.name)] for solver in (both, alone))
        assert np.abs(np.subtract(*(place.numpy() for place in places))).max() <= 1e-13, each.name


@pytest.mark.slow
def test_the_gradient_goes_through_ten_bodies_of_one_field() -> None:
    """By actuation and stiffness of the robot, which is thrown at them in flight."""
    scene = ground_scene()
    right, low, front = scene.objects[0].body.positions.min(axis=0) - 0.25 * H
    places = [(row, across) for row in range(4) for across in ((0.5, -1.5, 2.5), (-0.5, 1.5))[row % 2]]
    blocks = [_block((right + 2.25 * H * x, low, front + 1.125 * H * z), 2) for x, z in places]
    things = [SceneObject(f"block-{number}", block) for number, block in enumerate(blocks)]
    objects = in_fields(things, 10 * (0,))
    probe = Probe(replace(scene, ground=None, gravity=scenes.NO_GRAVITY, objects=objects), 10)
    gradient = probe.gradient()
    for name in ("actuation", "stiffness"):
        direction = np.random.default_rng(5).normal(size=probe.base[name].shape)
        assert probe.error(gradient, name, direction, 1e-6) <= 1e-5


@pytest.mark.slow
def test_a_sliding_block_stops_where_friction_on_the_ground_stops_it() -> None:
    """After v^2 / (2 mu g), by its own friction and not by that of the ground or of another block."""
    speed, frictions = 0.5, {"near": 0.3, "beyond": 0.2}
    far = scenes.with_idle_muscle(scenes.passive_block((0.05, 0.0, 0.05), (2, 2, 2), np.zeros(3)))
    block = _block((0.3, 0.0, 0.3), velocity=np.array([speed, 0.0, 0.0]))
    block = standing(Scene(block, (0, 0, 0), scenes.ARENA, ground=Ground(1.0)), scenes.EDGE).robot
    other = replace(block, positions=block.positions + np.array([0.0, 0.0, 0.3]))
    slide = tuple(
        SceneObject(name, body, ground_friction=frictions[name])
        for name, body in zip(frictions, (block, other), strict=True)
    )
    scene = Scene(far, (0, 0, 0), (1.5, 0.5, 1.0), ground=Ground(1.0), objects=slide)
    solver = Solver(scene, scenes.fidelity())
    rollout = solver.run(np.zeros((40, 1, solver.muscle_count)))
    for name, friction in frictions.items():
        path = rollout.positions[:, 0, scene.slice_of(name), 0].mean(1)
        assert path[-1] - path[0] == pytest.approx(speed**2 / (2 * friction * GRAVITY), rel=0.05), name
        assert np.ptp(path[-15:]) < 0.005, name  # it rocks on the ground's layer


@pytest.mark.slow
def test_the_smaller_friction_of_two_objects_holds() -> None:
    """A block slides on another one as if both had it, and less far where both have more."""
    far = scenes.with_idle_muscle(scenes.passive_block((0.05, 0.0, 0.05), (2, 2, 2), np.zeros(3)))
    low = scenes.passive_block((0.3, 0.0, 0.3), (6, 2, 3), np.zeros(3))
    low = standing(Scene(low, (0, 0, 0), scenes.ARENA, ground=Ground(1.0)), scenes.EDGE).robot
    top = float(low.positions[:, 1].max()) + 0.5 * scenes.EDGE
    high = scenes.passive_block((0.3, top, 0.3), (3, 2, 3), np.array([0.5, 0.0, 0.0]))
    scene = Scene(far, (0, 0, 0), scenes.ARENA, ground=Ground(1.0))
    paths = []
    for pair in ((0.1, 0.8), (0.8, 0.1), (0.1, 0.1), (0.8, 0.8)):
        objects = (SceneObject("low", low, pair[0], 1.0), SceneObject("high", high, pair[1]))
        solver = Solver(replace(scene, objects=objects), scenes.fidelity())
        paths.append(solver.run(np.zeros((6, 1, 1))).positions[:, 0, solver.scene.slice_of("high"), 0])
    assert np.array_equal(paths[0], paths[2])
    assert np.array_equal(paths[1], paths[2])
    assert paths[3][-1].mean() < paths[2][-1].mean() - 0.1 * H


@pytest.mark.parametrize("edge", [0.5 * scenes.EDGE, 2.0 * scenes.EDGE])
def test_an_object_stands_on_cubes_of_its_own(edge: float) -> None:
    """As high whatever the robot's particles stand for."""
    block = standing(Scene(_block((0.4, 0.0, 0.4)), (0, 0, 0), scenes.ARENA, ground=Ground(0.5)), scenes.EDGE).robot
    far = scenes.with_idle_muscle(scenes.passive_block((0.05, 0.0, 0.05), (2, 2, 2), np.zeros(3)))
    scene = Scene(replace(far, edge=edge), (0, 0, 0), scenes.ARENA, ground=Ground(0.5))
    solver = Solver(replace(scene, objects=(SceneObject("block", block),)), scenes.fidelity())
    solver.equilibrate(30)
    places = solver.positions(0)[solver.scene.slice_of("block")]
    assert np.abs((places - block.positions)[:, 1]).mean() < 0.02 * H


def test_a_ball_rolls_down_a_slope_on_which_a_box_stays() -> None:
    """With 5/7 of the acceleration of what slides without friction, within 5 %, at four cells across."""
    slope, radius, grid = np.radians(10.0), 0.025, Fidelity(1 / 80, precision=32, sleep=0.0)
    solid = Shape.standing(lambda x: np.linalg.norm(x - [0.0, radius, 0.0], axis=-1) <= radius, *3 * (2 * radius,))
    box = Shape.standing(lambda x: x[:, 0] < np.inf, *3 * (2 * radius,))
    matter, ground, bodies = ElasticMaterial(1e5, 0.3, 600.0), Ground(0.5), []
    for name, shape, place in (("ball", solid, 0.1), ("box", box, 0.2)):
        sample = shape.sample(grid)
        body = ElasticBody.passive(matter, sample.positions + np.array([0.1, 0.0, place]), sample.volumes)
        level = Scene(body, (0, 0, 0), scenes.ARENA, ground=ground, gravity=(0.0, -GRAVITY * np.cos(slope), 0.0))
        bodies.append(SceneObject(name, standing(level, grid.particle_edge).robot, ground_friction=0.5))
    far = scenes.with_idle_muscle(scenes.passive_block((0.02, 0.02, 0.02), (1, 1, 1), np.zeros(3)))
    down = (GRAVITY * np.sin(slope), -GRAVITY * np.cos(slope), 0.0)
    scene = Scene(far, (0, 0, 0), (0.5, 0.1, 0.3), ground=ground, gravity=down, objects=tuple(bodies))
    rollout = Solver(scene, grid).run(np.zeros((40, 1, 1)))
    speed = rollout.velocities[:, 0, scene.slice_of("ball"), 0].mean(1)
    acceleration = np.polyfit(0.008 * np.arange(15, 41), speed[15:], 1)[0]
    assert acceleration == pytest.approx(5 / 7 * GRAVITY * np.sin(slope), rel=0.05)
    places = rollout.positions[:, 0, scene.slice_of("box"), 0].mean(1)
    assert abs(places[25:].mean() - places[10:25].mean()) < 3e-4


@pytest.mark.slow
def test_a_block_rests_on_a_bed_that_bears_it() -> None:
    """On sand it comes to rest, hardly below where it began."""
    scene = scenes.medium_scene("sand")
    assert scene.medium is not None
    high = 2 * H
    block = SceneObject("block", _block((10 * H, high, 10 * H)))
    away = replace(scene.robot, positions=scene.robot.positions + np.array([0.3, -high, 0.0]))
    scene = replace(scene, robot=away, medium=replace(scene.medium, friction=0.5), gravity=(0.0, -GRAVITY, 0.0))
    solver = Solver(replace(scene, objects=(block,)), scenes.fidelity())
    rollout = solver.run(np.zeros((25, 1, solver.muscle_count)))
    low = rollout.positions[:, 0, solver.scene.slice_of("block"), 1].min(1)
    assert high - 0.5 * H < low[-1] < high + 0.25 * H
    assert abs(low[-1] - low[-5]) < 0.02 * H


@pytest.mark.slow
@EVERY_SCENE
def test_drivers_agree(name: str) -> None:
    """The serial and the parallel one, in path and gradient."""
    scenes.compare_drivers(SCENES[name](), 3)


@pytest.mark.slow
def test_single_precision_agrees_with_double() -> None:
    """In the gradient, where three bodies meet."""
    scenes.compare_precisions(bed_scene())


def test_an_object_is_an_effect_of_contact() -> None:
    """Only a scene with one has it."""
    assert Effect.CONTACT in ground_scene().effects
    assert Effect.CONTACT not in replace(ground_scene(), objects=()).effects


def test_bodies_are_found_by_name() -> None:
    """One after the other, the medium last; a name that no body has is refused with those there are."""
    scene = bed_scene()
    assert scene.medium is not None
    sizes = [scene.robot.particle_count, scene.objects[0].body.particle_count, scene.medium.particle_count]
    ends = np.cumsum(sizes)
    assert [scene.slice_of(name).stop for name in ("robot", "block", "medium")] == ends.tolist()
    with pytest.raises(SceneError, match=r"'ball'\. It has: robot, block, medium"):
        scene.slice_of("ball")


@pytest.mark.parametrize(
    ("objects", "told"),
    [
        ((SceneObject("robot", _block((0.5, 0.0, 0.5))),), "Two bodies have the name 'robot'"),
        ((SceneObject("a", scenes.muscle_body((0.5, 0.0, 0.5))),), "'a' has muscles"),
        ((SceneObject("a", _block((0.5, 0.0, 0.5)), friction=-1.0),), "friction of -1 of the a"),
        ((SceneObject("a", _block((5.0, 0.0, 0.5))),), "particles of the a lie outside"),
        ((SceneObject("a", _inside(0.5)),), "a begins within the robot"),
        ((SceneObject("a", _inside(2.0)),), "a begins within the robot"),
        (tuple(SceneObject(name, _block((0.5, 0.0, 0.5))) for name in "ab"), "b begins within the a"),
        ((SceneObject("a", _block((0.5, 0.0, 0.5)), shares=True),), "a cannot share the velocity field of what is"),
        (_sharing(friction=0.4), "b cannot share .* the same material, friction"),
        (_sharing(edge=0.01), "b cannot share .* size of cubes"),
    ],
)
def test_impossible_objects_are_refused(objects: tuple[SceneObject, ...], told: str) -> None:
    """With the object's name."""
    with pytest.raises(SceneError, match=told):
        replace(scenes.ground_scene(), objects=objects)


def test_bodies_that_touch_do_not_overlap() -> None:
    """Side by side without a gap, and a quarter of a cell apart."""
    robot = scenes.ground_scene().robot
    right, low, front = robot.positions.max(0)[0] + 0.5 * scenes.EDGE, *(robot.positions.min(0)[1:] - 0.5 * scenes.EDGE)
    for gap in (0.0, 0.25 * H):
        block = SceneObject("a", _block((float(right) + gap, float(low), float(front))))
        assert replace(scenes.ground_scene(), objects=(block,)).objects


@pytest.mark.parametrize("depth", [0.25, 0.5, 0.9])
def test_a_single_layer_that_overlaps_is_refused(depth: float) -> None:
    """By a quarter of a cube on, whether or not the cubes of both lie in a row."""
    robot = scenes.ground_scene().robot
    place = robot.positions.max(0) + 0.5 * scenes.EDGE - depth * scenes.EDGE
    place[1:] = robot.positions.min(0)[1:] + 0.5 * scenes.EDGE * np.array([0.0, 1.0])
    x, y, z = place
    with pytest.raises(SceneError, match="The a begins within the robot"):
        replace(scenes.ground_scene(), objects=(SceneObject("a", _block((float(x), float(y), float(z)))),))


def test_an_arena_does_not_follow_a_robot_away_from_objects() -> None:
    """The objects would stay where the grid no longer is."""
    with pytest.raises(SceneError, match="away from objects"):
        replace(ground_scene(), follows=True)


def test_a_step_and_a_failure_are_told_of_the_body_that_causes_them() -> None:
    """The block is stiffer than the robot, and one in two pieces is torn, by its name."""
    scene = ground_scene()
    solver = Solver(scene, scenes.fidelity())
    solver.reset()
    assert solver.current_limit()[0].matter == "object block"
    soft = replace(scene.objects[0].body.material, youngs_modulus=10.0)
    easy = replace(scene, objects=(SceneObject("block", replace(scene.objects[0].body, material=soft)),))
    assert Solver(easy, scenes.fidelity()).current_limit()[0].matter != "object block"
    start = solver.matter.copy_slot(0)
    own = np.arange(scene.particle_count)[scene.slice_of("block")]
    places = scene.objects[0].body.positions[:, 0]
    start.x[0, 0, own[places > places.mean()], 0] += 3.0 * H
    start.v[:] = 0.0
    rollout = Solver(scene, scenes.fidelity(), start=start).run(np.zeros((1, 1, scenes.MUSCLES)))
    found = rollout.tears[0]
    assert found.body == "block"
    assert found.particle in own
    assert "of the block near" in str(found)
    assert "The block is torn: make it stiffer" in str(found)


def test_an_object_sets_the_same_step_in_water_as_outside() -> None:
    """Its constants are read from behind those of the water."""
    dry = _beside(scenes.flight_scene(moving=False))
    limits = [Solver(scene, scenes.fidelity()).current_limit()[0] for scene in (dry, replace(dry, water=GridWater()))]
    assert limits[0].matter == "object block"
    assert limits[1] == limits[0]


def test_a_body_in_water_is_as_thick_to_it_as_without_another_beside_it() -> None:
    """Also where they touch when they begin."""
    alone = replace(scenes.flight_scene(), water=GridWater())
    found = [Solver(scene, scenes.fidelity()).parameters.cover for scene in (alone, _beside(alone))]
    assert (found[0] > 1.0).any()
    assert (found[0][0] == found[1][0, : alone.robot.particle_count]).all()


def test_objects_are_refused_in_a_medium_that_sticks() -> None:
    """They need a velocity field of their own there, too."""
    with pytest.raises(SceneError, match="Give the medium a friction"):
        replace(scenes.medium_scene("sand"), objects=(SceneObject("a", _block((0.5, 0.3, 0.5))),))


@pytest.mark.slow
def test_a_box_slips_on_a_back_as_friction_lets_it() -> None:
    """One of 5 cells, whose edges a contact could catch on, is taken along with mu g within 12 %."""
    times, speeds = on_a_back(5, 1.0, 0.5)
    late = times > 0.3 * times[-1]
    assert np.polyfit(times[late], speeds[late], 1)[0] == pytest.approx(0.5 * GRAVITY, rel=0.12)
