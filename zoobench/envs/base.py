"""Environments as data, and the scene that an environment forms with a body."""

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.hull import hull_of
from zoobench.envs.bed import Bed, SolidBed, sharing, without_overlap
from zoobench.envs.hills import LEVEL, Hills
from zoobench.envs.objects import NO_OBJECTS, Objects
from zoobench.envs.obstacles import NO_OBSTACLES, Obstacles
from zoobench.envs.physics import LAND, Contact, Physics
from zoobench.envs.profile import LEVEL_WAY, Profile
from zoobench.envs.ranges import check_no_idle
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import REST_FRAME_PARTICLES, Fidelity
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.ground_skin import SKIN, GroundSkin
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import EARTH_GRAVITY, Ground, MediumBed, Scene, check_grid, check_material
from zoobench.sim.model.standing import standing
from zoobench.sim.model.surface_water import SurfaceWater
from zoobench.sim.model.terrain import Terrain

LAND_ROBOT = LAND.robot

OPEN_ARENA = (0.5, 0.4, 0.5)
"""[m] Of firm ground; level ground has no end, whatever its size, see `Environment.scene`."""

EPISODE_SECONDS = 1.6
"""Length of the published episodes, of 200 control frames [s]."""

HIGHEST_SPEED = 0.5
"""[m/s] Of a robot on land, up to which no arena ends within an episode: published gaits go 0.28 m/s at most there, and
1.6 in the ocean, which has no sides."""

BED_START = 0.35
"""Start of a land robot on a bed or in a tank that does not follow it, relative to its length."""

FREE_ROOM = 0.1
"""[m] Around a robot at its start, whichever way it turns; at least `_FREE_CELLS`, and `_FREE_SHARE` of its reach."""

_FREE_CELLS = 5

_FREE_SHARE = 0.4
"""Share of a long robot's reach, which its muscles stretch."""

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
        arena: size along x, y, z [m], at least; it begins at the origin, and level ground is y = 0.
        bed: the medium on the ground, or None.
        start: initial position of the robot's centre, relative to the arena's size along x and z; one that follows the
            robot has it in the middle.
        stance: initial height of the robot.
        equilibration_frames: control frames of damped equilibration before the episode.
        gravity: [m/s^2].
        hills, profile: of ground that is not level; a solid bed lies on it with constant thickness, the surface of
            water is level, its thickness above the lowest ground.
        skin: of the ground, by which it carries a robot outside water.
        water: that fills the arena, on a grid, in place of a bed; the ground is smooth.
        surface_water: that acts on the robot's surface, without bounds, in place of ground and bed.
        onset: time in which muscles come to their full activity at the beginning of an episode [s].
        objects: about the robot.
        obstacles: on its way.
    """

    robot: ElasticMaterial
    friction: float
    arena: tuple[float, float, float]
    bed: Bed | None = None
    start: tuple[float, float] = (0.5, 0.5)
    stance: Stance = Stance.STANDING
    equilibration_frames: int = 0
    gravity: tuple[float, float, float] = EARTH_GRAVITY
    hills: Hills = LEVEL
    profile: Profile = LEVEL_WAY
    skin: GroundSkin = SKIN
    water: GridWater | None = None
    surface_water: SurfaceWater | None = None
    onset: float = 0.0
    objects: Objects = NO_OBJECTS
    obstacles: Obstacles = NO_OBSTACLES

    def __post_init__(self) -> None:
        if not 0.0 <= self.friction < np.inf:
            raise UsageError(f"A friction of {self.friction:g} is not possible. Give 0 or more.")
        if min(self.arena) <= 0.0 or (self.bed is not None and not 0.0 < self.bed.thickness < self.arena[1]):
            depth = "" if self.bed is None else f" with a bed of {self.bed.thickness:g} m"
            raise UsageError(f"An arena of {self.arena} m{depth} is not possible. Give positive lengths that fit.")
        check_material("robot", self.robot)
        self._check_density(1.0)
        if self.water is not None:
            self.water.check()
        if self.surface_water is not None:
            self.surface_water.check()
        if self.bed is not None:
            check_material("medium", self.bed.material)
            self.bed.check(-self.gravity[1])

    @property
    def follows(self) -> bool:
        """Whether the arena follows the robot: on level ground, on beds of solid matter, and in water on a grid.

        One with objects or obstacles stays where they are.
        """
        solid = self.bed is None or (
            self.stance is Stance.STANDING and not isinstance(self.bed.material, WaterMaterial)
        )
        return self.profile.is_level and not self.hills.relief and solid and not (self.objects or self.obstacles)

    @property
    def is_deep(self) -> bool:
        """Whether water without particles surrounds the robot: on a grid, or by forces on its surface."""
        return self.water is not None or self.surface_water is not None

    def simulated(self, fidelity: Fidelity) -> Fidelity:
        """The fidelity with which its scenes are simulated: water by forces on the surface has its robot in its rest
        frame.

        Raises:
            UsageError: that cannot be with this fidelity.
        """
        if self.surface_water is None:
            return fidelity
        if fidelity.particles_per_cell not in REST_FRAME_PARTICLES:
            raise UsageError(
                f"{fidelity.particles_per_cell} particles per cell do not hold a robot in water by forces on its "
                "surface. Give particles_per_cell=8 or 27 with the fidelity, or choose another water."
            )
        return replace(fidelity, robot="lagrangian")

    def scene(self, body: Body, fidelity: Fidelity, seconds: float = EPISODE_SECONDS) -> Scene:
        """The body at rest at its start, in or on the medium without overlap.

        The arena is as long as an episode of so many `seconds` needs at `HIGHEST_SPEED`, or it follows the robot.

        Raises:
            SceneError: the body does not fit into the arena, or no grid is large enough for that.
            UsageError: it is too light for water on a grid.
        """
        self._check_density(float(body.density_ratio.min()))
        h, follows = fidelity.grid_spacing, self.follows and body.anchored is None
        size, start = self._following(body, fidelity) if follows else self.standing_size(seconds, h)
        terrain = self.profile.terrain((size[0], size[2]), (float(start[0]), float(start[2])), self.hills)
        if terrain is not None:
            terrain.check_resolved(h)
            if not self.profile.is_level:
                terrain = _on_grid(terrain, start, h)
                size[1] += float(terrain.heights.max())
        shift = start + fidelity.displacement
        floor = self._floor(body, _rise(terrain, body.positions + shift), float(size[1]))
        shift = shift + np.array([0.0, floor, 0.0])
        positions = body.positions + shift
        if (positions < 0).any() or (positions > size).any():
            extent = tuple(float(length) for length in np.round(np.ptp(body.positions, axis=0), 3))
            above = float(body.positions[:, 1].min())
            hung, lower = (
                (f", {above:.3g} m above the floor,", ", less clearance") if body.anchored is not None else ("", "")
            )
            raise SceneError(
                f"A body of {extent} m{hung} does not fit into the arena of {tuple(size.tolist())} m with its floor at "
                f"{floor:g} m. Use a smaller body{lower} or a larger arena."
            )
        placed = ElasticBody.placed(self.robot, body, positions, body.edge)
        anchor = body.anchor(shift)
        robot = replace(placed, site_offsets=body.sites - body.positions, anchor=anchor, drive=body.drive)
        sites = body.sites + shift
        scene = Scene(
            robot=robot,
            lower=(0.0, 0.0, 0.0),
            upper=(float(size[0]), float(size[1]), float(size[2])),
            medium=self._fill(size, terrain, robot, sites, fidelity, shared=body.malleable),
            ground=None if self.surface_water else Ground(self.friction, terrain, self.skin),
            gravity=self.gravity,
            water=self.water,
            surface_water=self.surface_water and replace(self.surface_water, hull=hull_of(body).moved(shift)),
            follows=follows,
        )
        scene = standing(scene, body.edge)
        scene = self.objects.placed(scene, fidelity) if self.objects else scene
        check_grid(scene.cells(h), "cells")  # before obstacles, which take long to sample there
        return self.obstacles.placed(scene, fidelity) if self.obstacles else scene

    def _check_density(self, ratio: float) -> None:
        """Raise a `UsageError` where matter of this density ratio is too light for water on a grid."""
        density = self.robot.density * ratio
        least = 0.0 if self.water is None else self.water.lightest
        if density < (1.0 - 1e-9) * least:  # which the mean of a body's points may miss
            raise UsageError(
                f"A robot of {density:g} kg/m^3 is too light for this water: their exchange of momentum would not be "
                f"stable. Give a density of {least:g} kg/m^3 or more."
            )

    def _following(self, body: Body, fidelity: Fidelity) -> tuple[Array, Array]:
        """Size of an arena that follows the robot, with room for it to turn, and the robot's start in the middle [m].

        It is an even number of cells wide, so that matter left behind fits in before the robot, and so that the robot
        has the same place relative to the grid whatever the size.
        """
        h, reach = fidelity.grid_spacing, float(np.hypot(*np.ptp(body.positions, axis=0)[[0, 2]]))
        needed = reach + 2.0 * max(FREE_ROOM, _FREE_SHARE * reach, _FREE_CELLS * h)
        length, height, width = self.arena
        size = np.array([2.0 * h * math.ceil(max(side, needed) / (2.0 * h) - 1e-6) for side in (length, height, width)])
        # water by forces has no bounds, and room for a body of any height
        tall = 0.0 if self.surface_water is None else float(body.positions[:, 1].max()) + 2.0 * FREE_ROOM
        size[1] = max(height, tall)
        return size, size * (0.5, 0.0, 0.5)

    def standing_size(self, seconds: float, grid_spacing: float) -> tuple[Array, Array]:
        """Size of an arena that does not follow the robot, and the robot's start in it [m].

        It is longer by whole cells, so that episodes of every length begin at the same place of the grid.

        A bed is longer by the way of an episode ahead, and firm ground, which costs nothing, on every side, by the way
        down a slope and by what objects or a bridge take. A tank of water is as large as it is given, since waves of a
        longer one would take longer to rest, and one of water on a grid larger by what objects take on their side.
        """
        fastest = max(HIGHEST_SPEED, abs(self.objects.object_speed)) if self.objects else HIGHEST_SPEED
        taken = _whole(self.objects.reach + self.obstacles.reach, grid_spacing)
        way = _whole(fastest * seconds, grid_spacing) + taken
        size = np.array(self.arena)
        start = size * (self.start[0], 0.0, self.start[1])
        if self.objects and self.bed is not None:  # an object is pushed anywhere, and its robot goes round it
            room = _whole(FREE_ROOM, grid_spacing)
            size += [room, 0.0, 2.0 * room]
            start += [room, 0.0, room]
        if self.water is not None:
            side = taken * self.objects.direction
            return size + np.abs(side), start + np.maximum(-side, 0.0)
        if self.bed is not None:
            size[0] += 0.0 if isinstance(self.bed.material, WaterMaterial) else way
            return size, start
        slope = np.radians(self.profile.slope)
        fall = 0.5 * -self.gravity[1] * np.sin(slope) * np.cos(slope) * seconds**2  # towards lower x
        size += [2.0 * way + _whole(abs(fall), grid_spacing), 0.0, 2.0 * way]
        start += [way + _whole(max(fall, 0.0), grid_spacing), 0.0, way]
        return size, start

    def _floor(self, body: Body, rise: float, height: float) -> float:
        """Height of the body's underside [m] in an arena of this height [m], where it must be above `rise` [m] to be
        clear of the ground."""
        if self.is_deep:
            return max(0.0, height - float(body.positions[:, 1].max())) / 2
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
        self, size: Array, terrain: Terrain | None, robot: ElasticBody, sites: Array, fidelity: Fidelity, *,
        shared: bool,
    ) -> MediumBed | None:  # fmt: skip
        """The medium, without the robot's volume in cubes about `sites` `[n, 3]` [m], or with particles that share it.

        The cubes are a lattice, so that their volumes fill none of the bed's places twice; their particles are not.
        """
        if self.bed is None:
            return None
        bed = self.bed.fill(size, -self.gravity[1], fidelity, terrain)
        if self.stance is Stance.STANDING:
            return bed
        # with a shared place, guests have the rest that the robot leaves of it
        taken = robot.volumes if shared else robot.occupancy * robot.volumes
        bed = without_overlap(bed, sites, taken, fidelity)
        if not shared:
            return bed
        hosts = np.flatnonzero(robot.positions[:, 1] < self.bed.thickness)
        guests = self.bed.at_rest(robot.positions[hosts], robot.volumes[hosts], -self.gravity[1])
        return sharing(bed, guests, hosts)


def firm_environment(
    *,
    friction: float,
    hills: Hills,
    profile: Profile,
    physics: Physics,
    contact: Contact,
    objects: Objects,
    obstacles: Obstacles,
) -> Environment:
    """A land robot on firm ground, level or not, without walls."""
    check_no_idle(objects, NO_OBJECTS, "object=box")
    check_no_idle(obstacles, NO_OBSTACLES, "obstacle=slot")
    return Environment(
        robot=physics.robot,
        friction=friction,
        arena=OPEN_ARENA,
        equilibration_frames=equilibration_frames(physics.gravity),
        gravity=(0.0, -physics.gravity, 0.0),
        hills=hills,
        profile=profile,
        skin=contact.skin,
        objects=objects,
        obstacles=obstacles,
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
    objects: Objects = NO_OBJECTS,
) -> Environment:
    """A land robot on or in a bed of at least this `size` along x and z [m] on the ground."""
    check_no_idle(objects, NO_OBJECTS, "object=box")
    length, width = size
    return Environment(
        robot=physics.robot,
        friction=friction,
        arena=(length, 0.3, width),
        bed=bed,
        start=(BED_START, 0.5),
        stance=stance,
        equilibration_frames=equilibration_frames(physics.gravity),
        gravity=(0.0, -physics.gravity, 0.0),
        hills=hills,
        profile=profile,
        objects=objects,
    )


def solid_bed_environment(
    material: Medium, bed: SolidBed, *, physics: Physics, hills: Hills, profile: Profile, objects: Objects
) -> Environment:
    """A land robot on a bed of solid matter on the ground."""
    return bed_environment(
        bed.of(material),
        friction=bed.friction,
        size=(bed.length, bed.width),
        physics=physics,
        hills=hills,
        profile=profile,
        objects=objects,
    )


def _whole(length: float, grid_spacing: float) -> float:
    """A length rounded up to whole cells [m]."""
    return grid_spacing * math.ceil(length / grid_spacing - 1e-6)


def _on_grid(terrain: Terrain, start: Array, grid_spacing: float) -> Terrain:
    """The terrain raised to where the ground at the start is a whole number of cells high."""
    height = float(terrain.heights_below(start[None])[0])
    risen = terrain.heights + _whole(height, grid_spacing) - height
    return replace(terrain, heights=np.maximum(risen, 0.0))  # rounding would have the lowest point below it


def _rise(terrain: Terrain | None, positions: Array) -> float:
    """Height by which a body that stands on y = 0 is lifted so that no particle is closer to the terrain [m]."""
    if terrain is None:
        return 0.0
    lowest = positions[:, 1].min()
    return float((terrain.heights_below(positions) - (positions[:, 1] - lowest)).max())
