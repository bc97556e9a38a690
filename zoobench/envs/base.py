"""What an environment is: matter, ground and arena as data, and the scene they make with a body in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zoobench.designs.base import Body
from zoobench.envs.bed import Bed
from zoobench.errors import SceneError
from zoobench.sim.fidelity import Fidelity
from zoobench.sim.matter import ElasticMaterial
from zoobench.sim.scene import EARTH_GRAVITY, ElasticBody, Ground, Scene

Array = NDArray[np.float64]

# The robot of SoftZoo's reference implementation on land. The muscle's strength is 0.3 E, below the E / (2 (1 + nu)) =
# 0.417 E at which a free fibre that pushes loses its equilibrium.
LAND_ROBOT = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=3e3)

# [m] x, y, z; wide enough that no land robot meets a wall within an episode of 200 frames
OPEN_ARENA = (2.0, 0.4, 2.0)


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
            medium=self.bed.fill(size, -self.gravity[1], fidelity) if self.bed else None,
            ground=Ground(self.friction),
            gravity=self.gravity,
        )
