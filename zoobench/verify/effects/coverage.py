"""`zoobench effects`: which effects each environment simulates, and what they cost.

Which ones is derived from the scenes, never typed in: it is table 6 of SoftZoo's appendix. What they cost is measured
against the same scene without the effect.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from zoobench import registry
from zoobench.arrays import Array
from zoobench.envs.base import Environment
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.matter import Law
from zoobench.sim.model.scene import Effect, MediumBed, Scene
from zoobench.spec import Ref
from zoobench.verify.bench.bench import check_particle_count
from zoobench.verify.bench.case import build_scene

HIGH_FRICTION = 0.3
"""Coulomb coefficient from which friction counts as high [-]."""


@dataclass(frozen=True)
class Coverage:
    """What an environment covers, a row of table 6.

    Attributes:
        medium: the matter on the ground, or `none`.
        thickness: of the medium [m], or None.
        friction: `high`, `low` or empty; `friction_coefficient` [-] is the ground's, 0 without.
        elasticity: what is elastic: `robot`, or `robot, medium`.
        plasticity: the medium yields.
        fluid: `shallow` or `deep` as the robot stands out of it or is immersed, `mixed` if the medium yields too, or
            empty.
    """

    env: str
    medium: str
    thickness: float | None
    friction: str
    friction_coefficient: float
    elasticity: str
    plasticity: bool
    fluid: str


def coverage(name: str, scene: Scene) -> Coverage:
    """The row of an environment's scene, read off its effects, materials and particles."""
    medium, effects = scene.medium, scene.effects
    coefficient = scene.ground.friction if scene.ground and Effect.FRICTION in effects else 0.0
    fluid = ""
    if Effect.FLUID in effects and medium is not None:
        immersed = heights(scene, scene.robot.positions).max() < thickness(scene, medium)
        fluid = "mixed" if Effect.PLASTICITY in effects else "deep" if immersed else "shallow"
    return Coverage(
        env=name,
        medium=medium.material.law.name.lower() if medium else "none",
        thickness=thickness(scene, medium) if medium else None,
        friction="high" if coefficient >= HIGH_FRICTION else "low" if coefficient > 0.0 else "",
        friction_coefficient=coefficient,
        elasticity="robot, medium" if medium and medium.material.law != Law.WATER else "robot",
        plasticity=Effect.PLASTICITY in effects,
        fluid=fluid,
    )


def thickness(scene: Scene, bed: MediumBed) -> float:
    """Height of a level bed [m]: its highest particles lie as far below its surface as its lowest above the ground."""
    above = heights(scene, bed.positions)
    return float(above.max() + above.min())


def heights(scene: Scene, positions: Array) -> Array:
    """How high above the ground particles `[n, 3]` lie [m]."""
    above: Array = positions[:, 1]
    if scene.ground is not None and scene.ground.terrain is not None:
        above = above - scene.ground.terrain.heights_below(positions)
    return above


@dataclass(frozen=True)
class Place:
    """An environment with the caterpillar in it, as it is measured; `env` names its parameters too."""

    env: str
    scene: Scene
    fidelity: Fidelity


def places(envs: list[Ref], fidelity: Ref, particles: int = 0) -> Iterator[Place]:
    """The environments at a fidelity, or on the grids that give them about `particles` particles each.

    Raises:
        UnknownNameError, UsageError: a name or a number that cannot be used.
    """
    if particles:
        check_particle_count(particles)
    for env in envs:
        if particles and env.params:
            raise UsageError(f"The grid of {env} cannot follow from a number of particles. Leave the parameters out.")
        if particles:
            scene, grid = build_scene(env.name, particles, 32)
        else:
            grid = registry.create(Kind.FIDELITY, fidelity)
            environment: Environment = registry.create(Kind.ENV, env)
            scene = environment.scene(registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid), grid)
        yield Place(str(env), scene, grid)
