"""Scenes and solvers that the cases share: blocks, beds and robots of a few hundred particles."""

from dataclasses import replace
from typing import Literal

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.registry import Kind
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.scene import Ground, MediumBed, Scene
from zoobench.sim.model.state import Matter
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

Vector = tuple[float, float, float]

SPACING = 1 / 32
PER_CELL = 8
EDGE = SPACING / 2
"""Edge of the cubes that particles represent, eight in a cell [m]."""
STILL = (0.0, 0.0, 0.0)
ORIGIN = (0.0, 0.0, 0.0)
MIDDLE = (0.3125, 0.3125, 0.3125)
RUBBER = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=1000.0)
MUSCLE = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=3e3)
MEDIA = {"sand": "desert", "clay": "clay", "mud": "wetland", "snow": "snow", "water": "ocean[water=particles]"}
"""An environment of each medium, by the medium's name."""


def medium_material(name: str) -> Medium:
    """A medium with the parameters of its environment."""
    material: Medium = registry.create(Kind.ENV, Ref.parse(MEDIA[name])).bed.material
    return material


def fidelity(precision: int = 32, courant: float = Fidelity.courant, step: float = 0.0) -> Fidelity:
    """The numerical settings that ship, on the grid of the cases."""
    bits: Literal[32, 64] = 64 if precision == 64 else 32
    return Fidelity(SPACING, courant=courant, precision=bits, step=step)


def lattice(lower: Vector, cells: tuple[int, int, int], per_cell: int = PER_CELL) -> Array:
    """Particles `[particle_count, 3]` of a box of whole cells with its corner at `lower` [m]."""
    corner = np.array(lower)
    return fill_box(corner, corner + SPACING * np.array(cells), SPACING, per_cell)


def cube(lower: Vector = MIDDLE, per_cell: int = PER_CELL) -> Array:
    """Particles `[particle_count, 3]` of a cube of four cells with its corner at `lower` [m]."""
    return lattice(lower, (4, 4, 4), per_cell)


def passive(
    positions: Array, material: ElasticMaterial = RUBBER, velocity: Array | None = None, per_cell: int = PER_CELL
) -> ElasticBody:
    """A body without muscles of particles at `positions`; `velocity` [m/s] is `[3]` or `[particle_count, 3]`."""
    body = ElasticBody.passive(material, positions, np.full(len(positions), particle_volume(SPACING, per_cell)))
    return body if velocity is None else replace(body, velocities=body.velocities + velocity)


def flight(body: ElasticBody, size: float = 0.75, bed: MediumBed | None = None) -> Scene:
    """The body, and a medium if given, without gravity in a cube of `size` [m]."""
    return Scene(body, ORIGIN, (size, size, size), medium=bed, gravity=STILL)


def drop(body: ElasticBody, size: Vector = (0.75, 0.75, 0.75), friction: float = 0.5) -> Scene:
    """The body above or on rough ground under gravity."""
    return Scene(body, ORIGIN, size, ground=Ground(friction))


def bed_of(material: Medium, positions: Array, strains: Array | None = None) -> MediumBed:
    """A medium of particles at `positions`, without strain unless principal strains are given."""
    return MediumBed.at_rest(material, positions, np.full(len(positions), particle_volume(SPACING, PER_CELL)), strains)


def bystander(place: Vector) -> ElasticBody:
    """The robot of a scene about a medium: one particle of negligible mass, so soft that it sets no step limit."""
    material = ElasticMaterial(youngs_modulus=1.0, poissons_ratio=0.0, density=1e4)
    return replace(passive(np.array([place]), material), occupancy=np.array([1e-9]))


def lone_bed(bed: MediumBed) -> Scene:
    """A medium without gravity in a cube of 1 m, far from its bystander."""
    return flight(bystander((0.1, 0.1, 0.1)), 1.0, bed)


def caterpillar(grid: Fidelity) -> ElasticBody:
    """The body of the caterpillar."""
    body: ElasticBody = registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid)
    return body


def caterpillar_scene(grid: Fidelity) -> Scene:
    """The caterpillar on rough ground."""
    scene: Scene = registry.create(Kind.ENV, Ref("ground")).scene(caterpillar(grid), grid)
    return scene


def muscle_wave(solver: Solver, frames: int) -> Array:
    """Actuation `[frames, 1, muscles]`: a wave along the body."""
    times = 0.008 * np.arange(frames)[:, None, None]
    phases = np.linspace(0.0, 2.0 * np.pi, solver.muscle_count, endpoint=False)
    return 0.8 * np.sin(2.0 * np.pi * 1.5 * times + phases)


def strained(solver: Solver, F: Array) -> Matter:
    """The initial state with these deformation gradients of the robot, `[3, 3]` or `[robot, 3, 3]`."""
    state = solver.matter.copy_slot(0)
    state.F[0, 0] = solver.simulation.tensor(F)
    return state


def strained_solver(scene: Scene, grid: Fidelity, F: Array, *, gradients: bool = False) -> Solver:
    """A solver whose episodes start from these deformation gradients of the robot, `[3, 3]` or `[robot, 3, 3]`."""
    return Solver(scene, grid, gradients=gradients, start=strained(Solver(scene, grid), F))


def reset_solver(scene: Scene, F: Array | None = None, *, start: Matter | None = None) -> Solver:
    """A solver in 64 bits in its initial state, with these deformation gradients of the robot if given."""
    solver = Solver(scene, fidelity(64), start=start)
    solver.reset()
    if F is not None:
        solver.matter.load_slot(0, strained(solver, F))
    return solver
