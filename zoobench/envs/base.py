"""What an environment is: matter, ground and arena as data, and the scene they make with a body in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zoobench.designs.base import Body
from zoobench.errors import SceneError
from zoobench.sim.fidelity import Fidelity
from zoobench.sim.lattice import fill_box
from zoobench.sim.scene import (
    EARTH_GRAVITY,
    ElasticBody,
    ElasticMaterial,
    Ground,
    SandBed,
    SandMaterial,
    Scene,
    lame_parameters,
)

Array = NDArray[np.float64]

# The robot of SoftZoo's reference implementation on land. The muscle's strength is 0.3 E, below the E / (2 (1 + nu)) =
# 0.417 E at which a free fibre that pushes loses its equilibrium.
LAND_ROBOT = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=3e3)

# [m] x, y, z; wide enough that no land robot meets a wall within an episode of 200 frames
OPEN_ARENA = (2.0, 0.4, 2.0)


@dataclass(frozen=True)
class Bed:
    """A level bed of sand that covers the whole floor of the arena, held by its walls.

    Attributes:
        thickness: [m].
    """

    material: SandMaterial
    thickness: float

    def fill(self, size: Array, gravity: float, fidelity: Fidelity) -> SandBed:
        """The bed at rest in an arena of this `size` [m]; `gravity` [m/s^2] is the downward magnitude.

        The lattice is stretched by a few percent so that whole particles fill the box exactly: the bed's mass
        is density times thickness times area at every fidelity, and no gap is left at the walls. The strain
        is that of a confined column in small-strain closed form, eps_yy = -rho g depth / (lambda + 2 mu): at
        0.02 m of sand it is 0.3 %, its square is out of reach of single precision in the stress.
        """
        box = np.array([size[0], self.thickness, size[2]])
        rounded = np.maximum(np.round(box / fidelity.grid_spacing * 2) / 2, 0.5) * fidelity.grid_spacing
        lattice = fill_box(np.zeros(3), rounded, fidelity.grid_spacing, fidelity.particles_per_cell)
        spacing = np.array([np.diff(np.unique(np.round(axis, 12))).min(initial=np.inf) for axis in lattice.T])
        reach = lattice.max(axis=0) + np.where(np.isfinite(spacing), spacing / 2, lattice.max(axis=0))
        positions = lattice * (box / reach)
        mu, lam = lame_parameters(self.material.youngs_modulus, self.material.poissons_ratio)
        strains = np.zeros_like(positions)
        depth = self.thickness - positions[:, 1]
        strains[:, 1] = -self.material.density * gravity * depth / (lam + 2 * mu)
        volumes = np.full(len(positions), box.prod() / len(positions))
        return SandBed(material=self.material, positions=positions, volumes=volumes, strains=strains)


@dataclass(frozen=True, kw_only=True)
class Environment:
    """A place to move in, as data.

    Attributes:
        robot: what robots are made of here.
        friction: Coulomb coefficient of the ground [-].
        arena: its size along x, y, z [m]; it begins at the origin, the ground is y = 0.
        bed: the medium on the ground, or None.
        start: where the robot's centre stands, as shares of the arena along x and z.
        gravity: [m/s^2].
    """

    robot: ElasticMaterial
    friction: float
    arena: tuple[float, float, float]
    bed: Bed | None = None
    start: tuple[float, float] = (0.5, 0.5)
    gravity: tuple[float, float, float] = EARTH_GRAVITY

    def scene(self, body: Body, fidelity: Fidelity) -> Scene:
        """The body at rest at its starting place, standing on the ground or on the bed.

        Raises:
            SceneError: the body does not fit into the arena.
        """
        size = np.array(self.arena)
        floor = self.bed.thickness if self.bed else 0.0
        positions = body.positions + np.array([self.start[0] * size[0], floor, self.start[1] * size[2]])
        if (positions < 0).any() or (positions > size).any():
            extent = tuple(float(length) for length in np.round(np.ptp(body.positions, axis=0), 3))
            raise SceneError(
                f"A body of {extent} m does not fit into the arena of {self.arena} m with its floor at "
                f"{floor:g} m. Use a smaller body or a larger arena."
            )
        robot = ElasticBody(
            material=self.robot,
            positions=positions,
            volumes=body.volumes,
            stiffness=body.stiffness,
            density_ratio=body.density_ratio,
            occupancy=body.occupancy,
            muscle_membership=body.muscle_membership,
            fibres=body.fibres,
            velocities=np.zeros_like(positions),
        )
        return Scene(
            robot=robot,
            lower=(0.0, 0.0, 0.0),
            upper=self.arena,
            sand=self.bed.fill(size, -self.gravity[1], fidelity) if self.bed else None,
            ground=Ground(self.friction),
            gravity=self.gravity,
        )
