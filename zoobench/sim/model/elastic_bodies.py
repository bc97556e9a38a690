"""Elastic bodies as plain data: particles as designs make them, and robots and objects in a scene."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.sim.model.laws.elastic import ElasticMaterial

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Lower and upper corner [m]."""


def within(boxes: Sequence[Box], points: Array) -> Mask:
    """Which of some points `[n, 3]` [m] are in any of some boxes `[n]`; none is where there are no boxes."""
    found: Mask = np.zeros(len(points), bool)
    for low, high in boxes:
        found |= np.all((points >= low) & (points <= high), axis=1)
    return found


@dataclass(frozen=True)
class BodyParticles:
    """Particles of a body at rest, as designs make them and the simulator takes them.

    Attributes:
        positions: `[particle_count, 3]` [m].
        volumes: `[particle_count]` rest volume that each particle stands for [m^3].
        stiffness: `[particle_count]` multiplier of Young's modulus [-].
        density_ratio: `[particle_count]` multiplier of the density [-].
        occupancy: `[particle_count]` in [0, 1]; scales mass and volume together, 0 is empty space.
        muscle_membership: `[particle_count, muscle_count]` share of each muscle [-].
        fibres: `[particle_count, 3]` unit directions of contraction.
    """

    positions: Array
    volumes: Array
    stiffness: Array
    density_ratio: Array
    occupancy: Array
    muscle_membership: Array
    fibres: Array

    @property
    def particle_count(self) -> int:
        """Number of particles, empty ones included."""
        return len(self.positions)

    @property
    def muscle_count(self) -> int:
        """Number of muscles; 0 for passive matter."""
        return int(self.muscle_membership.shape[1])


def uniform_arrays(count: int) -> dict[str, Any]:
    """Stiffness, density ratio, occupancy and fibres of `count` full particles of muscle with fibres ahead."""
    ones = np.ones(count)
    return {
        "stiffness": ones,
        "density_ratio": ones,
        "occupancy": ones,
        "fibres": np.tile([1.0, 0.0, 0.0], (count, 1)),
    }


@dataclass(frozen=True)
class Drive:
    """A rigid part of a robot that moves as its last three channels say, along x, y and z, whatever acts on it.

    Attributes:
        particles: `[particle_count]` which they are.
        speed: at full activity [m/s].
    """

    particles: Mask
    speed: float


@dataclass(frozen=True)
class ElasticBody(BodyParticles):
    """Matter that keeps its shape, in a scene: a robot or a block.

    Attributes:
        material: the constitutive law's constants.
        velocities: `[particle_count, 3]` initial velocity [m/s].
        velocity_gradients: `[particle_count, 3, 3]` initial APIC matrix C [1/s]; None for zero.
        edge: of the cubes that the particles stand for [m]; None for that of the fidelity.
        site_offsets: `[particle_count, 3]` of the centres of those cubes from the positions [m], where a body fills
            some in part; None for none.
        anchor: boxes in which it is held at rest; none where it is free.
        drive: of a robot with a base that moves; None for none.
    """

    material: ElasticMaterial
    velocities: Array
    velocity_gradients: Array | None = None
    edge: float | None = None
    site_offsets: Array | None = None
    anchor: tuple[Box, ...] = ()
    drive: Drive | None = None

    @property
    def sites(self) -> Array:
        """Centres of the cubes that the particles stand for `[particle_count, 3]` [m]."""
        return self.positions if self.site_offsets is None else self.positions + self.site_offsets

    @property
    def masses(self) -> Array:
        """Masses of the particles `[particle_count]` [kg]."""
        found: Array = self.material.density * self.density_ratio * self.occupancy * self.volumes
        return found

    @classmethod
    def placed(
        cls, material: ElasticMaterial, particles: BodyParticles, positions: Array, edge: float | None = None
    ) -> "ElasticBody":
        """These particles at rest at other positions `[particle_count, 3]` [m]."""
        arrays = {item.name: getattr(particles, item.name) for item in fields(BodyParticles)}
        arrays["positions"] = positions
        return cls(material=material, velocities=np.zeros_like(positions), edge=edge, **arrays)

    @classmethod
    def passive(cls, material: ElasticMaterial, positions: Array, volumes: Array) -> "ElasticBody":
        """A body at rest without muscles, all of one kind: the block of the validation cases."""
        membership, arrays = np.zeros((len(positions), 0)), uniform_arrays(len(positions))
        return cls.placed(
            material, BodyParticles(positions, volumes, muscle_membership=membership, **arrays), positions
        )


@dataclass(frozen=True)
class SceneObject:
    """An elastic body besides the robot, in another velocity field.

    Attributes:
        name: by which it is known, not `robot` or `medium`.
        body: its matter and motion at time zero, without muscles.
        friction: Coulomb coefficient between it and other bodies [-]; between two objects the smaller one holds.
        ground_friction: the same between it and the ground [-].
        shares: whether its velocity field is that of the object before it, to which it sticks where they meet; else it
            has one of its own.
    """

    name: str
    body: ElasticBody
    friction: float = 0.5
    ground_friction: float = 0.5
    shares: bool = False

    def may_share(self, other: "SceneObject") -> bool:
        """Whether it may be in the velocity field of another: one has a single material, friction and size of cubes,
        and no anchor."""
        mine, its = (
            (each.body.material, each.body.edge, each.body.anchor, each.friction, each.ground_friction)
            for each in (self, other)
        )
        return mine == its and not self.body.anchor


def in_fields(things: Sequence[SceneObject], numbers: Sequence[int]) -> tuple[SceneObject, ...]:
    """The objects in velocity fields of these numbers, field by field as a scene has them, else in their order."""
    order = sorted(range(len(things)), key=numbers.__getitem__)
    shares = [numbers[one] == numbers[other] for one, other in pairwise(order)]
    return tuple(replace(things[place], shares=each) for place, each in zip(order, [False, *shares], strict=True))


_MOST = 32
"""Cubes of one body that may meet one of another: of two equal lattices they are 8."""

_TOUCH = 0.2
"""Depth to which cubes of bodies that touch may overlap, by their edge: a cube that is filled in part is known by the
middle of its matter."""


def overlap(one: ElasticBody, other: ElasticBody) -> bool:
    """Whether the matter of two bodies overlaps; bodies that touch do not."""
    from scipy.spatial import cKDTree

    (near, near_half, edge), (there, half, other_edge) = _cubes(one), _cubes(other)
    own = ((near > there.min(axis=0) - other_edge) & (near < there.max(axis=0) + other_edge)).all(axis=1)
    if not own.any():
        return False
    near, near_half, reach = near[own], near_half[own], (edge + other_edge) / 2
    apart, which = cKDTree(there).query(near, k=_MOST, p=np.inf, distance_upper_bound=reach)
    mine, place = np.nonzero(np.isfinite(apart))
    found = which[mine, place]
    depth = near_half[mine] + half[found] - np.abs(near[mine] - there[found])
    return bool((depth > _TOUCH * min(edge, other_edge)).all(axis=1).any())


def _cubes(body: ElasticBody) -> tuple[Array, Array, float]:
    """Middles and half edges of what a body fills of its particles' cubes, both `[n, 3]`, and the cubes' edge [m]."""
    edge = body.edge or float(np.cbrt(body.volumes.max()))
    own = body.occupancy > 0
    half = np.full_like(body.positions, edge / 2) - np.abs(body.sites - body.positions)
    return body.positions[own], half[own], edge


def joined(bodies: Sequence[ElasticBody]) -> ElasticBody:
    """Elastic bodies one after the other as one, with the material and the muscles of the first."""
    first, muscles = bodies[0], bodies[0].muscle_count
    counts = [body.particle_count for body in bodies]
    arrays: dict[str, Any] = {
        item.name: np.concatenate([getattr(body, item.name) for body in bodies])
        for item in fields(BodyParticles)
        if item.name not in ("muscle_membership", "density_ratio")
    }
    ratios = [body.density_ratio * (body.material.density / first.material.density) for body in bodies]
    membership = [first.muscle_membership, *(np.zeros((count, muscles)) for count in counts[1:])]
    gradients = [
        np.zeros((n, 3, 3)) if b.velocity_gradients is None else b.velocity_gradients
        for b, n in zip(bodies, counts, strict=True)
    ]
    return ElasticBody(
        material=first.material,
        anchor=first.anchor,
        velocities=np.concatenate([body.velocities for body in bodies]),
        velocity_gradients=np.concatenate(gradients),
        edge=first.edge,
        density_ratio=np.concatenate(ratios),
        muscle_membership=np.concatenate(membership),
        **arrays,
    )
