"""Energy and momentum of all matter in a solver."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.kernels.elastic import SMALLEST_J
from zoobench.sim.model.ground_skin import heights_above
from zoobench.sim.model.scene import has_skin
from zoobench.sim.solver import Solver


@dataclass(frozen=True)
class EnergyBalance:
    """Energy, momentum and extent of one world at one moment.

    Attributes:
        kinetic: of the particles and their affine motion, m (v^2 + M |C|^2) / 2 with the spline's moment M [J].
        elastic: of all matter, without the active stress of muscles [J].
        potential: of gravity, zero at the arena's lower corner [J].
        skin: of the compliant layer of firm ground [J].
        momentum: [kg m/s], `[3]`.
        smallest_j: smallest volume ratio: det F of the robot, elastic volume ratio of a medium.
        lowest, highest: corners of the bounding box of all matter [m], `[3]`.
        speed: largest speed of a particle [m/s].
    """

    kinetic: float
    elastic: float
    potential: float
    skin: float
    momentum: Array
    smallest_j: float
    lowest: Array
    highest: Array
    speed: float

    @property
    def total(self) -> float:
        """All energy [J]."""
        return self.kinetic + self.elastic + self.potential + self.skin


def to_array(tensor: Any) -> Array:
    """A tensor as an array in double precision."""
    return np.asarray(tensor.detach().cpu().double().numpy())


def unpacked(six: Array) -> Array:
    """Symmetric matrices `[n, 3, 3]` from their components xx yy zz xy xz yz `[n, 6]`."""
    return six[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]


def energy_balance(solver: Solver, *, step: float = 0.0) -> EnergyBalance:
    """The energy balance of the present state (slot 0) of the first world.

    Args:
        step: of the integrator [s], by half of which velocities lag behind places (see `nodal_power`); 0 for the
            plain sum.
    """
    matter, parameters = solver.matter, solver.parameters
    mass = to_array(parameters.mass[0])
    x, v, C = (to_array(tensor[0, 0]) for tensor in (matter.x, matter.v, matter.C))
    place = x + solver.simulation.origins[0]
    elastic, smallest_j = _elastic(solver)
    affine = solver.fidelity.moment * np.square(C).sum((1, 2))
    gravity = np.array(solver.scene.gravity)
    return EnergyBalance(
        kinetic=0.5 * float(mass @ (np.square(v).sum(1) + affine))
        + (0.5 * step * nodal_power(solver) if step else 0.0),
        elastic=elastic,
        potential=-float(mass @ ((place - np.array(solver.scene.lower)) @ gravity)),
        skin=_skin_energy(solver, place),
        momentum=mass @ v,
        smallest_j=smallest_j,
        lowest=place.min(0),
        highest=place.max(0),
        speed=float(np.linalg.norm(v, axis=1).max()),
    )


def nodal_power(solver: Solver) -> float:
    """Power [W] of internal forces and gravity on the first world's nodes.

    A symplectic Euler step moves matter with the new velocity, which is that in the middle of the step, as in leapfrog.
    The sum of elastic energy now and kinetic energy half a step ago oscillates by half a step times this power, to
    first order, and would read as a gain of some per cent where matter is hardest compressed (Hairer, Lubich and
    Wanner 2006, sec. IX.3, the modified energy).
    """
    before, after = (to_array(solver.launcher.momenta(solver.matter, solver.parameters, dt)) for dt in (0.0, 1.0))
    force = after[..., :3] - before[..., :3] + before[..., 3:] * np.array(solver.scene.gravity)
    return float((before[..., :3] / np.maximum(before[..., 3:], np.finfo(float).tiny) * force).sum())


def _skin_energy(solver: Solver, place: Array) -> float:
    """Energy [J] of the ground's skin, by the places `[particle_count, 3]` of all particles [m]."""
    ground, count = solver.scene.ground, solver.simulation.elastic_count
    if ground is None or not has_skin(solver.scene):
        return 0.0
    gap, _ = heights_above(place[:count], ground.terrain)
    density = ground.skin.energy(gap, solver.scene.robot_edge(solver.fidelity))
    return float(to_array(solver.parameters.volume[0])[:count] @ density)


def _elastic(solver: Solver) -> tuple[float, float]:
    """Elastic energy [J] of all bodies and the medium, and the smallest volume ratio."""
    bodies, count = solver.scene.elastic_bodies, solver.simulation.elastic_count
    volume = to_array(solver.parameters.volume[0])
    F = to_array(solver.matter.F[0, 0])
    J = np.linalg.det(F)
    mu, lam = np.concatenate([np.tile(body.material.lame, (body.particle_count, 1)) for body in bodies]).T
    # where the stress clamps log J, its energy is linear in log J
    log_j = np.log(np.maximum(J, np.finfo(float).tiny))
    clamped = np.maximum(log_j, np.log(SMALLEST_J))
    density = 0.5 * mu * (np.square(F).sum((1, 2)) - 3.0) - mu * log_j + lam * clamped * (log_j - 0.5 * clamped)
    energy = float((volume[:count] * to_array(solver.parameters.stiffness[0])) @ density)
    smallest = float(J.min())
    medium = solver.scene.medium
    if medium is not None:
        strain, history = medium_strain(solver)
        energy += float(volume[count:] @ medium.material.energy(strain, history))
        smallest = min(smallest, float(np.exp(strain.sum(1)).min()))
    return energy, smallest


def medium_strain(solver: Solver) -> tuple[Array, Array]:
    """Principal elastic Hencky strains `[medium, 3]`, of water (log J, 0, 0), and the law's history `[medium]`.

    Of the first world.
    """
    medium = solver.scene.medium
    assert medium is not None
    history = to_array(solver.matter.history[0, 0])
    if medium.material.is_liquid:
        strain = np.zeros((len(history), 3))
        strain[:, 0] = np.log(np.maximum(history, np.finfo(float).tiny))
        return strain, history
    squares = np.linalg.eigvalsh(unpacked(to_array(solver.matter.b[0, 0])))
    return 0.5 * np.log(np.maximum(squares, np.finfo(float).tiny)), history
