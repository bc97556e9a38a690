"""Objects that environments put about a robot: stiff elastic bodies to push, kick, carry or topple."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import cycle, islice
from typing import Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.mesh_file import FORMATS, MeshPath
from zoobench.designs.sampling import SolidSample
from zoobench.envs.object_solids import NO_MESH, ObjectKind, ObjectSolid, solid_of
from zoobench.envs.ranges import check_ranges
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.elastic_bodies import ElasticBody, SceneObject, in_fields
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.standing import standing

Place = Literal["ahead", "behind", "left", "right", "rubble", "back", "below"]

_FAR = {
    "ahead": (1.0, 0.0), "behind": (-1.0, 0.0), "left": (0.0, -1.0), "right": (0.0, 1.0), "rubble": (1.0, 0.0)
}  # fmt: skip
"""Directions along x and z."""

_UNDER = ("back", "below")
"""Places above each other with the robot's."""

_MOST = 10

_ROWS = ((0.0, -1.0, 1.0), (-0.5, 0.5))
"""Places of rubble in every first and every second row across the way, in steps from one to the next."""

_FIELDS, _RUBBLE_FIELDS = (0, 1, 2), (0, 1, 2, 2, 1)
"""Velocity fields of objects one after the other, again and again, so that no two beside each other have the same.

There are three since kernels are compiled for every pair of fields, which takes minutes for five.
"""

_GAP = 0.02

_FASTEST = 2.0
"""[m/s] Of an object when it begins: upwards it rises by 0.2 m, half of the arena's height."""

_POISSONS_RATIO = 0.2
"""The robot's. Pressure waves of a solid with 0.3 are a fifth faster, and want as many more steps."""

_APART = 0.25
"""Distance at which an object is put down on a back [cells]: that at which two bodies carry each other."""


@dataclass(frozen=True, kw_only=True)
class Objects:
    """Objects about the robot: stiff elastic bodies with friction.

    * `object`: `box`, `ball`, `beam` (across the way), `column` (an upright beam), `sheet` or `mesh`; `none` for none.
    * `object_other`: kind of every second one of several, as dense as the first; `none` for the same kind.
    * `object_file`: of a `mesh`, a closed surface as STL, OBJ, PLY or GLB, with x ahead and z up, in GLB y; its content
      becomes part of the run's key.
    * `object_size`: edge of a box, diameter of a ball, length of the longest side of others [m].
    * `object_mass`: of the first; 0 in water on a grid, for that of as much water [kg].
    * `object_place`: `ahead`, `behind`, `left` or `right` of the robot on the ground, as `rubble` ahead of it, in rows
      of three and two, on its `back`, or on the ground `below` a robot that hangs.
    * `object_height`: of its underside above level ground, from which it falls unless an obstacle is below it [m]; 0
      for on the ground.
    * `object_gap`: between robot and object, or two objects; none on the back or below [m].
    * `object_shift`: of an object ahead or behind, to the right; of others, ahead [m].
    * `object_speed`: with which they all begin, towards the robot; of those on the back or below, ahead [m/s].
    * `object_speed_up`: the same, upwards [m/s].
    * `object_friction`: Coulomb coefficient between an object and the robot, or another object; in water on a grid they
      stick to each other [-].
    * `object_ground_friction`: the same between an object and the ground [-].
    * `object_stiffness`: Young's modulus [Pa]; the robot's is 1e4.
    * `object_count`: of objects, up to 10, in a row away from the robot, or stacked on its back; beyond 3 some stick to
      each other where they meet.
    * `object_spread`: up to which they are all moved ahead or back and left or right, by a draw for each; in rubble
      every one by draws of its own [m].
    * `object_mass_spread`: share of the mass up to which they are heavier or lighter, by another [-].
    * `object_seed`: which draws.
    """

    object: ObjectKind = "none"
    object_other: ObjectKind = "none"
    object_file: MeshPath = NO_MESH
    object_size: float = 0.0625
    object_mass: float = 0.08
    object_place: Place = "ahead"
    object_height: float = 0.0
    object_gap: float = _GAP
    object_shift: float = 0.0
    object_speed: float = 0.0
    object_speed_up: float = 0.0
    object_friction: float = 0.5
    object_ground_friction: float = 0.5
    object_stiffness: float = 3e4
    object_count: int = 1
    object_spread: float = 0.0
    object_mass_spread: float = 0.0
    object_seed: int = 0

    def __post_init__(self) -> None:
        check_ranges(
            self,
            positive=("object_size", "object_stiffness"),
            not_negative=(
                "object_friction",
                "object_ground_friction",
                "object_gap",
                "object_spread",
                "object_height",
            ),
        )
        if not 0.0 <= self.object_mass < np.inf:
            raise UsageError(
                f"An object_mass of {self.object_mass:g} kg is not possible. Give a positive one; in water on a grid 0 "
                "is that of as much water."
            )
        if not np.isfinite(self.object_shift):
            raise UsageError(f"An object_shift of {self.object_shift:g} m is not possible. Give a finite number.")
        if not (abs(self.object_speed) <= _FASTEST and abs(self.object_speed_up) <= _FASTEST):
            raise UsageError(
                f"An object that begins with {self.object_speed:g} and {self.object_speed_up:g} m/s is not possible. "
                f"Give an object_speed and an object_speed_up from -{_FASTEST:g} to {_FASTEST:g}."
            )
        if not 1 <= self.object_count <= _MOST:
            raise UsageError(f"An object_count of {self.object_count} is not possible. Give 1 to {_MOST}.")
        if self.object_place == "below" and self.object_count > 1:
            raise UsageError(
                f"An object_count of {self.object_count} below the robot is not possible, where one has room. Give 1, "
                "or another object_place."
            )
        if self.object_place in _UNDER and self.object_height:
            raise UsageError(
                f"An object_height of {self.object_height:g} m on the robot's back or below it is not possible. Leave "
                "it out, or give another object_place."
            )
        if self.object_place in _UNDER and self.object_gap != _GAP:
            raise UsageError(
                "An object on the robot's back or below it has no object_gap. Give an object_shift to have it further "
                "ahead."
            )
        self._check_spreads()
        self._check_kinds()

    def _check_kinds(self) -> None:
        if self.object_other != "none" and (self.object_count == 1 or self.object_other == self.object):
            raise UsageError(
                f"object_other={self.object_other} has no effect on {self.object_count} of object={self.object}. Leave "
                "it out, or give another kind and an object_count of 2 or more."
            )
        has_mesh = "mesh" in (self.object, self.object_other)
        if has_mesh != bool(self.object_file):
            raise UsageError(
                f"object={self.object} with {'an' if self.object_file else 'no'} object_file is not possible. Give "
                f"object=mesh and object_file=PATH ({', '.join(FORMATS)}), or neither."
            )
        if has_mesh:
            _ = self.solids  # checks the file

    def _check_spreads(self) -> None:
        spread, gap = self.object_spread, self.object_gap
        if not 0.0 <= self.object_mass_spread < 1.0:
            raise UsageError(
                f"An object_mass_spread of {self.object_mass_spread:g} is not possible. Give 0 or more, below 1."
            )
        if not 0 <= self.object_seed < 2**63:
            raise UsageError(f"An object_seed of {self.object_seed} is not possible. Give 0 to {2**63 - 1}.")
        if self.object_place in _FAR and spread > gap:
            raise UsageError(
                f"An object_spread of {spread:g} m would take an object with an object_gap of {gap:g} m into the "
                f"robot. Give an object_gap of {spread:g} m or more."
            )
        if self.object_place == "rubble" and 2.0 * spread > gap:
            raise UsageError(
                f"An object_spread of {spread:g} m would take an object of rubble with an object_gap of {gap:g} m into "
                f"another. Give an object_gap of {2.0 * spread:g} m or more."
            )

    def __bool__(self) -> bool:
        return self.object != "none"

    @property
    def _draws(self) -> Array:
        """The draws in [-1, 1] of `object_seed`: for the place of all along and across and for the mass, and in rubble
        for the place of each `[3 + 2 object_count]`."""
        return np.random.default_rng(self.object_seed).uniform(-1.0, 1.0, 3 + 2 * self.object_count)

    @property
    def solids(self) -> tuple[ObjectSolid, ...]:
        """That of every object, or those of two kinds, which objects have in turn."""
        kinds = (self.object,) if self.object_other == "none" else (self.object, self.object_other)
        return tuple(solid_of(kind, self.object_size, self.object_file) for kind in kinds)

    @property
    def _largest(self) -> Array:
        """Length, height and width of a box that holds any of them `[3]` [m]."""
        found: Array = np.max([solid.size for solid in self.solids], axis=0)
        return found

    @property
    def moves(self) -> bool:
        """Whether they begin with a velocity."""
        return bool(self and (self.object_speed or self.object_speed_up))

    @property
    def direction(self) -> Array:
        """In which they are from the robot `[3]`; 0 for above or below it."""
        x, z = _FAR.get(self.object_place, (0.0, 0.0))
        return np.array([x, 0.0, z])

    @property
    def _velocity(self) -> Array:
        """With which they begin `[3]` [m/s]."""
        x, z = _FAR.get(self.object_place, (-1.0, 0.0))
        return np.array([-x * self.object_speed, self.object_speed_up, -z * self.object_speed])

    @property
    def reach(self) -> float:
        """How far they go beyond the robot in any horizontal direction, at most [m]; 0 without any."""
        if not self:
            return 0.0
        side, steps = float(self._largest[[0, 2]].max()), float((self._steps + np.array([1.0, 0.5])).max())
        return steps * (side + abs(self.object_gap)) + abs(self.object_shift) + self.object_spread

    @property
    def _steps(self) -> Array:
        """Steps from the middle of the first place to each: away from the robot, and to the right `[object_count,
        2]`."""
        if self.object_place != "rubble":
            return np.stack([np.arange(self.object_count), np.zeros(self.object_count)], axis=1)
        places = [(row, across) for row in range(self.object_count) for across in _ROWS[row % 2]]
        return np.array(places[: self.object_count], dtype=np.float64)

    @property
    def _ways(self) -> Array:
        """By which the seed moves each object ahead and to the right `[object_count, 2]` [m]."""
        draws = self._draws
        if self.object_place == "rubble":
            return self.object_spread * draws[3:].reshape(-1, 2)
        return np.tile(self.object_spread * draws[:2], (self.object_count, 1))

    def placed(self, scene: Scene, fidelity: Fidelity) -> Scene:
        """The scene with the objects about its robot, each on what is below it.

        Raises:
            SceneError: an object is too thin for the grid, is too heavy for the ground, or has no place.
        """
        h, edge = fidelity.grid_spacing, fidelity.particle_edge
        material = ElasticMaterial(
            youngs_modulus=self.object_stiffness,
            poissons_ratio=_POISSONS_RATIO,
            density=self._density(scene),
        )
        kinds = cycle([self._body(solid, material, fidelity) for solid in self.solids])
        bodies: list[ElasticBody] = []
        for place, rest in zip(self._places(scene.robot, edge), kinds, strict=False):
            moved = replace(rest, positions=rest.positions + place)
            if self.object_place == "back":
                below = bodies[-1] if bodies else scene.robot
                bodies.append(_put_down(scene, moved, below, edge, _APART * h))
            elif scene.water is not None:
                bodies.append(_beside(scene, moved))
            elif self.object_height:
                bodies.append(_raised(scene, moved, edge, self.object_height + _APART * h))
            else:
                bodies.append(_stood(scene, moved, edge))
        objects = [
            SceneObject(
                f"object-{number}" if number else "object", body, self.object_friction, self.object_ground_friction
            )
            for number, body in enumerate(bodies)
        ]
        fields = cycle(_RUBBLE_FIELDS if self.object_place == "rubble" else _FIELDS)
        try:
            return replace(scene, objects=in_fields(objects, list(islice(fields, len(objects)))))
        except SceneError as error:
            if self.object_place != "below":
                raise
            raise SceneError(self._no_room(scene.robot)) from error

    def _body(self, solid: ObjectSolid, material: ElasticMaterial, fidelity: Fidelity) -> ElasticBody:
        """An object at the origin; errors as of `placed`."""
        solid.check(fidelity)
        rest = passive_solid(material, solid.shape.sample(fidelity).of_volume(solid.volume))
        return replace(rest, velocities=np.broadcast_to(self._velocity, rest.positions.shape).copy())

    def _density(self, scene: Scene) -> float:
        """Of every object, checked [kg/m^3]; errors as of `placed`."""
        volume, drawn = self.solids[0].volume, 1.0 + self.object_mass_spread * float(self._draws[2])
        if scene.water is None:
            if not self.object_mass:
                raise SceneError("An object_mass of 0 kg is that of water on a grid. Give a positive one here.")
            return self.object_mass * drawn / volume
        self._check_immersed()
        density, lightest = drawn * (self.object_mass / volume or scene.water.density), scene.water.lightest
        if density < lightest:
            raise SceneError(
                f"An object of {density * volume:.3g} kg, its object_mass with the draw of object_mass_spread, is too "
                "light for this water: their exchange of momentum would not be stable. Give "
                f"{1.01 * lightest * volume:.3g} kg or more, or none: then it floats."
            )
        return density

    def _check_immersed(self) -> None:
        """Raise a `SceneError` for what has no effect in water on a grid, or no place there."""
        idle = ("object_friction", "object_ground_friction", "object_height")
        changed = [name for name in idle if getattr(self, name) != getattr(NO_OBJECTS, name)]
        if changed:
            raise SceneError(
                f"{changed[0]} has no effect in water on a grid, where bodies stick to each other and begin at one "
                "height. Leave it out."
            )
        if self.object_place in _UNDER:
            raise SceneError(
                f"An object_place of {self.object_place} is not possible in water, where nothing lies on a back. "
                f"Choose {', '.join(_FAR)}."
            )

    def _no_room(self, robot: ElasticBody) -> str:
        """Why an object below the robot begins within it."""
        size = f"A {self.object} of {self.object_size:g} m"
        if not robot.anchor and robot.drive is None:
            return (
                f"{size} has no room below a robot that stands on the ground. Choose a design that hangs, such as "
                "gripper, or another object_place, such as ahead or back."
            )
        return (
            f"{size} has no room below and between the parts of a robot that hangs {robot.positions[:, 1].min():.3g} m "
            "above the ground. Give a smaller object_size, or the design more clearance or a wider opening."
        )

    def _places(self, robot: ElasticBody, edge: float) -> Iterator[Array]:
        """Ground points of the objects `[3]` [m], at the height of the robot's underside."""
        low, high = robot.positions.min(axis=0) - edge / 2, robot.positions.max(axis=0) + edge / 2
        middle, half = (low + high) / 2, (high - low) / 2
        middle[1] = low[1]
        out, size, gap = self.direction, self._largest, self.object_gap
        aside = (abs(out[::-1]) if out.any() else np.array([1.0, 0.0, 0.0])) * self.object_shift
        length = float(abs(out) @ size)
        first = float(abs(out) @ half) + gap + length / 2
        for (away, across), (ahead, right) in zip(self._steps, self._ways, strict=True):
            step = np.array([0.0, 0.0, across * (size[2] + gap)])
            yield middle + np.array([ahead, 0.0, right]) + aside + out * (first + away * (length + gap)) + step


NO_OBJECTS = Objects()


def passive_solid(material: ElasticMaterial, sample: SolidSample) -> ElasticBody:
    """A body without muscles of a solid's particles, which stand for the cubes of its lattice."""
    body = ElasticBody.passive(material, sample.positions, sample.volumes)
    return replace(body, edge=sample.edge, site_offsets=sample.sites - sample.positions)


def _stood(scene: Scene, body: ElasticBody, edge: float) -> ElasticBody:
    """The body where the ground carries it; on a bed it is left on its surface, like the robot."""
    _check_place(body, scene)
    try:
        return standing(replace(scene, robot=body, objects=(), follows=False), edge).robot
    except SceneError as error:
        mass = float(body.masses.sum())
        raise SceneError(
            f"An object of {mass:.3g} kg sinks into the ground. Give a smaller object_mass or a greater skin_stiffness."
        ) from error


def _raised(scene: Scene, body: ElasticBody, edge: float, height: float) -> ElasticBody:
    """The body with its underside at a height above the level ground [m]."""
    if scene.ground is None or scene.ground.terrain is not None:
        raise SceneError("An object_height is above level ground. Leave out hills, slope, steps and gaps, or it.")
    up = height - (float(body.sites[:, 1].min()) - edge / 2)
    raised = replace(body, positions=body.positions + np.array([0.0, up, 0.0]))
    _check_place(raised, scene)
    return raised


def _beside(scene: Scene, body: ElasticBody) -> ElasticBody:
    """The body with its middle as high as that of a robot in water."""
    robot = scene.robot.positions[:, 1]
    up = (robot.min() + robot.max() - body.positions[:, 1].min() - body.positions[:, 1].max()) / 2
    moved = replace(body, positions=body.positions + np.array([0.0, up, 0.0]))
    _check_place(moved, scene, ", or give the water a greater length, width or depth")
    return moved


def _check_place(body: ElasticBody, scene: Scene, otherwise: str = "") -> None:
    low, high = (np.round(each, 3) for each in (body.positions.min(axis=0), body.positions.max(axis=0)))
    if (low < scene.lower).any() or (high > scene.upper).any():
        raise SceneError(
            f"An object from {tuple(low.tolist())} to {tuple(high.tolist())} m does not fit into the arena from "
            f"{scene.lower} to {scene.upper} m. Give a smaller object_size, or fewer{otherwise}."
        )


def _put_down(scene: Scene, body: ElasticBody, below: ElasticBody, edge: float, gap: float) -> ElasticBody:
    """The body so far above the highest particle of another that is below it [m].

    Raises:
        SceneError: nothing of the other is below it, or the arena is too low.
    """
    low, high = body.positions.min(axis=0) - edge / 2, body.positions.max(axis=0) + edge / 2
    under = ((below.positions > low) & (below.positions < high))[:, [0, 2]].all(axis=1)
    if not under.any():
        raise SceneError("No part of the robot is below an object on its back. Give a smaller object_shift.")
    top = float(below.positions[under, 1].max()) + edge / 2
    down = replace(body, positions=body.positions + np.array([0.0, top + gap - low[1], 0.0]))
    _check_place(down, scene)
    return down
