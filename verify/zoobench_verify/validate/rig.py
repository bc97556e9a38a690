"""A scene advanced substep by substep, with access to the state of its particles.

The solver has no body forces but gravity, no periodic sides and no clamps. A case that needs them writes to the
particles' state between substeps, which is exact: adding dt b to the velocities is the body force b of an explicit
scheme, and matter whose position is restored is clamped.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zoobench.arrays import Array
from zoobench.designs.sampling import SolidSample
from zoobench.sim.kernels.layout import V, X
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity, Robot
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.rest_cells import RestCells
from zoobench.sim.model.scene import MediumBed, Scene
from zoobench.sim.solver import Solver

Vector = tuple[float, float, float]
Reals = NDArray[np.floating]

NAMES: dict[Robot, str] = {"mpm": "MPM", "lagrangian": "rest frame"}
"""Names in figures of how the robot is simulated."""

WEIGHTLESS: Vector = (0.0, 0.0, 0.0)
GRAVITY = 9.81


class Rig:
    """One world of a scene with passive muscles, advanced by whole substeps.

    Args:
        seconds: simulated time of `steps` substeps [s]; a multiple of their length.
        courant: the step as a fraction of the largest safe one.
        settings: further choices of the fidelity, by their names there.

    Attributes:
        steps: substeps in `seconds`; `dt` is the length of each [s].
        done: substeps taken so far.
        mass: `[particle_count]` [kg].
        v, C: velocities `[particle_count, 3]` [m/s] and APIC matrices `[particle_count, 3, 3]` [1/s]; these arrays and
            the following ones are the state itself, which writing changes.
        F: deformation gradients of the elastic body `[robot, 3, 3]`.
        history, medium_stress: of the medium's law `[medium]`, and Kirchhoff stress of a solid medium `[medium, 6]`
            [Pa].
        robot, medium: the particles of either among all.
        places, velocities, masses: what moves, of which the first two are the state itself: the particles, but of a
            robot in its rest frame (`robot="lagrangian"`) the nodes it carries with it, from which its particles' own
            arrays follow in every substep. Places [m] are from the solver's origin.
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
        self.grid_spacing = grid_spacing
        matter = self.solver.matter
        self.mass: Reals = self.solver.parameters.mass[0].numpy()
        self.v, self.C, self.F, self.history, self.medium_stress = (
            tensor[0, 0].numpy() for tensor in (matter.v, matter.C, matter.F, matter.history, matter.tau)
        )
        self.robot = slice(0, self.solver.robot_count)
        self.medium = slice(self.solver.robot_count, self.solver.particle_count)
        self.places: Reals = matter.x[0, 0].numpy()
        self.velocities, self.masses = self.v, self.mass
        if fidelity.robot == "lagrangian":
            nodes = matter.nodes[0, 0].numpy()
            self.places, self.velocities = nodes[:, X, :3], nodes[:, V, :3]
            self.masses = RestCells.of(scene.robot, fidelity).on_nodes(self.mass.astype(np.float64))

    @property
    def positions(self) -> Array:
        """A copy of the positions `[particle_count, 3]` [m]."""
        return self.solver.positions(0)

    def place(self, index: slice | NDArray[np.intp], positions: Array) -> None:
        """Set positions [m] of particles, and find the grid nodes in use again."""
        self.solver.matter.x[0, 0].numpy()[index] = positions - self.solver.origin
        self.solver.simulation.refresh_window()

    def times(self, count: int, every: int = 1) -> Array:
        """Times `[count + 1]` [s] from 0 on, at intervals of `every` substeps."""
        return np.arange(count + 1, dtype=float) * (every * self.dt)

    def advance(self, count: int) -> None:
        """Take `count` substeps."""
        self.solver.substeps(count)
        self.done += count

    def equilibrate(self, rate: float, count: int) -> None:
        """Take `count` substeps under drag: all velocities decay with `rate` [1/s].

        Twice the angular frequency of a motion damps it critically.
        """
        for _ in range(count):
            self.advance(1)
            self.damp(rate)

    def damp(self, rate: float, index: slice = slice(None)) -> None:
        """Let velocities decay with `rate` [1/s] for the duration of a substep."""
        keep = math.exp(-rate * self.dt)
        self.velocities[index] *= keep
        if self.velocities is self.v:
            self.C[index] *= keep


def lattice(lower: Vector, upper: Vector, spacing: float | Vector) -> Array:
    """Centres `[particle_count, 3]` of the bricks of size `spacing` that fill a box, x slowest."""
    sizes = np.broadcast_to(spacing, 3)
    axes = []
    for low, high, size in zip(lower, upper, sizes, strict=True):
        count = round((high - low) / size)
        axes.append(low + (high - low) * (np.arange(count) + 0.5) / count)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def solid_body(material: ElasticMaterial, solid: SolidSample, shift: Array) -> ElasticBody:
    """A solid without muscles, moved by `shift` `[3]` [m], and the lattice of its cubes, of which it may fill parts."""
    body = ElasticBody.passive(material, solid.positions + shift, solid.volumes)
    return replace(body, site_offsets=solid.sites - solid.positions)


def passive_body(
    material: ElasticMaterial, positions: Array, volume: float, velocity: Array | None = None
) -> ElasticBody:
    """An elastic body without muscles, of particles with a volume of `volume` [m^3] each."""
    body = ElasticBody.passive(material, positions, np.full(len(positions), volume))
    return body if velocity is None else replace(body, velocities=np.broadcast_to(velocity, positions.shape).copy())


def dust(place: Vector, grid_spacing: float) -> ElasticBody:
    """The robot of a scene about a medium: a grain so light and soft that it has no effect on the medium."""
    material = ElasticMaterial(youngs_modulus=1e-3, poissons_ratio=0.0, density=1000.0)
    return passive_body(material, np.array([place]), 1e-9 * grid_spacing**3)


def bed(material: Medium, positions: Array, volumes: float | Array, strains: Array | None = None) -> MediumBed:
    """A medium of particles of these volumes [m^3], or of one for all, with principal Hencky strains along the axes."""
    return MediumBed.at_rest(material, positions, np.full(len(positions), volumes), strains)


def repeat(count: int, *arrays: Reals) -> None:
    """Let the first of `count` equal parts of every array be copied into the others: the images of a periodic piece."""
    for array in arrays:
        parts = array.reshape(count, -1, *array.shape[1:])  # of the first axis alone, so that it is a view
        parts[1:] = parts[0]


def order_of_accuracy(spacings: ArrayLike, errors: ArrayLike) -> float:
    """Observed order: the slope of log error over log spacing, by least squares."""
    return float(np.polyfit(np.log(spacings), np.log(np.abs(errors)), 1)[0])
