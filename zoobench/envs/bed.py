"""Beds of a medium, level or on a terrain, at rest under their own weight."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.fidelity import Fidelity, Transfer
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.water import SMALLEST_RATIO, WaterMaterial
from zoobench.sim.model.scene import MediumBed
from zoobench.sim.model.terrain import Terrain

BED_THICKNESS = 1 / 32
"""[m] Of a solid bed: two cells of `draft` and a whole number at every fidelity. Where a bed ends in half a cell, its
surface lies otherwise to the nodes, and gaits score a quarter less. Twice as thick, it changes scores by 3 %."""

_LEAST_ROOM = 0.02  # of a bed particle's volume: particles with less are left out


@dataclass(frozen=True)
class Bed:
    """A bed that covers the floor of the arena from wall to wall.

    Attributes:
        thickness: [m].
        robot_friction: Coulomb coefficient between it and the robot [-]; None where both share a velocity field.
        transfer: of its velocity between particles and grid; None for that of the fidelity.
    """

    material: Medium
    thickness: float
    robot_friction: float | None = None
    transfer: Transfer | None = None

    def check(self, gravity: float) -> None:
        """Refuse water that downward `gravity` [m/s^2] compresses beyond the validity of its law.

        Raises:
            UsageError: it is.
        """
        if not isinstance(self.material, WaterMaterial):
            return
        strain = self.material.density * gravity * self.thickness / self.material.bulk_modulus
        if np.exp(-strain) < SMALLEST_RATIO:
            raise UsageError(
                f"Water of {self.thickness:g} m with a bulk modulus of {self.material.bulk_modulus:g} Pa would be "
                f"compressed by {100 * strain:.0f} % at the bottom, and {100 * (1 - SMALLEST_RATIO):.0f} % are the "
                "most. Give a larger bulk_modulus, or less depth or gravity."
            )

    def fill(self, size: Array, gravity: float, fidelity: Fidelity, terrain: Terrain | None = None) -> MediumBed:
        """The bed at rest in an arena of this `size` [m] under downward `gravity` [m/s^2].

        On a terrain a solid bed has the same thickness everywhere, while water has a level surface.

        The lattice is stretched by a few percent so that whole particles fill the box exactly: the bed's mass is
        density times thickness times area at every fidelity, and there is no gap at the walls. Compressed water is
        denser: a particle of volume ratio J fills the place of an unstrained volume V / J. With equal masses the
        stratification would be unstable, and the tank would overturn at a rate of sqrt(g^2 rho / K), within seconds.

        Raises:
            SceneError: it is thinner than a cell, or the terrain is above the water everywhere.
        """
        if self.thickness < (1.0 - 1e-9) * fidelity.grid_spacing:
            raise SceneError(
                f"A bed of {self.thickness:g} m is thinner than a cell of {fidelity.grid_spacing:.4g} m. Give more, or "
                "a finer fidelity."
            )
        box = np.array([size[0], self.thickness, size[2]])
        rounded = np.maximum(np.round(box / fidelity.grid_spacing * 2) / 2, 0.5) * fidelity.grid_spacing
        lattice = fill_box(np.zeros(3), rounded, fidelity.grid_spacing, fidelity.particles_per_cell)
        spacing = np.array([np.diff(np.unique(np.round(axis, 12))).min(initial=np.inf) for axis in lattice.T])
        reach = lattice.max(axis=0) + np.where(np.isfinite(spacing), spacing / 2, lattice.max(axis=0))
        positions = lattice * (box / reach)
        room = np.full(len(positions), box.prod() / len(positions))
        if terrain is None:
            return self.at_rest(positions, room, gravity)
        if isinstance(self.material, WaterMaterial):
            return self.at_rest(*self._above(terrain, positions, room, fidelity), gravity)
        return lifted(self.at_rest(positions, room, gravity), terrain)

    def _above(self, terrain: Terrain, positions: Array, room: Array, fidelity: Fidelity) -> tuple[Array, Array]:
        """Places `[n, 3]` [m] and volumes `[n]` [m^3] of level water above a terrain, from those above a plane.

        Every column is compressed to its own depth; where that is less than half a particle, it is dry. Water begins
        at the highest node that the ground holds: over a gap of a part of a cell it would fall, and stream for long.
        """
        h = fidelity.grid_spacing
        # heights begin at 0, but a spline of theirs may be some micrometres lower
        ground = h * np.floor(np.maximum(terrain.heights_below(positions), 0.0) / h + 1e-4)
        wet = self.thickness - ground > fidelity.particle_edge / 2
        if not wet.any():
            raise SceneError(f"No ground lies below water of {self.thickness:g} m. Give deeper water or lower terrain.")
        share = 1.0 - ground / self.thickness
        places = np.stack([positions[:, 0], ground + share * positions[:, 1], positions[:, 2]], axis=1)
        return places[wet], (share * room)[wet]

    def at_rest(self, positions: Array, room: Array, gravity: float) -> MediumBed:
        """The bed's matter at rest at `positions` `[n, 3]` [m] in the volumes `room` `[n]` [m^3]."""
        load = self.material.density * gravity * (self.thickness - positions[:, 1])
        strains = self.material.rest_strains(load)
        if isinstance(self.material, WaterMaterial):
            room = room / np.exp(strains.sum(axis=1))
        bed = MediumBed.at_rest(self.material, positions, room, strains)
        return replace(bed, friction=self.robot_friction, transfer=self.transfer)


@dataclass(frozen=True, kw_only=True)
class SolidBed:
    """A bed of solid matter on rough ground.

    * `friction`: Coulomb coefficient of the ground under the bed [-].
    * `slip`: whether robot and bed have velocity fields of their own, and mud slides on the ground where its shear
      strength is exceeded; else the bed sticks to the robot, and `friction` alone holds mud on the ground.
    * `robot_friction`: Coulomb coefficient between robot and bed where they slip [-].
    * `thickness`: of the bed [m], a whole number of cells: where a bed ends within a cell, gaits go a quarter to a half
      less far.
    * `length`, `width`: of the part of the bed that is simulated at a time, along x and z, at least [m].
    """

    friction: float = 0.5
    slip: bool = True
    robot_friction: float = 0.5
    thickness: float = BED_THICKNESS
    length: float = 0.3125
    width: float = 0.3125

    def of(self, material: Medium) -> Bed:
        """The bed of this material."""
        return Bed(material, self.thickness, self.robot_friction if self.slip else None)


SOLID_BED = SolidBed()


def lifted(bed: MediumBed, terrain: Terrain) -> MediumBed:
    """The bed on a terrain: every column is raised by the height of the ground below it, with its volume unchanged."""
    rise = np.zeros_like(bed.positions)
    rise[:, 1] = terrain.heights_below(bed.positions)
    return replace(bed, positions=bed.positions + rise)


def without_overlap(bed: MediumBed, positions: Array, volumes: Array, fidelity: Fidelity) -> MediumBed:
    """The bed without the volume of a body in cubes about `positions` `[n, 3]` [m] that hold `volumes` `[n]` [m^3].

    Each takes its volume from the bed particles around it, shared out linearly by their distance along every axis, so
    that a body displaces its own volume, and there is neither overlap nor gap between two lattices. Bed particles
    without room are left out.
    """
    from scipy.spatial import KDTree

    edge = fidelity.particle_edge
    near = KDTree(bed.positions).query_ball_point(positions, edge, p=np.inf)
    taker = np.repeat(np.arange(len(positions)), [len(row) for row in near])
    giver = np.concatenate(near).astype(int) if len(taker) else taker
    shares = (1.0 - np.abs(bed.positions[giver] - positions[taker]) / edge).clip(0.0).prod(axis=1)
    taken = np.bincount(giver, shares * volumes[taker], bed.particle_count) / edge**3
    room = 1.0 - np.minimum(taken, 1.0)
    kept = room > _LEAST_ROOM
    arrays = _arrays(bed) | {"volumes": bed.volumes * room}
    return replace(bed, **{name: value[kept] for name, value in arrays.items()})


def sharing(bed: MediumBed, guests: MediumBed, hosts: NDArray[np.int64]) -> MediumBed:
    """The bed with `guests`, particles at the places of the robot's particles `hosts` `[n]`."""
    alone = np.full(bed.particle_count, -1)
    theirs = _arrays(guests)
    joined: dict[str, Any] = {name: np.concatenate([mine, theirs[name]]) for name, mine in _arrays(bed).items()}
    return replace(bed, **joined, hosts=np.concatenate([alone, hosts]))


def _arrays(bed: MediumBed) -> dict[str, Any]:
    """The arrays over particles by name."""
    values = {item.name: getattr(bed, item.name) for item in fields(bed)}
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
