"""Obstacles of firm ground: ceilings, slots, hurdles, posts, pegs and shafts, which stop a robot with friction.

An obstacle is a body whose nodes are held at rest (`kernels/anchors.py`), in a velocity field of its own: it meets the
robot and the objects as they meet each other.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.sampling import Shape
from zoobench.envs.objects import passive_solid
from zoobench.envs.ranges import check_ranges
from zoobench.errors import SceneError
from zoobench.sim.model.elastic_bodies import SceneObject
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Scene

ObstacleKind = Literal["none", "ceiling", "slot", "hurdle", "post", "pegs", "shaft"]

Box = tuple[tuple[float, float, float], tuple[float, float, float]]

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

_EVERYWHERE = ((-1e3, -1e3, -1e3), (1e3, 1e3, 1e3))
"""Corners of a box that holds all nodes [m]."""


@dataclass(frozen=True, kw_only=True)
class Obstacles:
    """An obstacle on the robot's way, which never moves.

    * `obstacle`: `ceiling` over the way, `slot` between two walls, `hurdle` across the way, `post` in its middle, two
      `pegs` beside it that can carry a beam, or a `shaft` of two walls left and right of the robot, to climb; `none`
      for none.
    * `obstacle_distance`: from the robot to it; of the walls of a shaft, from the robot's sides [m].
    * `obstacle_opening`: height below a ceiling, width of a slot or a post, height of a hurdle or of pegs [m].
    * `obstacle_length`: along the way; of a shaft, its height [m].
    * `obstacle_friction`: Coulomb coefficient between it and the robot or an object [-].
    """

    obstacle: ObstacleKind = "none"
    obstacle_distance: float = 0.03
    obstacle_opening: float = 0.05
    obstacle_length: float = 0.0625
    obstacle_friction: float = 0.5

    def __post_init__(self) -> None:
        check_ranges(
            self,
            positive=("obstacle_opening", "obstacle_length"),
            not_negative=("obstacle_distance", "obstacle_friction"),
        )

    def __bool__(self) -> bool:
        return self.obstacle != "none"

    def placed(self, scene: Scene, fidelity: Fidelity) -> Scene:
        """The scene with the obstacle behind its objects.

        Raises:
            SceneError: it stands on ground that is not level, is too thin for the grid, or leaves the arena.
        """
        if scene.ground is None or scene.ground.terrain is not None:
            raise SceneError("An obstacle stands on level ground. Leave out hills, slope, steps and gaps, or it.")
        robot, edge = scene.robot.positions, fidelity.particle_edge
        low, high = robot.min(axis=0) - edge / 2, robot.max(axis=0) + edge / 2
        corners = np.array(self._boxes(low, high))
        self._check_thick(float((corners[:, 1] - corners[:, 0]).min()), fidelity.grid_spacing)
        first, last = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
        if (first < scene.lower).any() or (last > scene.upper).any():
            reach = ", ".join(f"{a:.3g} to {b:.3g}" for a, b in zip(first, last, strict=True))
            raise SceneError(
                f"A {self.obstacle} with an obstacle_distance of {self.obstacle_distance:g}, an obstacle_opening of "
                f"{self.obstacle_opening:g} and an obstacle_length of {self.obstacle_length:g} m is at {reach} m along "
                f"x, y and z, beyond the arena, which ends at {scene.upper} m. Give smaller ones."
            )
        sample = Shape(_within(corners), tuple(first), tuple(last)).sample(fidelity)
        body = replace(passive_solid(_HEAVY, sample), anchor=(_EVERYWHERE,))
        thing = SceneObject(OBSTACLE, body, self.obstacle_friction, 0.0)
        return replace(scene, objects=(*scene.objects, thing))

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

    def _boxes(self, low: Array, high: Array) -> list[Box]:
        """Its boxes by lower and upper corner [m], for a robot within the box `low` to `high` `[3]` [m]."""
        opening, length, middle = self.obstacle_opening, self.obstacle_length, float(low[2] + high[2]) / 2
        near = float(high[0]) + self.obstacle_distance
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
        back, front = float(low[0]) - _THICK, float(high[0]) + _THICK
        walls = float(low[2]) - self.obstacle_distance, float(high[2]) + self.obstacle_distance
        return [
            ((back, 0.0, walls[0] - _THICK), (front, length, walls[0])),
            ((back, 0.0, walls[1]), (front, length, walls[1] + _THICK)),
        ]


NO_OBSTACLES = Obstacles()


def _within(corners: Array) -> Callable[[Array], Mask | Array]:
    """Whether points `[n, 3]` [m] are in any of some boxes `[box_count, 2, 3]` [m]."""
    return lambda x: np.any([np.all((x >= low) & (x <= high), axis=-1) for low, high in corners], axis=0)
