"""The protocol of designs, and the body: particles at rest with the labels for tasks."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.scene import BodyParticles, uniform_arrays

Mask = NDArray[np.bool_]

_MEASURE_CELLS = 100  # along the longest edge when a volume is measured: an error of 0.1 % on rounded shapes


@dataclass(frozen=True)
class Body(BodyParticles):
    """A robot at rest, relative to the point on the ground below its centre; x is ahead, y up, z to the right.

    Attributes:
        head, tail: `[particle_count]` labels that define the heading.
        muscles: names of the muscles.
        malleable: whether the body is the workspace of a design space; a medium then fills its empty particles.
        notes: what a user should know of how the body was made, as sentences; such as repairs of a file.
    """

    head: Mask
    tail: Mask
    muscles: tuple[str, ...]
    malleable: bool = False
    notes: tuple[str, ...] = ()

    @classmethod
    def uniform(
        cls, sample: tuple[Array, Array], membership: Array, muscles: tuple[str, ...], *, head: Mask, tail: Mask
    ) -> "Body":
        """A body of muscle alone with fibres ahead; `sample` has positions and volumes, the others are as above."""
        arrays = uniform_arrays(len(membership))
        return cls(*sample, muscle_membership=membership, muscles=muscles, head=head, tail=tail, **arrays)

    def masses(self, density: float) -> Array:
        """Masses of the particles `[particle_count]` [kg] at this density of muscle [kg/m^3]."""
        return density * self.density_ratio * self.occupancy * self.volumes


class Design(Protocol):
    """A body that can be sampled at any resolution."""

    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution.

        Raises:
            SceneError: the fidelity is too coarse for a single particle.
        """
        ...


@dataclass(frozen=True)
class Shape:
    """A solid: `inside` maps points `[n, 3]` [m] to a mask `[n]`, within the box `lower` to `upper` [m]."""

    inside: Callable[[Array], Mask]
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]

    @classmethod
    def standing(cls, inside: Callable[[Array], Mask], length: float, height: float, width: float) -> "Shape":
        """A solid in a box of this size [m] that stands on y = 0, centred in x and z."""
        return cls(inside, (-length / 2, 0.0, -width / 2), (length / 2, height, width / 2))

    def volume(self) -> float:
        """The volume [m^3], measured once on a fine lattice."""
        return self._volume

    @cached_property
    def _volume(self) -> float:
        lower, upper = np.array(self.lower), np.array(self.upper)
        spacing = float((upper - lower).max()) / _MEASURE_CELLS
        points = fill_box(lower, upper, spacing, 1)
        return float(self.inside(points).sum()) * spacing**3

    def sample(self, fidelity: Fidelity) -> tuple[Array, Array]:
        """Lattice particles inside: positions `[particle_count, 3]` [m] and volumes `[particle_count]` [m^3].

        The lattice starts at the lower y and is centred in x and z, so that a symmetric shape stays symmetric. All
        particles have equal shares of the true volume, so that the mass does not depend on the resolution.

        Raises:
            SceneError: no particle lies inside.
        """
        lattice = self.lattice(fidelity)
        positions = lattice[self.inside(lattice)]
        if not len(positions):
            raise SceneError(
                f"A body of {tuple(np.round(np.subtract(self.upper, self.lower), 4))} m holds no particle at a grid "
                f"spacing of {fidelity.grid_spacing:.4g} m. Use a finer fidelity or a larger body."
            )
        return positions, np.full(len(positions), self.volume() / len(positions))

    def lattice(self, fidelity: Fidelity) -> Array:
        """All places for particles in the box `[place_count, 3]` [m], rounded up to whole cells."""
        lower, upper = np.array(self.lower), np.array(self.upper)
        cells = np.ceil((upper - lower) / fidelity.grid_spacing - 1e-9)
        start = (lower + upper) / 2 - cells * fidelity.grid_spacing / 2
        start[1] = lower[1]
        end = start + cells * fidelity.grid_spacing
        return fill_box(start, end, fidelity.grid_spacing, fidelity.particles_per_cell)


def check_ends(body: Body, name: str) -> None:
    """Check that a body has a heading, from the centre of its tail to that of its head; without, scores are NaN.

    Raises:
        SceneError: no particle with mass is labelled as head, or none as tail, or the labels are not one per particle.
    """
    for end in ("head", "tail"):
        label = np.asarray(getattr(body, end))
        if label.shape != (body.particle_count,):
            raise SceneError(
                f"The {end} of the design {name!r} has labels of shape {label.shape}; one for each of its "
                f"{body.particle_count} particles was expected. Correct the design's `body`."
            )
        if not (label.astype(bool) & (body.occupancy > 0.0)).any():
            raise SceneError(
                f"The design {name!r} has no particle in its {end}, so it has no heading and no score. Use a finer "
                f"fidelity or a longer body, or have the design label particles as `{end}`."
            )


def check_size(noun: str, *edges: float) -> None:
    """Check the edges of a body [m].

    Raises:
        UsageError: one is not positive.
    """
    if min(edges) <= 0:
        size = " x ".join(f"{edge:g}" for edge in edges)
        raise UsageError(f"A {noun} of {size} m has no volume. Give positive lengths.")
