"""Obstacles of firm ground: ceilings, slots, hurdles, posts, pegs and shafts, which stop a robot with friction, and a
soft bridge to walk over.

An obstacle is a body whose nodes are held at rest (`kernels/anchors.py`), in a velocity field of its own: it meets the
robot and the objects as they meet each other. Of a bridge only both ends are held.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.sampling import Shape, SolidSample
from zoobench.envs.objects import passive_solid
from zoobench.envs.ranges import check_ranges
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.elastic_bodies import Box, ElasticBody, SceneObject, within
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene

ObstacleKind = Literal["none", "ceiling", "slot", "hurdle", "post", "pegs", "shaft", "bridge"]

OBSTACLE = "obstacle"
"""Name of the body of an obstacle."""

_HEAVY = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=1e6)
"""A thousand times as dense as robots, so that a collision takes nothing of its rest within a substep."""

_THICK = 1 / 32
"""[m] Of ceilings and walls: a cell of the coarsest fidelity."""

_ASIDE = 0.1
"""[m] From the middle of the way to the ends of ceilings, hurdles and walls."""

_BESIDE = 0.035
"""[m] From the middle of the way to pegs: robots are 5 to 6 cm wide."""

_HIGH = 0.12
"""[m] Of walls beside a slot, and of a post."""

_AS_THICK = ("hurdle", "post", "pegs")
"""Obstacles whose opening is a side of theirs."""

_FAR = 1e3
"""[m] Beyond every node."""

_SOFT = ElasticMaterial(youngs_modulus=4e4, poissons_ratio=0.2, density=500.0, viscosity=20.0)
"""Of a bridge."""

_BANK = 0.125
"""[m] Of a bridge's end beyond its span, a robot's length and more."""

_APART = 0.25
"""[cells] Between a bridge and the robot: at this distance bodies carry each other."""


@dataclass(frozen=True, kw_only=True)
class Obstacles:
    """An obstacle on the robot's way, which never moves, but for a bridge, which gives way.

    * `obstacle`: `ceiling` over the way, `slot` between two walls, `hurdle` across the way, `post` in its middle, two
      `pegs` beside it that can carry a beam, a `shaft` of two walls left and right of the robot, to climb, or a soft
      `bridge` that hangs between two banks, on the first of which the robot stands; `none` for none.
    * `obstacle_distance`: from the robot to it; of the walls of a shaft, from the robot's sides; of a bridge, to where
      it hangs freely, up to a cell more [m].
    * `obstacle_opening`: height below a ceiling or a bridge, width of a slot or a post, height of a hurdle or of pegs
      [m].
    * `obstacle_length`: along the way; of a shaft, its height; of a bridge, its span [m].
    * `obstacle_friction`: Coulomb coefficient between it and the robot or an object [-].
    * `obstacle_stiffness`: Young's modulus of a bridge [Pa].
    """

    obstacle: ObstacleKind = "none"
    obstacle_distance: float = 0.03
    obstacle_opening: float = 0.05
    obstacle_length: float = 0.0625
    obstacle_friction: float = 0.5
    obstacle_stiffness: float = _SOFT.youngs_modulus

    def __post_init__(self) -> None:
        check_ranges(
            self,
            positive=("obstacle_opening", "obstacle_length", "obstacle_stiffness"),
            not_negative=("obstacle_distance", "obstacle_friction"),
        )
        if self.obstacle not in ("none", "bridge") and self.obstacle_stiffness != _SOFT.youngs_modulus:
            raise UsageError(
                f"obstacle_stiffness={self.obstacle_stiffness:g} has no effect on a {self.obstacle}, all of which is "
                "held. Leave it out, or choose obstacle=bridge."
            )

    def __bool__(self) -> bool:
        return self.obstacle != "none"

    @property
    def reach(self) -> float:
        """How much longer than usual the arena is ahead of the robot [m]."""
        return self.obstacle_distance + self.obstacle_length + _BANK if self.obstacle == "bridge" else 0.0

    def placed(self, scene: Scene, fidelity: Fidelity) -> Scene:
        """The scene with the obstacle behind its objects, and the robot on it if it is a bridge.

        Raises:
            SceneError: it stands on ground that is not level, is too thin for the grid, or leaves the arena; or it is a
                bridge, and there are objects or the robot is held.
        """
        if scene.ground is None or scene.ground.terrain is not None:
            raise SceneError("An obstacle stands on level ground. Leave out hills, slope, steps and gaps, or it.")
        is_bridge, h, edge = self.obstacle == "bridge", fidelity.grid_spacing, fidelity.particle_edge
        robot = self._on_bridge(scene, fidelity) if is_bridge else scene.robot
        low, high = robot.positions.min(axis=0) - edge / 2, robot.positions.max(axis=0) + edge / 2
        near = float(high[0]) + self.obstacle_distance
        if is_bridge:  # nodes hold it: its span is as long as asked for at every fidelity
            near = h * math.ceil(near / h)
        boxes = self._boxes(low, high, near)
        corners = np.array(boxes)
        self._check_thick(min(self.obstacle_length, float((corners[:, 1] - corners[:, 0]).min())), h)
        first, last = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
        self._check_inside(first, np.maximum(last, robot.positions.max(axis=0)), scene)
        sample = Shape(partial(within, boxes), tuple(first), tuple(last)).sample(fidelity)
        thing = SceneObject(OBSTACLE, self._body(sample, near), self.obstacle_friction, 0.0)
        return replace(scene, robot=robot, objects=(*scene.objects, thing))

    def _on_bridge(self, scene: Scene, fidelity: Fidelity) -> ElasticBody:
        """The robot as high as a bridge; errors as of `placed`."""
        robot = scene.robot
        if scene.objects or robot.anchor or robot.drive:
            raise SceneError(
                "A bridge is for a robot that is free, without objects. Leave out the object, choose a design that is "
                "not held at its base, or another obstacle."
            )
        surface = self.obstacle_opening + _THICK + _APART * fidelity.grid_spacing
        up = surface - (float(robot.sites[:, 1].min()) - fidelity.particle_edge / 2)
        return replace(robot, positions=robot.positions + np.array([0.0, up, 0.0]))

    def _body(self, sample: SolidSample, near: float) -> ElasticBody:
        """Its matter; a bridge hangs freely from `near` [m] on."""
        material, held = _HEAVY, [(-_FAR, _FAR)]
        if self.obstacle == "bridge":
            material = replace(_SOFT, youngs_modulus=self.obstacle_stiffness)
            held = [(-_FAR, near), (near + self.obstacle_length, _FAR)]
        anchor = tuple(((start, -_FAR, -_FAR), (end, _FAR, _FAR)) for start, end in held)
        return replace(passive_solid(material, sample), anchor=anchor)

    def _check_inside(self, first: Array, last: Array, scene: Scene) -> None:
        """Refuse what is beyond the arena, from `first` to `last` `[3]` [m], with the robot on a bridge."""
        if (first < scene.lower).any() or (last > scene.upper).any():
            reach = ", ".join(f"{a:.3g} to {b:.3g}" for a, b in zip(first, last, strict=True))
            raise SceneError(
                f"The {self.obstacle} with an obstacle_distance of {self.obstacle_distance:g}, an obstacle_opening of "
                f"{self.obstacle_opening:g} and an obstacle_length of {self.obstacle_length:g} m is at {reach} m along "
                f"x, y and z, beyond the arena, which ends at {scene.upper} m. Give smaller ones."
            )

    def _check_thick(self, thinnest: float, grid_spacing: float) -> None:
        """Refuse boxes of which the thinnest [m] is thinner than a cell, by the parameter that makes it so."""
        least = (1.0 - 1e-9) * grid_spacing
        if thinnest >= least:
            return
        told = f"is {thinnest:.3g} m thin, less than a cell of {grid_spacing:.4g} m. Give"
        walls = _ASIDE - self.obstacle_opening / 2
        if self.obstacle == "slot" and walls < least:
            told = (
                f"leaves {max(walls, 0.0):.3g} m for a wall at either side, less than a cell of {grid_spacing:.4g} m. "
                f"Give an obstacle_opening of {2 * (_ASIDE - grid_spacing):.3g} m or less, or"
            )
        elif self.obstacle_length < least:
            told = f"{told} an obstacle_length of {grid_spacing:.4g} m or more, or"
        elif self.obstacle in _AS_THICK and self.obstacle_opening < least:
            told = f"{told} an obstacle_opening of {grid_spacing:.4g} m or more, or"
        raise SceneError(
            f"A {self.obstacle} with an obstacle_opening of {self.obstacle_opening:g} and an obstacle_length of "
            f"{self.obstacle_length:g} m {told} a finer fidelity."
        )

    def _boxes(self, low: Array, high: Array, near: float) -> list[Box]:
        """Its boxes, for a robot within the box `low` to `high` `[3]` [m]; those ahead of it begin at `near` [m]."""
        opening, length, middle = self.obstacle_opening, self.obstacle_length, float(low[2] + high[2]) / 2
        far, left, right = near + length, middle - _ASIDE, middle + _ASIDE
        if self.obstacle == "ceiling":
            return [((near, opening, left), (far, opening + _THICK, right))]
        if self.obstacle == "slot":
            half = opening / 2
            return [((near, 0.0, left), (far, _HIGH, middle - half)), ((near, 0.0, middle + half), (far, _HIGH, right))]
        if self.obstacle == "hurdle":
            return [((near, 0.0, left), (far, opening, right))]
        if self.obstacle == "pegs":
            inner, outer = _BESIDE, _BESIDE + _THICK
            return [
                ((near, 0.0, middle - outer), (far, opening, middle - inner)),
                ((near, 0.0, middle + inner), (far, opening, middle + outer)),
            ]
        if self.obstacle == "post":
            return [((near, 0.0, middle - opening / 2), (far, _HIGH, middle + opening / 2))]
        if self.obstacle == "bridge":
            back, half = float(low[0]) - _THICK, _ASIDE / 2
            return [((back, opening, middle - half), (far + _BANK, opening + _THICK, middle + half))]
        back, front = float(low[0]) - _THICK, float(high[0]) + _THICK
        walls = float(low[2]) - self.obstacle_distance, float(high[2]) + self.obstacle_distance
        return [
            ((back, 0.0, walls[0] - _THICK), (front, length, walls[0])),
            ((back, 0.0, walls[1]), (front, length, walls[1] + _THICK)),
        ]


NO_OBSTACLES = Obstacles()
