"""Environments as data, and the scene that an environment forms with a body."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.envs.bed import Bed, sharing, without_overlap
from zoobench.envs.hills import Hills
from zoobench.envs.physics import LAND, Contact, Physics
from zoobench.envs.profile import Profile
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.ground_skin import SKIN, GroundSkin
from zoobench.sim.model.matter import ElasticMaterial
from zoobench.sim.model.scene import EARTH_GRAVITY, ElasticBody, Ground, MediumBed, Scene, check_material
from zoobench.sim.model.standing import standing
from zoobench.sim.model.terrain import Terrain

LAND_ROBOT = LAND.robot

# [m] x, y, z; wide enough that no land robot meets a wall within an episode of 200 frames
OPEN_ARENA = (2.0, 0.4, 2.0)


BED_START = 0.35
"""Start of a land robot on a bed, relative to the bed's length."""

BED_THICKNESS = 1 / 32
"""[m] Of a solid bed: two cells of `draft` and a whole number at every fidelity. Where a bed ends in half a cell, its
surface lies otherwise to the nodes, and gaits score a quarter less. Twice as thick, it changes scores by 3 %."""

EQUILIBRATION_FRAMES = 80
"""Control frames of equilibration: one period of the slowest wave, the sloshing of the ocean's tank (0.66 s). In the
second after it, the kinetic energy is below 1.2e-7 of the potential energy, in the ocean below 1e-9."""

_SLOWEST = 4.0


def equilibration_frames(gravity: float) -> int:
    """Control frames of equilibration under this gravity [m/s^2].

    Gravity drives the slowest wave, whose period is proportional to 1 / sqrt(gravity); below a sixteenth of the Earth's
    it hardly moves anything.
    """
    return math.ceil(EQUILIBRATION_FRAMES * min(_SLOWEST, max(1.0, math.sqrt(9.81 / max(gravity, 1e-9)))))


class Stance(Enum):
    """Height of the start: on the bed or bare ground, on the ground in the medium, or at half the medium's depth."""

    STANDING = "standing"
    WADING = "wading"
    SWIMMING = "swimming"


@dataclass(frozen=True, kw_only=True)
class Environment:
    """An environment.

    Attributes:
        robot: the material of robots in this environment.
        friction: Coulomb coefficient of the ground [-].
        arena: size along x, y, z [m]; it begins at the origin, and the ground is y = 0 without a terrain.
        bed: the medium on the ground, or None.
        start: initial position of the robot's centre, relative to the arena's size along x and z.
        stance: initial height of the robot.
        equilibration_frames: control frames of damped equilibration before the episode.
        gravity: [m/s^2].
        terrain: heights of ground that is not level; a solid bed lies on it with constant thickness, the surface of
            water is level, its thickness above the lowest ground.
        skin: of the ground, by which it carries a robot outside water.
        water: that fills the arena, on a grid, in place of a bed; the ground is smooth.
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
    skin: GroundSkin = SKIN
    water: GridWater | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.friction < np.inf:
            raise UsageError(f"A friction of {self.friction:g} is not possible. Give 0 or more.")
        if min(self.arena) <= 0.0 or (self.bed is not None and not 0.0 < self.bed.thickness < self.arena[1]):
            depth = "" if self.bed is None else f" with a bed of {self.bed.thickness:g} m"
            raise UsageError(f"An arena of {self.arena} m{depth} is not possible. Give positive lengths that fit.")
        check_material("robot", self.robot)
        if self.bed is not None:
            check_material("medium", self.bed.material)
            self.bed.check(-self.gravity[1])

    def scene(self, body: Body, fidelity: Fidelity) -> Scene:
        """The body at rest at its start, in or on the medium without overlap.

        Raises:
            SceneError: the body does not fit into the arena.
        """
        if self.terrain is not None:
            self.terrain.check_resolved(fidelity.grid_spacing)
        size = np.array(self.arena)
        place = np.array([self.start[0] * size[0], 0.0, self.start[1] * size[2]]) + fidelity.displacement
        floor = self._floor(body, self._rise(body.positions + place))
        positions = body.positions + place + np.array([0.0, floor, 0.0])
        if (positions < 0).any() or (positions > size).any():
            extent = tuple(float(length) for length in np.round(np.ptp(body.positions, axis=0), 3))
            raise SceneError(
                f"A body of {extent} m does not fit into the arena of {self.arena} m with its floor at "
                f"{floor:g} m. Use a smaller body or a larger arena."
            )
        robot = ElasticBody.placed(self.robot, body, positions, body.edge)
        sites = body.sites + place + np.array([0.0, floor, 0.0])
        scene = Scene(
            robot=robot,
            lower=(0.0, 0.0, 0.0),
            upper=self.arena,
            medium=self._fill(size, robot, sites, fidelity, shared=body.malleable),
            ground=Ground(self.friction, self.terrain, self.skin),
            gravity=self.gravity,
            water=self.water,
        )
        return standing(scene, body.edge)

    def _rise(self, positions: Array) -> float:
        """Height by which a body that stands on y = 0 is lifted so that no particle is closer to the terrain [m]."""
        if self.terrain is None:
            return 0.0
        lowest = positions[:, 1].min()
        return float((self.terrain.heights_below(positions) - (positions[:, 1] - lowest)).max())

    def _floor(self, body: Body, rise: float) -> float:
        """Height of the body's underside [m], where it must be above `rise` [m] to be clear of the ground."""
        if self.water is not None:
            return max(0.0, self.arena[1] - float(body.positions[:, 1].max())) / 2
        if self.bed is None or self.stance is Stance.WADING:
            return rise
        if self.stance is Stance.STANDING:
            return self.bed.thickness + rise
        room = self.bed.thickness - rise - float(body.positions[:, 1].max())
        if rise and room < 0.0:
            raise SceneError(
                f"The terrain rises to {rise:.3g} m below the swimmer, and {self.bed.thickness:g} m of water leave no "
                "room above. Give lower terrain, deeper water or a smaller body."
            )
        return rise + max(0.0, room / 2)

    def _fill(
        self, size: Array, robot: ElasticBody, sites: Array, fidelity: Fidelity, *, shared: bool
    ) -> MediumBed | None:
        """The medium, without the robot's volume in cubes about `sites` `[n, 3]` [m], or with particles that share it.

        The cubes are a lattice, so that their volumes fill none of the bed's places twice; their particles are not.
        """
        if self.bed is None:
            return None
        bed = self.bed.fill(size, -self.gravity[1], fidelity, self.terrain)
        if self.stance is Stance.STANDING:
            return bed
        # with a shared place, guests have what the robot leaves of it
        taken = robot.volumes if shared else robot.occupancy * robot.volumes
        bed = without_overlap(bed, sites, taken, fidelity)
        if not shared:
            return bed
        hosts = np.flatnonzero(robot.positions[:, 1] < self.bed.thickness)
        guests = self.bed.at_rest(robot.positions[hosts], robot.volumes[hosts], -self.gravity[1])
        return sharing(bed, guests, hosts)


def firm_environment(
    *, friction: float, hills: Hills, profile: Profile, physics: Physics, contact: Contact
) -> Environment:
    """A land robot on firm ground, level or not, far from walls."""
    length, height, width = OPEN_ARENA
    terrain = profile.terrain((length, width), length / 2, hills)
    return Environment(
        robot=physics.robot,
        friction=friction,
        arena=(length, height + _climb(terrain, profile), width),
        equilibration_frames=equilibration_frames(physics.gravity),
        gravity=(0.0, -physics.gravity, 0.0),
        terrain=terrain,
        skin=contact.skin,
    )


def bed_environment(
    bed: Bed,
    *,
    friction: float,
    size: tuple[float, float],
    physics: Physics,
    hills: Hills,
    profile: Profile,
    stance: Stance = Stance.STANDING,
) -> Environment:
    """A land robot on or in a bed of this `size` along x and z [m] on the ground, from wall to wall.

    It starts at `BED_START`, so that most of the bed lies before it.
    """
    length, width = size
    terrain = profile.terrain(size, BED_START * length, hills)
    return Environment(
        robot=physics.robot,
        friction=friction,
        arena=(length, 0.3 + _climb(terrain, profile), width),
        bed=bed,
        start=(BED_START, 0.5),
        stance=stance,
        equilibration_frames=equilibration_frames(physics.gravity),
        gravity=(0.0, -physics.gravity, 0.0),
        terrain=terrain,
    )


def _climb(terrain: Terrain | None, profile: Profile) -> float:
    """Height that an arena needs above the usual one for its profile [m]."""
    return 0.0 if terrain is None or profile.is_level else float(terrain.heights.max())
