"""Scenes that differ from an environment's in one effect, with the same particles in the same places."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.scene import Effect, MediumBed, Scene


@dataclass(frozen=True)
class Pair:
    """A scene with an effect and the same without it.

    Attributes:
        effect: as the launcher counts it.
        without_it: how it was switched off.
    """

    effect: Effect
    without_it: str
    on: Scene
    off: Scene


def pairs(scene: Scene) -> Iterator[Pair]:
    """A pair for every effect of the scene that can be switched off, which excludes the robot's elasticity."""
    if Effect.MUSCLE in scene.effects:
        yield Pair(Effect.MUSCLE, "muscle strength 0", scene, passive(scene))
    if Effect.DAMPING in scene.effects:
        yield Pair(Effect.DAMPING, "viscosity 0", scene, undamped(scene))
    if scene.ground is not None and Effect.FRICTION in scene.effects:
        yield Pair(Effect.FRICTION, "friction 0", scene, replace(scene, ground=replace(scene.ground, friction=0.0)))
    if scene.water is not None or scene.surface_water is not None:
        yield Pair(Effect.FLUID, "no water", scene, replace(scene, water=None, surface_water=None))
    if Effect.CONTACT in scene.effects:
        yield Pair(Effect.CONTACT, "one velocity field", scene, stuck(scene))
    if scene.medium is None:
        return
    # off in both scenes, since muscles and damping would act on the elastic bed too, which has no field of its own
    rest = stuck(undamped(passive(scene)))
    elastic = all_elastic(rest)
    if isinstance(scene.medium.material, MudMaterial):
        solid = replace(rest, medium=as_clay(scene.medium))
        yield Pair(Effect.FLUID, "clay for mud", rest, solid)
        yield Pair(Effect.PLASTICITY, "robot's law for clay", solid, elastic)
        return
    for effect in (Effect.PLASTICITY, Effect.FLUID):
        if effect in scene.effects:
            yield Pair(effect, "robot's law for the bed", rest, elastic)


def stuck(scene: Scene) -> Scene:
    """The scene with one velocity field for all matter, in which objects are passive parts of the robot."""
    bed = None if scene.medium is None else replace(scene.medium, friction=None)
    return replace(scene, robot=scene.elastic, objects=(), medium=bed)


def passive(scene: Scene) -> Scene:
    """The scene with a muscle strength of 0."""
    return replace(scene, robot=replace(scene.robot, material=replace(scene.robot.material, muscle_strength=0.0)))


def undamped(scene: Scene) -> Scene:
    """The scene with a viscosity of 0 in the robot."""
    return replace(scene, robot=replace(scene.robot, material=replace(scene.robot.material, viscosity=0.0)))


def all_elastic(scene: Scene) -> Scene:
    """The scene with a bed of the robot's neo-Hookean material and the medium's density, at rest."""
    robot, bed = scene.robot, scene.medium
    if bed is None:
        return scene
    count = bed.particle_count
    velocities = np.zeros((count, 3)) if bed.velocities is None else bed.velocities
    both = ElasticBody(
        material=robot.material,
        positions=np.vstack([robot.positions, bed.positions]),
        volumes=np.concatenate([robot.volumes, bed.volumes]),
        stiffness=np.concatenate([robot.stiffness, np.ones(count)]),
        density_ratio=np.concatenate(
            [robot.density_ratio, np.full(count, bed.material.density / robot.material.density)]
        ),
        occupancy=np.concatenate([robot.occupancy, np.ones(count)]),
        muscle_membership=np.vstack([robot.muscle_membership, np.zeros((count, robot.muscle_count))]),
        fibres=np.vstack([robot.fibres, np.tile([1.0, 0.0, 0.0], (count, 1))]),
        velocities=np.vstack([robot.velocities, velocities]),
    )
    return replace(scene, robot=both, medium=None)


def as_clay(bed: MediumBed) -> MediumBed:
    """A bed of mud as one of clay with its moduli and yield stress, free of strain: mud that is no fluid."""
    mud = bed.material
    if not isinstance(mud, MudMaterial):
        raise TypeError(f"A bed of {mud.name} was given; mud was expected.")
    clay = ClayMaterial(mud.youngs_modulus, mud.poissons_ratio, mud.density, mud.yield_stress)
    return MediumBed.at_rest(clay, bed.positions, bed.volumes)
