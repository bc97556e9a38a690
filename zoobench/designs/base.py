"""What a design is: a body at rest, as particles with everything that the physics and the tasks ask for."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box

Mask = NDArray[np.bool_]

# Cells along the longest edge when a volume is measured; 0.1 % on rounded shapes.
_MEASURE_CELLS = 100


@dataclass(frozen=True)
class Body:
    """A robot at rest, relative to the point on the ground below its centre; x is ahead, y up, z to the
    right.

    Attributes:
        positions: `[particle_count, 3]` [m].
        volumes: `[particle_count]` rest volume that each particle stands for [m^3].
        stiffness: `[particle_count]` multiplier of Young's modulus [-].
        density_ratio: `[particle_count]` multiplier of the density [-].
        occupancy: `[particle_count]` in [0, 1]; 0 is empty space.
        muscle_membership: `[particle_count, muscle_count]` share of each muscle [-].
        fibres: `[particle_count, 3]` unit direction in which a muscle contracts.
        head, tail: `[particle_count]` labels that give the heading.
        muscles: names of the muscles.
        malleable: whether the body is the workspace of a design space: a medium that it stands in then fills what is
            left empty.
    """

    positions: Array
    volumes: Array
    stiffness: Array
    density_ratio: Array
    occupancy: Array
    muscle_membership: Array
    fibres: Array
    head: Mask
    tail: Mask
    muscles: tuple[str, ...]
    malleable: bool = False

    @property
    def particle_count(self) -> int:
        """How many particles the body has, empty ones included."""
        return len(self.positions)

    @property
    def muscle_count(self) -> int:
        """How many muscles move it."""
        return len(self.muscles)

    def masses(self, density: float) -> Array:
        """Mass of every particle `[particle_count]` [kg] at this density [kg/m^3]."""
        return density * self.density_ratio * self.occupancy * self.volumes


class Design(Protocol):
    """A recipe for a body at any resolution."""

    def body(self, fidelity: Fidelity) -> Body:
        """The body, sampled as the fidelity asks.

        Raises:
            SceneError: the fidelity is too coarse to hold any of it.
        """
        ...


@dataclass(frozen=True)
class Shape:
    """A solid: `inside(points [n, 3]) -> mask [n]`, within the box `lower` to `upper` [m]."""

    inside: Callable[[Array], Mask]
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]

    def volume(self) -> float:
        """The true volume [m^3], by counting a fine lattice once."""
        return self._volume

    @cached_property
    def _volume(self) -> float:
        lower, upper = np.array(self.lower), np.array(self.upper)
        spacing = float((upper - lower).max()) / _MEASURE_CELLS
        points = fill_box(lower, upper, spacing, 1)
        return float(self.inside(points).sum()) * spacing**3

    def sample(self, fidelity: Fidelity) -> tuple[Array, Array]:
        """Lattice particles inside: positions `[particle_count, 3]` [m] and volumes `[particle_count]` [m^3].

        The lattice starts at the lower y and is centred in x and z, so that a symmetric shape stays
        symmetric. Every particle stands for an equal share of the true volume: the mass does not depend on
        the sampling.

        Raises:
            SceneError: no lattice particle lies inside.
        """
        lower, upper = np.array(self.lower), np.array(self.upper)
        cells = np.ceil((upper - lower) / fidelity.grid_spacing - 1e-9)
        start = (lower + upper) / 2 - cells * fidelity.grid_spacing / 2
        start[1] = lower[1]
        end = start + cells * fidelity.grid_spacing
        lattice = fill_box(start, end, fidelity.grid_spacing, fidelity.particles_per_cell)
        positions = lattice[self.inside(lattice)]
        if not len(positions):
            raise SceneError(
                f"A body of {tuple(np.round(upper - lower, 4))} m holds no particle at a grid spacing of "
                f"{fidelity.grid_spacing:.4g} m. Use a finer fidelity or a larger body."
            )
        return positions, np.full(len(positions), self.volume() / len(positions))
