"""Effects that each environment simulates, derived from its scene: table 6 of SoftZoo's appendix."""

from collections.abc import Iterator
from dataclasses import dataclass

from zoobench import registry
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Effect, MediumBed, Scene
from zoobench.spec import Ref

HIGH_FRICTION = 0.3
"""Coulomb coefficient from which friction counts as high [-]."""


@dataclass(frozen=True)
class Coverage:
    """Effects of an environment, a row of table 6.

    Attributes:
        medium: the matter on the ground, or `none`.
        thickness: of the medium [m]; None without one, and without bounds.
        friction: `high`, `low` or empty; `friction_coefficient` [-] is the ground's, 0 without.
        elasticity: what keeps its shape: `robot`, objects and obstacles by name, `medium`.
        plasticity: whether the medium yields.
        fluid: `deep` if the robot is immersed, else `shallow`; `mixed` if the medium yields too; empty without.
        contact: what meets the robot with a velocity field of its own: objects and obstacles by name, `medium`.
    """

    env: str
    medium: str
    thickness: float | None
    friction: str
    friction_coefficient: float
    elasticity: str
    plasticity: bool
    fluid: str
    contact: str


def coverage(name: str, scene: Scene) -> Coverage:
    """The row of a scene, from its effects, materials and particles."""
    medium, effects = scene.medium, scene.effects
    things = [each.name for each in scene.objects]
    elastic = ", ".join(["robot", *things])
    if scene.water is not None or scene.surface_water is not None:
        deep = scene.upper[1] - scene.lower[1] if scene.water is not None else None
        return Coverage(name, "water", deep, "", 0.0, elastic, plasticity=False, fluid="deep", contact="")
    coefficient = scene.ground.friction if scene.ground and Effect.FRICTION in effects else 0.0
    fluid = ""
    if Effect.FLUID in effects and medium is not None:
        immersed = scene.heights_above_ground(scene.robot.positions).max() < thickness(scene, medium)
        fluid = "mixed" if Effect.PLASTICITY in effects else "deep" if immersed else "shallow"
    return Coverage(
        env=name,
        medium=medium.material.name if medium else "none",
        thickness=thickness(scene, medium) if medium else None,
        friction="high" if coefficient >= HIGH_FRICTION else "low" if coefficient > 0.0 else "",
        friction_coefficient=coefficient,
        elasticity=f"{elastic}, medium" if medium and not medium.material.is_liquid else elastic,
        plasticity=Effect.PLASTICITY in effects,
        fluid=fluid,
        contact=", ".join([*things, *(["medium"] if medium and medium.friction is not None else [])]),
    )


def thickness(scene: Scene, bed: MediumBed) -> float:
    """Height of a level bed [m]; its highest particles are as far below the surface as its lowest above ground."""
    above = scene.heights_above_ground(bed.positions)
    return float(above.max() + above.min())


@dataclass(frozen=True)
class StudiedScene:
    """An environment with the caterpillar in it; `env` includes its parameters."""

    env: str
    scene: Scene
    fidelity: Fidelity


def studied_scenes(envs: list[Ref], fidelity: Ref) -> Iterator[StudiedScene]:
    """The environments at a fidelity.

    Raises:
        UnknownNameError, UsageError: a name or a parameter that cannot be used.
    """
    for env in envs:
        environment: Environment = registry.create(Kind.ENV, env)
        grid: Fidelity = environment.simulated(registry.create(Kind.FIDELITY, fidelity))
        body = registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid)
        yield StudiedScene(str(env), environment.scene(body, grid), grid)
