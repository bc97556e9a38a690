"""A scene moved on by hand, substep by substep, with its particles within reach.

The solver has no body forces but gravity, no periodic sides and no clamps. A case that needs them writes into the
particles' state between substeps, which is exact: adding dt b to the velocities is the body force b of an explicit
scheme, and matter that is put back where it belongs is matter that is held there.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.matter import ElasticMaterial, Medium
from zoobench.sim.model.scene import ElasticBody, MediumBed, Scene
from zoobench.sim.solver import Solver

Vector = tuple[float, float, float]
Reals = NDArray[np.floating]

WEIGHTLESS: Vector = (0.0, 0.0, 0.0)
GRAVITY = 9.81


class Stage:
    """One world of a scene at rest of all muscles, moved on by whole substeps.

    Args:
        seconds: the time that `steps` substeps take [s]; their length divides it.
        courant: the step as a fraction of the largest safe one.
        settings: further choices of the fidelity, by their names there.

    Attributes:
        steps: substeps that make up `seconds`.
        done: substeps moved on so far.
    """

    def __init__(
        self,
        scene: Scene,
        grid_spacing: float,
        seconds: float,
        *,
        precision: int = 64,
        courant: float = 0.5,
        **settings: Any,
    ) -> None:
        fidelity = Fidelity(grid_spacing, courant=courant, precision=64 if precision == 64 else 32, **settings)
        self.solver = Solver(scene, fidelity, frame_seconds=seconds)
        self.solver.reset()
        self.steps, self.dt, self.done = self.solver.substeps_per_frame, self.solver.dt, 0
        self.scene, self.grid_spacing = scene, grid_spacing

    @property
    def robot(self) -> slice:
        """The elastic body's particles among all."""
        return slice(0, self.solver.robot_count)

    @property
    def medium(self) -> slice:
        """The medium's particles among all."""
        return slice(self.solver.robot_count, self.solver.particle_count)

    @property
    def mass(self) -> Reals:
        """`[particle_count]` [kg]."""
        return self.solver.parameters.mass[0].numpy()

    @property
    def positions(self) -> Array:
        """A copy of the positions `[particle_count, 3]` [m]."""
        found: Array = self.solver.matter.x[0, 0].numpy().astype(float) + self.solver.origin
        return found

    @property
    def v(self) -> Reals:
        """The velocities `[particle_count, 3]` [m/s] themselves: writing changes the state."""
        return self.solver.matter.v[0, 0].numpy()

    @property
    def C(self) -> Reals:
        """The APIC matrices `[particle_count, 3, 3]` [1/s] themselves."""
        return self.solver.matter.C[0, 0].numpy()

    @property
    def F(self) -> Reals:
        """The deformation gradients `[robot, 3, 3]` of the elastic body themselves."""
        return self.solver.matter.F[0, 0].numpy()

    @property
    def history(self) -> Reals:
        """What the medium's law remembers `[medium]`, itself."""
        return self.solver.matter.history[0, 0].numpy()

    @property
    def medium_stress(self) -> Reals:
        """Kirchhoff stress `[medium, 6]` of a solid medium [Pa], itself."""
        return self.solver.matter.tau[0, 0].numpy()

    def place(self, index: slice | NDArray[np.intp], positions: Array) -> None:
        """Put particles at positions [m]; `advance` then looks for the grid nodes in use anew."""
        self.solver.matter.x[0, 0].numpy()[index] = positions - self.solver.origin
        self.solver.simulation.refresh_window()

    def times(self, count: int, every: int = 1) -> Array:
        """The ends `[count + 1]` of each `every` substeps, from 0 on [s]."""
        found: Array = np.arange(count + 1, dtype=float) * (every * self.dt)
        return found

    def advance(self, count: int) -> None:
        """Move on by `count` substeps."""
        self.solver.substeps(count)
        self.done += count

    def equilibrate(self, rate: float, count: int, push: Vector = WEIGHTLESS) -> None:
        """`count` substeps under drag: all velocities decay with `rate` [1/s]; `push` [m/s^2] acts on top of gravity.

        Twice the angular frequency of a motion damps it critically.
        """
        keep = math.exp(-rate * self.dt)
        kick = self.dt * np.array(push)
        for _ in range(count):
            self.advance(1)
            self.v[:] = keep * self.v + kick
            self.C[:] *= keep
        self.v[:] -= kick


def lattice(lower: Vector, upper: Vector, spacing: float | Vector) -> Array:
    """Points `[particle_count, 3]` in the middle of the bricks of size `spacing` that fill a box, x slowest."""
    sizes = np.broadcast_to(spacing, 3)
    axes = []
    for low, high, size in zip(lower, upper, sizes, strict=True):
        count = round((high - low) / size)
        axes.append(low + (high - low) * (np.arange(count) + 0.5) / count)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def passive_body(
    material: ElasticMaterial, positions: Array, volume: float, velocity: Array | None = None
) -> ElasticBody:
    """An elastic body without muscles whose particles stand for `volume` [m^3] each."""
    body = ElasticBody.passive(material, positions, np.full(len(positions), volume))
    return body if velocity is None else replace(body, velocities=np.broadcast_to(velocity, positions.shape).copy())


def dust(place: Vector, grid_spacing: float) -> ElasticBody:
    """A scene has a robot in any case: here a grain so light and soft that the medium does not feel it."""
    material = ElasticMaterial(youngs_modulus=1e-3, poissons_ratio=0.0, density=1000.0)
    return passive_body(material, np.array([place]), 1e-9 * grid_spacing**3)


def bed(material: Medium, positions: Array, volume: float, strains: Array | None = None) -> MediumBed:
    """A medium whose particles stand for `volume` [m^3] each, with principal Hencky strains along the axes."""
    return MediumBed.at_rest(material, positions, np.full(len(positions), volume), strains)
