"""Bodies in water by forces on their surface, whose motion is given: the force of the water on them."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body, Drawing
from zoobench.designs.hull import hull_of
from zoobench.designs.sampling import Shape
from zoobench.sim.kernels.cell_lanes import FORCE
from zoobench.sim.kernels.layout import V, X
from zoobench.sim.kernels.panel_forces import ADDED, ADDED_SHEAR
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.rest_cells import RestCells
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.surface_water import SurfaceWater
from zoobench.sim.solver import Solver
from zoobench_verify.validate.rig import WEIGHTLESS, Vector

SPACINGS = (1 / 64, 1 / 96, 1 / 128)
"""Grids that every case is done on [m]."""

DENSITY = 1000.0
"""Of the water [kg/m^3]."""

_MIDDLE = 1.0
"""Place of the lower corner of a body along each axis [m]."""

_INSTANT = 1e-7
"""Length of a substep in which nothing moves [s]."""

_MATTER = ElasticMaterial(youngs_modulus=1e5, poissons_ratio=0.3, density=DENSITY)

Distance = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class TowedSolid:
    """A solid whose box begins at the origin.

    Attributes:
        distance: negative within, of points `[n, 3]` [m]; zero on the surface, elsewhere in proportion to the distance.
        size: of its box [m].
    """

    distance: Distance
    size: Vector


@cache
def _body(solid: TowedSolid, spacing: float) -> Body:
    """A solid in particles at a grid spacing [m], without muscles; kept, since its surface takes seconds."""
    shape = Shape.standing(lambda points: solid.distance(points) <= 0.0, *solid.size)
    sample = shape.sample(Fidelity(spacing, robot="lagrangian"))
    count = len(sample.positions)
    every = np.ones(count, bool)
    drawing = Drawing(solid.distance, np.array(shape.lower), np.array(shape.upper))
    return Body.of(sample, np.zeros((count, 0)), (), head=every, tail=every, drawing=drawing)


@cache
def ellipsoid(a: float, b: float, c: float) -> TowedSolid:
    """An ellipsoid with these half axes along x, y and z [m]."""
    axes, middle = np.array([a, b, c]), np.array([0.0, b, 0.0])

    def distance(points: Array) -> Array:
        found: Array = (np.linalg.norm((points - middle) / axes, axis=1) - 1.0) * axes.min()
        return found

    return TowedSolid(distance, (2 * a, 2 * b, 2 * c))


@cache
def plate(length: float, thick: float, width: float) -> TowedSolid:
    """A plate with these edges along x, y and z [m]."""
    half, middle = np.array([length, thick, width]) / 2, np.array([0.0, thick / 2, 0.0])

    def distance(points: Array) -> Array:
        beyond = np.abs(points - middle) - half
        found: Array = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
        return found

    return TowedSolid(distance, (length, thick, width))


def in_water(
    solid: TowedSolid, spacing: float, *, water: SurfaceWater | None = None, density: float = DENSITY,
    velocity: Vector = WEIGHTLESS, gravity: Vector = WEIGHTLESS, shift: float = 0.0, precision: int = 64,
) -> tuple[Scene, Fidelity]:  # fmt: skip
    """A scene of a solid in water, at a fidelity of this grid spacing [m].

    Args:
        density: of the solid [kg/m^3].
        velocity: of the solid at the start [m/s].
        shift: of its place along all axes [m].
    """
    fidelity = Fidelity(spacing, robot="lagrangian", precision=64 if precision == 64 else 32)
    body, place = _body(solid, spacing), np.full(3, _MIDDLE + shift)
    robot = replace(
        ElasticBody.placed(replace(_MATTER, density=density), body, body.positions + place, body.edge),
        site_offsets=body.sites - body.positions, velocities=np.tile(velocity, (len(body.positions), 1)),
    )  # fmt: skip
    wet = replace(water or SurfaceWater(density=DENSITY), hull=hull_of(body).moved(place))
    end = 2 * _MIDDLE
    return Scene(robot, (0.0, 0.0, 0.0), (end, end, end), gravity=gravity, surface_water=wet), fidelity


@dataclass(frozen=True)
class WaterForce:
    """What the water does to the nodes of a body whose motion is given.

    Attributes:
        force: but for the inertia of the water, and with internal forces, whose sum is zero `[nodes, 3]` [N].
        added: added mass `[nodes, 3, 3]` [kg].
    """

    force: Array
    added: Array

    def on_body(self, acceleration: Array | None = None) -> Array:
        """Force on the whole body `[3]` [N], by the nodes' acceleration `[nodes, 3]` [m/s^2]; None for none."""
        total: Array = self.force.sum(axis=0)
        if acceleration is not None:
            total = total - np.einsum("nab,nb->a", self.added, acceleration)
        return total


class Led:
    """A body in water whose motion is given.

    Attributes:
        places: of its nodes at rest `[nodes, 3]` [m].
    """

    def __init__(self, scene: Scene, fidelity: Fidelity) -> None:
        self.solver = Solver(scene, fidelity)
        self.solver.reset()
        self.places = RestCells.of(scene.robot, fidelity).places
        self._nodes = self.solver.matter.nodes[0, 0].numpy()

    def push(self, places: Array, velocities: Array) -> WaterForce:
        """The water's push on nodes at places [m] with velocities [m/s] `[nodes, 3]`."""
        self._nodes[:, X, :3], self._nodes[:, V, :3] = places - self.solver.origin, velocities
        self.solver.substeps(1, _INSTANT)
        rows = self._nodes.astype(float)
        xx, yy, zz = rows[:, ADDED, :3].T
        yz, xz, xy = rows[:, ADDED_SHEAR, :3].T
        added = np.moveaxis(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), -1, 0)
        return WaterForce(rows[:, FORCE, :3], added)

    def towed(self, velocity: Array) -> WaterForce:
        """The same as it moves as a whole [m/s]."""
        return self.push(self.places, np.broadcast_to(velocity, self.places.shape))


def drag_coefficient(force: float, speed: float, area: float) -> float:
    """That of a force [N] at a speed [m/s], by an area [m^2]."""
    return force / (0.5 * DENSITY * speed**2 * area)


def disc(radius: float) -> float:
    """Area of a disc [m^2]."""
    return math.pi * radius**2


def name_of(spacing: float) -> str:
    """A grid in words."""
    return f"1/{round(1 / spacing)} m"
