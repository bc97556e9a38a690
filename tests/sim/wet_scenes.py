"""Small scenes of water on a grid that tests of the simulator share."""

from dataclasses import replace

import numpy as np

from tests.sim.scenes import NO_GRAVITY, SPACING, muscle_body, passive_block
from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import EARTH_GRAVITY, Scene
from zoobench.sim.solver import Solver

CELLS = (10, 8, 9)
SIZE = (CELLS[0] * SPACING, CELLS[1] * SPACING, CELLS[2] * SPACING)
_VISCOSITY = 1e-9
"""Of all bodies [Pa s], which no number shows: so the kernels are those of swimmers, who are viscous."""


def stirred(cells: tuple[int, int, int] = CELLS, seed: int = 5) -> Array:
    """A random velocity on the faces, none on the walls."""
    velocities = 0.1 * np.random.default_rng(seed).normal(size=(*cells, 3))
    for d in range(3):
        velocities[(slice(None),) * d + (0,)][..., d] = 0.0
    return velocities


def muscles_in_water() -> Scene:
    """The muscle cube, lighter than water and off the lattice, in stirred water."""
    body = muscle_body((3.3 * SPACING, 2.6 * SPACING, 3.2 * SPACING), moving=True)
    body = replace(body, material=replace(body.material, viscosity=_VISCOSITY))
    return Scene(body, (0.0, 0.0, 0.0), SIZE, gravity=EARTH_GRAVITY, water=GridWater(velocities=stirred()))


def _idle(body: ElasticBody) -> ElasticBody:
    """The body with a muscle at rest, so that its kernels are those of the muscle cube: they take long to compile."""
    material = replace(body.material, muscle_strength=1.0, viscosity=_VISCOSITY)
    return replace(body, material=material, muscle_membership=np.ones((body.particle_count, 1)))


def block_in_water(velocity: Array | None = None, density: float = 1000.0, cells: int = 3) -> Scene:
    """A cube in the middle of still water, its muscle at rest."""
    lower = (5 * SPACING - cells * SPACING / 2, 4 * SPACING - cells * SPACING / 2, 4.5 * SPACING - cells * SPACING / 2)
    block = passive_block(lower, (cells, cells, cells), np.zeros(3) if velocity is None else velocity)
    block = ElasticBody(**{**vars(block), "material": ElasticMaterial(1e5, 0.2, density)})
    return Scene(_idle(block), (0.0, 0.0, 0.0), SIZE, gravity=EARTH_GRAVITY, water=GridWater())


def empty_water(velocities: Array, spacing: float) -> Scene:
    """Water alone, but for a speck of matter."""
    size = tuple(spacing * count for count in velocities.shape[:3])
    speck = ElasticBody.passive(ElasticMaterial(1e4, 0.2, 1000.0), 0.5 * np.array([size]), np.array([1e-20]))
    return Scene(
        _idle(speck), (0.0, 0.0, 0.0), (size[0], size[1], size[2]), gravity=NO_GRAVITY,
        water=GridWater(velocities=velocities, viscosity=0.0),
    )  # fmt: skip


def flow_of(solver: Solver, world: int = 0) -> Array:
    """The present velocities on the faces `[nx, ny, nz, 3]` [m/s]."""
    cells = solver.scene.cells(solver.fidelity.grid_spacing)
    found: Array = solver.matter.flow[0, world, :, :3].double().numpy().reshape(*cells, 3)
    return found


def divergence(velocities: Array) -> Array:
    """Differences between the faces of every cell [m/s]; the far walls have no velocity."""
    total = np.zeros(velocities.shape[:3])
    for d in range(3):
        wall = [(0, int(d == e)) for e in range(3)]
        total += np.diff(np.pad(velocities[..., d], wall), axis=d)
    return total


def fine(precision: int = 64, spacing: float = SPACING) -> Fidelity:
    """A fidelity for still or empty water."""
    return Fidelity(spacing, precision=64 if precision == 64 else 32)
