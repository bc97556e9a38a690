"""Scenes: matter, ground and arena, as plain data, from which the physical effects to simulate are derived.

SI units; y is up; the ground plane is y = 0.
"""

import math
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import cached_property
from itertools import accumulate, combinations

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import SceneError
from zoobench.sim.model.elastic_bodies import ElasticBody, SceneObject, joined, overlap
from zoobench.sim.model.fidelity import Fidelity, Transfer
from zoobench.sim.model.grid_water import GridWater
from zoobench.sim.model.ground_skin import SKIN, GroundSkin
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.surface_water import SurfaceWater
from zoobench.sim.model.terrain import Terrain

EARTH_GRAVITY = (0.0, -9.81, 0.0)

_LARGEST_GRID = 2**28
"""Nodes of an arena, at most."""


class Effect(StrEnum):
    """A physical effect, compiled and simulated only where a scene calls for it."""

    ELASTICITY = "elasticity"
    MUSCLE = "muscle"
    DAMPING = "damping"
    PLASTICITY = "plasticity"
    FLUID = "fluid"
    FRICTION = "friction"
    CONTACT = "contact"


_MAY_BE_ZERO = ("muscle_strength", "friction_angle", "viscosity", "hardening")


@dataclass(frozen=True)
class MediumBed:
    """The medium that the robot moves on or in, at time zero. Arrays run over its particles.

    Attributes:
        positions: `[particle_count, 3]` [m].
        volumes: `[particle_count]` rest volume [m^3].
        left_cauchy_green: `[particle_count, 6]` elastic b (xx yy zz xy xz yz); not used by water.
        history: `[particle_count]` log-volume gained (sand), plastic volume ratio (snow) or J (water).
        stress: `[particle_count, 6]` Kirchhoff stress that goes with b [Pa]; not used by water.
        velocities: `[particle_count, 3]` [m/s]; None for rest.
        hosts: `[particle_count]` index of the robot particle whose place it shares, -1 for none: its volume is the
            share that the robot's occupancy leaves; None if no particle shares one.
        friction: Coulomb coefficient between robot and medium, which then have velocity fields of their own [-]; None
            for one field of both, in which the medium sticks to the robot.
        transfer: of its velocity between particles and grid; None for the fidelity's `medium_transfer`.
    """

    material: Medium
    positions: Array
    volumes: Array
    left_cauchy_green: Array
    history: Array
    stress: Array
    velocities: Array | None = None
    hosts: NDArray[np.int64] | None = None
    friction: float | None = None
    transfer: Transfer | None = None

    @property
    def particle_count(self) -> int:
        """Number of particles."""
        return len(self.positions)

    @classmethod
    def at_rest(cls, material: Medium, positions: Array, volumes: Array, strains: Array | None = None) -> "MediumBed":
        """A bed with principal Hencky strains `[particle_count, 3]` along the axes; free of strain if None.

        The strains must be elastic: within the material's yield surface.
        """
        strains = np.zeros_like(positions) if strains is None else strains
        shear, history = np.zeros_like(strains), material.rest_history(strains)
        return cls(
            material=material,
            positions=positions,
            volumes=volumes,
            left_cauchy_green=np.hstack([np.exp(2.0 * strains), shear]),
            history=history,
            stress=np.hstack([material.stress(strains, history), shear]),
        )


@dataclass(frozen=True)
class Ground:
    """Firm ground with Coulomb friction: the plane y = 0, or a terrain.

    Attributes:
        friction: Coulomb's coefficient [-].
        terrain: heights of ground that is not level.
        skin: the compliant layer by which it pushes on a robot. For a medium, and for a robot that shares its velocity,
            the ground is rigid: it constrains velocities, and matter that separates from it is free.
    """

    friction: float
    terrain: Terrain | None = None
    skin: GroundSkin = SKIN

    @property
    def is_smooth(self) -> bool:
        """Whether it is a level plane without friction."""
        return self.friction == 0.0 and self.terrain is None


@dataclass(frozen=True)
class Scene:
    """Everything that the simulator simulates.

    Attributes:
        robot: the elastic body with muscles.
        medium: the matter that it moves on or in, or None.
        ground: the plane under both, or None for free flight.
        water: water on a grid that fills the arena in place of a medium, on a ground that is a smooth wall, or None.
        gravity: [m/s^2]; tilted gravity is an incline. In water on a grid it acts on the robot's excess of density.
        lower, upper: corners of the arena [m]; its walls have no friction and matter separates from them freely. With
            a ground, lower y is 0.
        follows: whether the arena moves along x and z with the robot, so that level ground, solid matter and water on a
            grid have no end.
        objects: further elastic bodies, in velocity fields other than the robot's; those of one follow each other.
        surface_water: water without bounds that acts on the robot's surface, in place of all else around it, or None.
    """

    robot: ElasticBody
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    medium: MediumBed | None = None
    ground: Ground | None = None
    gravity: tuple[float, float, float] = EARTH_GRAVITY
    water: GridWater | None = None
    follows: bool = False
    objects: tuple[SceneObject, ...] = ()
    surface_water: SurfaceWater | None = None

    def __post_init__(self) -> None:
        _check_elastic(self.robot)
        if self.surface_water is not None:
            self.surface_water.check()
            if self.ground is not None or self.medium is not None or self.water is not None or self.objects:
                raise SceneError(
                    "Water by forces on the robot's surface has no bounds, and nothing else is in it. Leave out "
                    "ground, medium, objects and water on a grid."
                )
        if self.water is not None:
            self.water.check()
            if self.medium is not None or (self.ground is not None and not self.ground.is_smooth):
                raise SceneError(
                    "Water on a grid fills the arena from wall to wall. Leave out the medium, and friction and terrain "
                    "of the ground."
                )
        if self.medium is not None:
            _check_medium(self.medium)
        if not np.isfinite(self.gravity).all():
            raise SceneError(f"The gravity {self.gravity} m/s^2 is not finite.")
        if self.ground is not None and not 0 <= self.ground.friction < np.inf:
            raise SceneError(
                f"A friction coefficient of {self.ground.friction:g} is negative or not finite. Give 0 or more."
            )
        self._check_arena()
        self._check_objects()
        self._check_anchors()
        bodies = {name: body.positions for name, body in self.bodies.items()}
        bodies |= {"medium": self.medium.positions} if self.medium else {}
        if self.medium is not None and self.medium.hosts is not None:
            hosts = self.medium.hosts
            if hosts.min() < -1 or hosts.max() >= self.robot.particle_count:
                raise SceneError(
                    f"The medium's hosts range from {hosts.min()} to {hosts.max()}; the robot has the particles 0 to "
                    f"{self.robot.particle_count - 1}, and -1 stands for none."
                )
        for name, positions in bodies.items():
            outside = np.any((positions < self.lower) | (positions > self.upper), axis=1)
            if outside.any():
                first = positions[outside][0]
                raise SceneError(
                    f"{int(outside.sum())} particles of the {name} lie outside the arena {self.lower} to {self.upper} "
                    f"m, the first at {tuple(np.round(first, 4).tolist())}. Move the {name} or widen the arena."
                )

    def _check_objects(self) -> None:
        names = ["robot", "medium", *(each.name for each in self.objects)]
        for each in self.objects:
            _check_elastic(each.body, each.name)
            if names.count(each.name) > 1:
                raise SceneError(f"Two bodies have the name '{each.name}'. Give every object a name of its own.")
            if each.body.muscle_count:
                raise SceneError(f"The object '{each.name}' has muscles. Only the robot may have them.")
            for value in (each.friction, each.ground_friction):
                if not 0 <= value < np.inf:
                    raise SceneError(f"A friction of {value:g} of the {each.name} is not possible. Give 0 or more.")
        for before, each in zip((None, *self.objects), self.objects, strict=False):
            if each.shares and (before is None or not each.may_share(before)):
                raise SceneError(
                    f"The {each.name} cannot share the velocity field of what is before it. Put it behind an object of "
                    "the same material, friction and size of cubes without an anchor, or let it have one of its own."
                )
        if self.objects and self.medium is not None and self.medium.friction is None:
            raise SceneError(
                "Objects are possible on or in a medium with a velocity field of its own. Give the medium a friction."
            )
        for (one, first), (other, second) in combinations(self.bodies.items(), 2):
            if overlap(first, second):
                raise SceneError(
                    f"The {other} begins within the {one}. Put it further away, or make it or the {one} smaller."
                )

    def _check_anchors(self) -> None:
        if any(body.anchor for body in self.elastic_bodies) and (self.water is not None or self.follows):
            raise SceneError(
                "A body can be anchored in an arena that stays where it is, outside water on a grid. Leave out the "
                "water, or the anchor."
            )
        if self.robot.drive is not None and (self.water is not None or self.follows or self.medium is not None):
            raise SceneError(
                "The base of a robot can move on firm ground, in an arena that stays where it is. Choose such an "
                "environment, or a base that is held."
            )
        for name, body in self.bodies.items():
            for low, high in body.anchor:
                if not np.less_equal(low, high).all():
                    raise SceneError(f"The anchor of the {name} from {low} to {high} m is no box.")

    def _check_arena(self) -> None:
        if self.ground is not None and self.ground.terrain is not None:
            self.ground.terrain.check(self.upper[1])
        if self.ground is not None and self.lower[1] != 0.0:
            raise SceneError(f"The ground is the plane y = 0 but the arena begins at y = {self.lower[1]:g} m.")
        if self.follows and not self.is_endless:
            raise SceneError(
                "An arena cannot follow its robot over a terrain or in water of particles. Leave them out."
            )
        if self.follows and self.objects:
            raise SceneError("An arena cannot follow its robot away from objects. Leave out one of both.")

    def robot_edge(self, fidelity: Fidelity) -> float:
        """Edge of the cubes that the robot's particles stand for [m]."""
        return self.robot.edge or fidelity.particle_edge

    @property
    def is_endless(self) -> bool:
        """Whether ground and medium are the same everywhere: level, and no water of particles, whose waves go on."""
        level = self.ground is None or self.ground.terrain is None
        return level and (self.medium is None or not self.medium.material.is_liquid)

    @property
    def is_bare(self) -> bool:
        """Whether neither a medium nor water surrounds the robot."""
        return self.medium is None and self.water is None and self.surface_water is None

    @property
    def effects(self) -> frozenset[Effect]:
        """The effects to simulate, derived from the other attributes."""
        found = {Effect.ELASTICITY}
        if self.robot.muscle_count and self.robot.material.muscle_strength > 0:
            found.add(Effect.MUSCLE)
        if max(body.material.viscosity for body in self.elastic_bodies) > 0:
            found.add(Effect.DAMPING)
        if self.medium is not None:
            material = self.medium.material
            found |= {Effect.PLASTICITY} if material.yields else set()
            found |= {Effect.FLUID} if material.flows else set()
            if self.medium.friction is not None:
                found.add(Effect.CONTACT)
        if self.objects and self.water is None:
            found.add(Effect.CONTACT)
        if self.water is not None or self.surface_water is not None:
            found.add(Effect.FLUID)
        if self.ground is not None and self.ground.friction > 0:
            found.add(Effect.FRICTION)
        return frozenset(found)

    def cells(self, grid_spacing: float) -> tuple[int, int, int]:
        """Cells of the arena along x, y and z."""
        # an arena of a whole number of cells must not gain one by rounding
        x, y, z = (math.ceil((b - a) / grid_spacing - 1e-6) for a, b in zip(self.lower, self.upper, strict=True))
        return x, y, z

    def heights_above_ground(self, positions: Array) -> Array:
        """Heights of positions `[n, 3]` [m] above the rigid ground `[n]` [m]."""
        above: Array = positions[:, 1]
        if self.ground is not None and self.ground.terrain is not None:
            above = above - self.ground.terrain.heights_below(positions)
        return above

    def water_cells(self, grid_spacing: float) -> int:
        """Cells of water on a grid; 0 without."""
        return math.prod(self.cells(grid_spacing)) if self.water else 0

    @property
    def particle_count(self) -> int:
        """Particles of all matter together."""
        return self.elastic.particle_count + (self.medium.particle_count if self.medium else 0)

    @cached_property
    def bodies(self) -> dict[str, ElasticBody]:
        """The robot and the objects by name, in the order of their particles."""
        return {"robot": self.robot, **{each.name: each.body for each in self.objects}}

    @property
    def elastic_bodies(self) -> tuple[ElasticBody, ...]:
        """The same without their names."""
        return tuple(self.bodies.values())

    @cached_property
    def elastic(self) -> ElasticBody:
        """Robot and objects as one body, for code that treats all their particles equally; the material is the robot's.

        The density ratios are by the robot's density. Muscles have no share of objects.
        """
        return self.robot if not self.objects else joined(self.elastic_bodies)

    @property
    def field_objects(self) -> tuple[SceneObject, ...]:
        """Of each velocity field of objects the first one."""
        return tuple(each for each in self.objects if not each.shares)

    @cached_property
    def _slices(self) -> dict[str, slice]:
        """Where the particles of each body, and of the medium, stand among all."""
        sizes = {name: body.particle_count for name, body in self.bodies.items()}
        sizes |= {"medium": self.medium.particle_count} if self.medium else {}
        ends = accumulate(sizes.values())
        return {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}

    def owner_of(self, particle: int) -> str:
        """The name of the body that has this one of all particles."""
        return next(name for name, own in self._slices.items() if particle < own.stop)

    def slice_of(self, name: str) -> slice:
        """Where a body's particles stand among all: `robot`, an object's name, or `medium`.

        Raises:
            SceneError: there is no such body.
        """
        if name not in self._slices:
            raise SceneError(f"The scene has no body '{name}'. It has: {', '.join(self._slices)}.")
        return self._slices[name]


def has_skin(scene: Scene) -> bool:
    """Whether the ground pushes on the robot by its skin, see `Ground`: not in water or where both share a velocity."""
    if scene.ground is None or scene.water is not None:
        return False
    return scene.medium is None or scene.medium.friction is not None


def check_grid(counts: tuple[int, int, int], parts: str) -> None:
    """Refuse a grid of so many `parts`, cells or nodes, along x, y and z.

    Raises:
        SceneError: they are too many.
    """
    x, y, z = counts
    if x * y * z > _LARGEST_GRID:
        raise SceneError(
            f"The arena takes {x} x {y} x {z} grid {parts}, too many to hold. Use a coarser fidelity, fewer frames on "
            "a slope, or smaller and nearer objects and obstacles."
        )


def medium_transfer(scene: Scene, fidelity: Fidelity) -> Transfer:
    """The transfer of the medium's velocity between particles and grid: its own, or that of the fidelity."""
    own = scene.medium.transfer if scene.medium else None
    return own or fidelity.medium_transfer


def has_fbar(scene: Scene, fidelity: Fidelity) -> bool:
    """Whether the medium's volume changes as that around it, against locking; not where a particle keeps a motion of
    its own besides that which deforms it."""
    return scene.medium is not None and scene.medium.material.locks and medium_transfer(scene, fidelity) != "aflip"


def _check_elastic(body: ElasticBody, owner: str = "body") -> None:
    count = body.particle_count
    shapes = {
        "positions": (count, 3), "volumes": (count,), "stiffness": (count,), "density_ratio": (count,),
        "occupancy": (count,), "muscle_membership": (count, body.muscle_count), "fibres": (count, 3),
        "velocities": (count, 3),
    }  # fmt: skip
    if body.velocity_gradients is not None:
        shapes["velocity_gradients"] = (count, 3, 3)
    for name, shape in shapes.items():
        _check_array(owner, name, getattr(body, name), shape)
    if not count or not (body.occupancy > 0).any():
        raise SceneError(f"The {owner} is empty: no particle has an occupancy above 0. Check the design's parameters.")
    for name in ("volumes", "stiffness", "density_ratio"):
        if getattr(body, name).min() <= 0:
            raise SceneError(f"The {owner}'s {name} must be positive; the smallest is {getattr(body, name).min():g}.")
    if body.occupancy.min() < 0 or body.occupancy.max() > 1:
        raise SceneError(
            f"The {owner}'s occupancy reaches {body.occupancy.min():g} to {body.occupancy.max():g}; "
            "it must be in [0, 1]."
        )
    check_material(owner, body.material)


def _check_medium(medium: MediumBed) -> None:
    count = medium.particle_count
    shapes = {
        "positions": (count, 3),
        "volumes": (count,),
        "left_cauchy_green": (count, 6),
        "history": (count,),
        "stress": (count, 6),
    }
    if medium.velocities is not None:
        shapes["velocities"] = (count, 3)
    if medium.hosts is not None:
        shapes["hosts"] = (count,)
    for name, shape in shapes.items():
        _check_array("medium", name, getattr(medium, name), shape)
    if not count or medium.volumes.min() <= 0:
        raise SceneError("The medium is empty or has particles without volume. Leave it out, or fill a thicker bed.")
    if medium.friction is not None and not 0 <= medium.friction < np.inf:
        raise SceneError(
            f"A friction of {medium.friction:g} between robot and medium is negative or not finite. Give 0 or more."
        )
    check_material("medium", medium.material)


def _check_array(owner: str, name: str, value: Array, shape: tuple[int, ...]) -> None:
    if value.shape != shape:
        raise SceneError(f"The {owner}'s {name} have shape {value.shape}; {shape} was expected.")
    if not np.isfinite(value).all():
        raise SceneError(f"The {owner}'s {name} hold values that are not finite. Check their source.")


def check_material(owner: str, material: ElasticMaterial | Medium) -> None:
    """Refuse constants that no matter has.

    Raises:
        SceneError: one is not finite or out of its range; names the owner, the constant and the range.
    """
    for item in fields(material):
        value = getattr(material, item.name)
        low = 0.0 if item.name in _MAY_BE_ZERO else np.finfo(float).tiny
        if item.name == "poissons_ratio":
            if not -1.0 < value < 0.5:
                raise SceneError(f"The {owner}'s Poisson's ratio {value:g} is not between -1 and 0.5.")
        elif not low <= value < np.inf:
            raise SceneError(
                f"The {owner}'s {item.name} is {value:g}. Give a {'non-negative' if not low else 'positive'} number."
            )
    for name, most in material.limits.items() if isinstance(material, Medium) else ():
        if getattr(material, name) >= most:
            raise SceneError(f"The {owner}'s {name} is {getattr(material, name):g}. Give a number below {most:g}.")
