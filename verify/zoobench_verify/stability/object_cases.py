"""Objects: heavy ones on soft ones, rubble, one in a corner, one thrown against a wall, and a gripper on nothing."""

from dataclasses import replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.sim.model.elastic_bodies import ElasticBody, SceneObject, in_fields
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.solver import Solver
from zoobench.spec import Ref
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case

_H = scenes.SPACING
_SIZE = (24 * _H, 24 * _H, 24 * _H)
_BOX = ElasticMaterial(youngs_modulus=3e4, poissons_ratio=0.2, density=400.0)
_SOFT = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, viscosity=20.0)


def _block(corner: scenes.Vector, cells: tuple[int, int, int], material: ElasticMaterial = _BOX) -> ElasticBody:
    """A block with its corner at so many cells."""
    x, y, z = corner
    return scenes.passive(scenes.lattice((x * _H, y * _H, z * _H), cells), material)


def _with(body: ElasticBody, velocity: scenes.Vector) -> ElasticBody:
    return replace(body, velocities=body.velocities + np.array(velocity))


def _episode(
    record: EpisodeRecorder, robot: ElasticBody, things: list[ElasticBody], frames: int
) -> tuple[Scene, Rollout, Solver]:
    """An episode on the ground, whose bodies stay in the arena."""
    objects = [SceneObject(f"object-{number}", body) for number, body in enumerate(things)]
    fields = [number % 3 for number in range(len(objects))]
    scene = Scene(robot, scenes.ORIGIN, _SIZE, ground=Ground(0.5), objects=in_fields(objects, fields))
    solver = Solver(scene, scenes.fidelity())
    rollout, _ = record.episode(solver, frames)
    record.path_finite(rollout)
    beyond = [max(float(-places.min()), float((places - _SIZE[0]).max())) for places in _last(solver).values()]
    record.at_most("matter beyond the arena [cells]", max(beyond) / _H, 1.0)
    return scene, rollout, solver


def _last(solver: Solver) -> dict[str, Array]:
    """Positions of all bodies at the end [m]."""
    names = list(solver.scene.bodies)
    return {name: solver.positions(0)[solver.scene.slice_of(name)] for name in names}


@case("heavy-box-on-a-soft-back", is_fast=False)
def heavy_box_on_a_soft_back(record: EpisodeRecorder) -> None:
    """A box eight times as dense as the soft block below it is let down on it: it sinks in and stays on top."""
    back = _block((8, 0.25, 8), (8, 4, 8), _SOFT)
    box = _block((10, 4.5, 10), (4, 4, 4), replace(_BOX, density=8000.0))
    scene, rollout, solver = _episode(record, back, [box], 60)
    places = _last(solver)
    record.robot_volume(rollout, 0.3)
    above = (places["object-0"][:, 1].mean() - places["robot"][:, 1].mean()) / _H
    record.at_least("box above the middle of the back [cells]", float(above), 1.0)
    before = scene.objects[0].body.positions[:, 1].mean()
    record.at_least("sinks by [cells]", float(before - places["object-0"][:, 1].mean()) / _H, 0.1)


@case("rubble", is_fast=False)
def rubble(record: EpisodeRecorder) -> None:
    """A block falls at 2 m/s on a heap of ten boxes in three layers, which share three velocity fields."""
    block = _with(_block((9.5, 12.5, 8.5), (4, 4, 4), _SOFT), (0.0, -2.0, 0.0))
    ground = [(x, 0.5, z) for x in (6.5, 10.0, 13.5) for z in (7.0, 10.5)]
    above = [(8.0, 4.0, 7.5), (8.5, 4.0, 11.0), (12.0, 4.0, 9.0)]
    boxes = [_block(corner, (3, 3, 3)) for corner in (*ground, *above, (10.0, 7.5, 9.0))]
    _, rollout, solver = _episode(record, block, boxes, 60)
    record.robot_volume(rollout, 0.3)
    record.at_least("way of the farthest box [cells]", _farthest(solver), 1.0)


@case("robot-in-rubble", is_fast=False)
def robot_in_rubble(record: EpisodeRecorder) -> None:
    """A caterpillar whose muscles work is thrown at 2 m/s into ten boxes as high as itself."""
    grid = scenes.fidelity()
    env = registry.create(Kind.ENV, Ref.parse("ground[object=box,object_place=rubble,object_count=10]"))
    scene = env.scene(scenes.caterpillar(grid), grid)
    solver = Solver(replace(scene, robot=_with(scene.robot, (2.0, 0.0, 0.0))), grid)
    rollout, _ = record.episode(solver, scenes.muscle_wave(solver, 60))
    record.path_finite(rollout)
    record.robot_volume(rollout, 0.3)
    record.within("way of the farthest box [cells]", _farthest(solver), 0.1, 10.0)


def _farthest(solver: Solver) -> float:
    """How far the middle of that object has gone which has gone farthest [cells]."""
    places = _last(solver)
    ways = [(places[each.name] - each.body.positions).mean(axis=0) for each in solver.scene.objects]
    return float(np.linalg.norm(ways, axis=1).max()) / _H


@case("object-in-a-corner")
def object_in_a_corner(record: EpisodeRecorder) -> None:
    """A heavy block at 2 m/s presses a box into a corner of the arena."""
    box = _block((0.5, 0.5, 0.5), (4, 4, 4))
    block = _with(_block((5.5, 0.5, 5.5), (5, 5, 5), scenes.RUBBER), (-2.0, 0.0, -2.0))
    _, rollout, _solver = _episode(record, block, [box], 60)
    record.robot_volume(rollout, 0.3)
    places = rollout.positions[:, 0, :, 0].mean(axis=1)
    record.at_least("way of the block into the corner [cells]", float(places[0] - places.min()) / _H, 0.5)


@case("object-against-a-wall")
def object_against_a_wall(record: EpisodeRecorder) -> None:
    """A box is thrown against a wall of the arena at 5 m/s, and comes back no faster."""
    box = _with(_block((14, 8, 10), (4, 4, 4)), (5.0, 0.0, 0.0))
    scene, _, solver = _episode(record, _block((2, 0.25, 2), (4, 4, 4), _SOFT), [box], 10)
    index = scene.slice_of("object-0")
    velocity = solver.matter.v[0, 0].cpu().numpy()[index, :3].mean(axis=0)
    record.within("speed back over that before", float(-velocity[0]) / 5.0, 0.05, 1.0)


@case("gripper-on-nothing")
def gripper_on_nothing(record: EpisodeRecorder) -> None:
    """The fingers of a gripper close on each other with all their strength while its base goes up."""
    grid = scenes.fidelity()
    settings = "gripper[base_speed=0.1,thickness=0.0625,length=0.125,opening=0.125]"
    body = registry.create(Kind.DESIGN, Ref.parse(settings)).body(grid)
    solver = Solver(registry.create(Kind.ENV, Ref("ground")).scene(body, grid), grid)
    activity = [{"inside": 1.0, "outside": -1.0, "up": 1.0}.get(name.split("-")[-1], 0.0) for name in body.muscles]
    rollout, _ = record.episode(solver, np.tile(activity, (100, 1, 1)))
    record.robot_volume(rollout, 0.2)
    ways = rollout.positions[-1, 0] - rollout.positions[0, 0]
    record.within("way of the base over the exact one", float(ways[body.anchored, 1].mean()) / 0.08, 0.999, 1.001)
    tips = body.head | body.tail
    record.at_least("way of the tips towards each other [cells]", float(np.abs(ways[tips, 0]).mean()) / _H, 0.5)
