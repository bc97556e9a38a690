"""Impact: an elastic sphere on the rigid ground, against Hertz."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.sampling import Shape
from zoobench.sim.model.fidelity import Fidelity, Robot
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench_verify.cases import CaseRecorder, Shortfall, case
from zoobench_verify.validate.rig import NAMES, WEIGHTLESS, Rig, solid_body

_BALL = ElasticMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1000.0)
_RADIUS = 0.5
"""Radius of the sphere [m], a hundred times the thickness of any layer that a law of contact may have."""
_PACE = 0.03
"""Speed of impact over that of sound in a bar: slow enough for the contact to be quasi-static."""


def _is_inside(points: Array) -> Mask:
    inside: Mask = np.linalg.norm(points, axis=1) < _RADIUS
    return inside


class Hertz(NamedTuple):
    """An elastic sphere on a rigid plane, without gravity and losses (Hertz 1882).

    Attributes:
        duration: of the contact [s].
        force: the largest [N].
        depth: the largest indentation [m].
    """

    duration: float
    force: float
    depth: float

    @classmethod
    def of(cls, material: ElasticMaterial, radius: float, speed: float) -> "Hertz":
        """With F = k d^(3/2), k = 4/3 E* sqrt(R): k d^(5/2) / 2.5 = m v^2 / 2 at most, and 2.9432 d / v long."""
        modulus = material.youngs_modulus / (1 - material.poissons_ratio**2)
        mass = material.density * 4 / 3 * math.pi * radius**3
        k = 4 / 3 * modulus * math.sqrt(radius)
        depth = (1.25 * mass * speed**2 / k) ** 0.4
        return cls(2.9432 * depth / speed, k * depth**1.5, depth)


class Impact(NamedTuple):
    """The impact of a sphere as it was simulated.

    Attributes:
        t, force: times [s] since the first touch, and the ground's force `[count]` [N].
        duration: from the first to the last tenth of the largest force, in the proportion that Hertz's pulse has [s].
        restitution: speed after over speed before.
        gap: height of the lowest point of the undeformed sphere at the first touch [m].
    """

    t: Array
    force: Array
    duration: float
    restitution: float
    gap: float


def sphere_impact(cells: int, robot: Robot = "mpm") -> Impact:
    """A sphere of `cells` to the radius falls onto the ground at the speed `_PACE`, without gravity or friction."""
    h = _RADIUS / cells
    speed = _PACE * math.sqrt(_BALL.youngs_modulus / _BALL.density)
    exact = Hertz.of(_BALL, _RADIUS, speed)
    above, middle = 1.6 * h, (cells + 3) * h
    ball = Shape(_is_inside, (-_RADIUS,) * 3, (_RADIUS,) * 3).sample(Fidelity(h))
    body = solid_body(_BALL, ball, np.array([middle, _RADIUS + above, middle]))
    body = replace(body, velocities=np.tile((0.0, -speed, 0.0), (body.particle_count, 1)))
    scene = Scene(body, (0, 0, 0), (2 * middle, 2 * middle, 2 * middle), ground=Ground(0.0), gravity=WEIGHTLESS)
    rig = Rig(scene, h, 1.6 * exact.duration + above / speed, robot=robot)
    speeds, heights = rig.velocities[:, 1], rig.places[:, 1]
    motion = [(rig.masses @ speeds, rig.masses @ heights)]
    for _ in range(rig.steps):
        rig.advance(1)
        motion.append((rig.masses @ speeds, rig.masses @ heights))
    path, centre = np.array(motion).T
    fallen = (centre[0] - centre[1:]) / rig.masses.sum(dtype=float)
    force = np.diff(path) / rig.dt
    pressed = np.flatnonzero(force > 0.1 * force.max())
    first = int(np.flatnonzero(force > 1e-3 * force.max())[0])
    # F = F_max sin(pi t / T)^(3/2), nearly: a tenth of the largest force 0.0689 T after the beginning
    duration = (pressed[-1] - pressed[0] + 1) * rig.dt / (1 - 2 * math.asin(0.1 ** (2 / 3)) / math.pi)
    t = rig.times(rig.steps)[1:]
    return Impact(t - t[first], force, float(duration), -path[-1] / path[0], float(above - fallen[first]))


_REACH = 1.25
"""Height above the ground at which it is first felt [cells]: of contact at the nodes of the grid. A law of contact with
a thickness of its own has a reach of its own; nothing else here depends on it."""

_STIFF = "the dent is less than a cell deep, and a grid resists dents that it cannot resolve"
_KNOWN = {
    8: {"duration": Shortfall(_STIFF, 0.8), "force": Shortfall(_STIFF, 1.2)},
    4: {"duration": Shortfall(_STIFF, 0.7), "force": Shortfall(_STIFF, 1.6), "bounce": Shortfall(_STIFF, 0.88)},
}
"""By the sphere's radius in cells."""


@case(
    "sphere-impact", "Hertz 1882; Johnson 1985, Contact mechanics, 11.4", "radius of 8 cells, and of 4", is_fast=False
)
def impact(record: CaseRecorder) -> None:
    """Duration, largest force and restitution of the impact of an elastic sphere, whose dent is a tenth of its radius.

    It loses nothing but the energy of its oscillations, less than a hundredth at this speed.
    """
    check_impacts(record, _KNOWN)


def check_impacts(
    record: CaseRecorder, shortfalls: Mapping[int, Mapping[str, Shortfall]], robot: Robot = "mpm"
) -> None:
    """Check impacts of spheres with radii of 8 and 4 cells; what falls short is by the radius in cells."""
    exact = Hertz.of(_BALL, _RADIUS, _PACE * math.sqrt(_BALL.youngs_modulus / _BALL.density))
    figure = record.plot("Impact of an elastic sphere", "time since the first touch [s]", "force of the ground [N]")
    for cells in (8, 4):
        known = shortfalls.get(cells, {})
        found = sphere_impact(cells, robot)
        where = f"of Hertz's, radius of {cells} cells"
        record.within(f"duration {where}", found.duration / exact.duration, 0.98, 1.1, shortfall=known.get("duration"))
        record.within(
            f"largest force {where}", found.force.max() / exact.force, 0.9, 1.02, shortfall=known.get("force")
        )
        record.within(
            f"coefficient of restitution, radius of {cells} cells", found.restitution, 0.95, 1.0,
            shortfall=known.get("bounce"),
        )  # fmt: skip
        record.within(
            f"height of the first touch, radius of {cells} cells", found.gap * cells / _RADIUS, 0.0, _REACH, "cells"
        )
        figure.computed(f"{NAMES[robot]}, radius of {cells} cells", found.t, found.force)
    t = np.linspace(0, exact.duration, 101)
    figure.reference("Hertz, nearly", t, exact.force * np.sin(np.pi * t / exact.duration) ** 1.5)
