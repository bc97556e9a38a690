"""What an environment is: matter, ground and arena as data, and the scene they make with a body in it."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.envs.bed import Bed, lifted, sharing, without_overlap
from zoobench.envs.hills import hills
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.matter import ElasticMaterial, Medium
from zoobench.sim.model.scene import EARTH_GRAVITY, ElasticBody, Ground, MediumBed, Scene
from zoobench.sim.model.terrain import Terrain

# The robot of SoftZoo's reference implementation on land, with muscles of 0.15 E and a viscosity that silicone has, too
# (loss factor 2 eta omega / E = 0.3 at the 80 rad/s of the fastest controllers). Half of the 0.3 E that are common, and
# the damping, are what keeps it whole: all muscles in unison at 80 rad/s tear a robot of 0.3 E apart within 10 frames,
# one of 0.15 E without damping within 20 (ground, h = 1/128), while this one is stretched to 1.6 at most.
LAND_ROBOT = ElasticMaterial(
    youngs_modulus=1e4, poissons_ratio=0.2, density=1000.0, muscle_strength=1.5e3, viscosity=20.0
)

# [m] x, y, z; wide enough that no land robot meets a wall within an episode of 200 frames
OPEN_ARENA = (2.0, 0.4, 2.0)


# A swimmer is stiffer: it has to push water, and the reference implementation has 1e5 Pa there. Water alone damps it
# too little at h = 1/128: under square waves of full strength it came apart in the 197th frame.
SWIMMING_ROBOT = ElasticMaterial(
    youngs_modulus=1e5, poissons_ratio=0.2, density=1000.0, muscle_strength=1.5e4, viscosity=20.0
)


EQUILIBRATION_FRAMES = 80
"""Control frames in which a robot, and the medium that it stands on or swims in, come to rest: one period of the
slowest wave, the sloshing of the ocean's tank (0.66 s). In the second after it, the kinetic energy stays below
1.2e-7 of the potential energy, in the ocean below 1e-9."""


class Stance(Enum):
    """Where a robot starts: on the bed (or the bare ground), on the ground in the medium, or midway in its depth."""

    STANDING = "standing"
    WADING = "wading"
    SWIMMING = "swimming"


@dataclass(frozen=True, kw_only=True)
class Environment:
    """A place to move in, as data.

    Attributes:
        robot: what robots are made of here.
        friction: Coulomb coefficient of the ground [-].
        arena: its size along x, y, z [m]; it begins at the origin, the ground is y = 0 where there is no terrain.
        bed: the medium on the ground, or None.
        start: where the robot's centre stands, as shares of the arena along x and z.
        stance: at which height it starts.
        equilibration_frames: control frames in which the scene comes to rest, under damping, before the clock starts.
        gravity: [m/s^2].
        terrain: heights of ground that is not level; a bed lies on it with the same thickness everywhere.
    """

    robot: ElasticMaterial
    friction: float
    arena: tuple[float, float, float]
    bed: Bed | None = None
    start: tuple[float, float] = (0.5, 0.5)
    stance: Stance = Stance.STANDING
    equilibration_frames: int = 0
    gravity: tuple[float, float, float] = EARTH_GRAVITY
    terrain: Terrain | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.friction < np.inf:
            raise UsageError(f"A friction of {self.friction:g} is not possible. Give 0 or more.")
        if min(self.arena) <= 0.0 or (self.bed is not None and not 0.0 < self.bed.thickness < self.arena[1]):
            depth = "" if self.bed is None else f" with a bed of {self.bed.thickness:g} m"
            raise UsageError(f"An arena of {self.arena} m{depth} has no room. Give positive lengths that fit.")

    def scene(self, body: Body, fidelity: Fidelity) -> Scene:
        """The body at rest at its starting place; a medium in which it stands or swims makes room for it.

        Raises:
            SceneError: the body does not fit into the arena.
        """
        size = np.array(self.arena)
        place = np.array([self.start[0] * size[0], 0.0, self.start[1] * size[2]]) + fidelity.displacement
        floor = self._floor(body) + self._rise(body.positions + place)
        positions = body.positions + place + np.array([0.0, floor, 0.0])
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
            medium=self._fill(size, robot, fidelity, shared=body.malleable),
            ground=Ground(self.friction, self.terrain),
            gravity=self.gravity,
        )

    def _rise(self, positions: Array) -> float:
        """How far a body that stands on y = 0 has to be lifted so that no particle is nearer to the terrain [m]."""
        if self.terrain is None:
            return 0.0
        lowest = positions[:, 1].min()
        return float((self.terrain.heights_below(positions) - (positions[:, 1] - lowest)).max())

    def _floor(self, body: Body) -> float:
        """Height of the body's underside above the ground [m]."""
        if self.bed is None or self.stance is Stance.WADING:
            return 0.0
        if self.stance is Stance.STANDING:
            return self.bed.thickness
        return max(0.0, (self.bed.thickness - float(body.positions[:, 1].max())) / 2)

    def _fill(self, size: Array, robot: ElasticBody, fidelity: Fidelity, *, shared: bool) -> MediumBed | None:
        """The medium; it makes room for a robot that stands in it, or shares the robot's places."""
        if self.bed is None:
            return None
        bed = self.bed.fill(size, -self.gravity[1], fidelity)
        if self.terrain is not None:
            bed = lifted(bed, self.terrain)
        if self.stance is Stance.STANDING:
            return bed
        bed = without_overlap(bed, robot.positions[robot.occupancy > 0.5], fidelity)
        if not shared:
            return bed
        hosts = np.flatnonzero(robot.positions[:, 1] < self.bed.thickness)
        guests = self.bed.at_rest(robot.positions[hosts], robot.volumes[hosts], -self.gravity[1])
        return sharing(bed, guests, hosts)


def firm_environment(*, friction: float, relief: float, wavelength: float, terrain_seed: int) -> Environment:
    """A land robot on firm ground, level or with `hills`, without a wall within its reach."""
    return Environment(
        robot=LAND_ROBOT,
        friction=friction,
        arena=OPEN_ARENA,
        equilibration_frames=EQUILIBRATION_FRAMES,
        terrain=hills((OPEN_ARENA[0], OPEN_ARENA[2]), relief=relief, wavelength=wavelength, seed=terrain_seed),
    )


def bed_environment(
    material: Medium,
    *,
    friction: float,
    thickness: float,
    length: float,
    width: float,
    stance: Stance = Stance.STANDING,
    terrain: Terrain | None = None,
) -> Environment:
    """A land robot on or in a bed of `thickness` [m] on the ground, `length` by `width` [m] from wall to wall.

    It starts at 0.35 of the length, so that most of the bed lies before it.
    """
    return Environment(
        robot=LAND_ROBOT,
        friction=friction,
        arena=(length, 0.3, width),
        bed=Bed(material, thickness),
        start=(0.35, 0.5),
        stance=stance,
        equilibration_frames=EQUILIBRATION_FRAMES,
        terrain=terrain,
    )
