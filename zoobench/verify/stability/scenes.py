"""Scenes that the cases share: blocks, beds and tanks of a few hundred particles."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.matter import ElasticMaterial, Medium
from zoobench.sim.model.scene import ElasticBody, Ground, MediumBed, Scene
from zoobench.spec import Ref

if TYPE_CHECKING:
    from zoobench.sim.model.state import Matter
    from zoobench.sim.solver import Solver


SPACING = 1 / 32
PER_CELL = 8
STILL = (0.0, 0.0, 0.0)
ORIGIN = (0.0, 0.0, 0.0)
RUBBER = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=1000.0)
MUSCLE = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=3e3)
_MEDIUM_HOMES = {"sand": "desert", "clay": "clay", "mud": "wetland", "snow": "snow", "water": "ocean"}


def medium_names() -> tuple[str, ...]:
    """Every medium that an environment has."""
    return tuple(_MEDIUM_HOMES)


def medium_material(name: str) -> Medium:
    """A medium as the environment that it belongs to has it."""
    material: Medium = registry.create(Kind.ENV, Ref(_MEDIUM_HOMES[name])).bed.material
    return material


def fidelity(precision: int = 32, courant: float = 0.5, spacing: float = SPACING, step: float = 0.0) -> Fidelity:
    """The grid of the cases."""
    return Fidelity(spacing, courant=courant, precision=64 if precision == 64 else 32, step=step)


def lattice(lower: tuple[float, float, float], cells: tuple[int, int, int], per_cell: int = PER_CELL) -> Array:
    """Particles of a box of whole cells with its corner at `lower` [m]."""
    corner = np.array(lower)
    return fill_box(corner, corner + SPACING * np.array(cells), SPACING, per_cell)


def passive(
    positions: Array, material: ElasticMaterial = RUBBER, velocity: Array | None = None, per_cell: int = PER_CELL
) -> ElasticBody:
    """A body without muscles at these places; `velocity` [m/s] is one for all, `[3]`, or each its own."""
    body = ElasticBody.passive(material, positions, np.full(len(positions), particle_volume(SPACING, per_cell)))
    return body if velocity is None else replace(body, velocities=body.velocities + velocity)


def flight(body: ElasticBody, size: float = 0.75) -> Scene:
    """The body alone, without weight, in a cube of `size` [m]."""
    return Scene(body, ORIGIN, (size, size, size), gravity=STILL)


def drop(body: ElasticBody, size: tuple[float, float, float] = (0.75, 0.75, 0.75), friction: float = 0.5) -> Scene:
    """The body above or on rough ground, under its weight."""
    return Scene(body, ORIGIN, size, ground=Ground(friction))


def bed_of(material: Medium, positions: Array, strains: Array | None = None) -> MediumBed:
    """Matter of a medium at these places, free of strain unless told otherwise."""
    return MediumBed.at_rest(material, positions, np.full(len(positions), particle_volume(SPACING, PER_CELL)), strains)


def bystander(place: tuple[float, float, float]) -> ElasticBody:
    """One particle that a scene about a medium needs as its robot: next to no mass, so soft that it sets no limit."""
    material = ElasticMaterial(youngs_modulus=1.0, poissons_ratio=0.0, density=1e4)
    body = passive(np.array([place]), material)
    return replace(body, occupancy=np.array([1e-9]))


def strained(solver: "Solver", F: Array) -> "Matter":
    """The scene's initial state with these deformation gradients of the robot, `[3, 3]` or `[robot, 3, 3]`."""
    state = solver.matter.copy_slot(0)
    state.F[0, 0] = solver.simulation.tensor(F)
    return state
