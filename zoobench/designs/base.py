"""The protocol of designs, and the body: particles at rest with the labels for tasks."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.quarters import BASE_CHANNELS
from zoobench.designs.sampling import SolidSample
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.elastic_bodies import BodyParticles, Box, Drive, uniform_arrays
from zoobench.sim.model.fidelity import Fidelity


@dataclass(frozen=True)
class Drawing:
    """A solid as it was drawn, the same at every resolution.

    Attributes:
        distance: signed distance `[n]` [m] of points `[n, 3]` [m] to the solid's surface, negative inside.
        lower, upper: corners `[3]` [m] of a box around the solid, whose middle planes are those of a symmetric solid.
    """

    distance: Callable[[Array], Array]
    lower: Array
    upper: Array


@dataclass(frozen=True)
class Body(BodyParticles):
    """A robot at rest, relative to the point on the ground below its centre; x is ahead, y up, z to the right.

    Every particle is at the centre of the solid part of its cube of a lattice, and has the volume of that part.

    Attributes:
        head, tail: `[particle_count]` labels that define the heading.
        muscles: names of the muscles.
        sites: `[particle_count, 3]` the centres of the cubes [m].
        edge: of the cubes [m].
        malleable: whether the body is the workspace of a design space; a medium then fills its empty particles.
        notes: notes for users on how the body was made, as sentences; such as repairs of a file.
        rings: places along x [m] at which pictures draw a ring around the body, as between segments.
        anchored: `[particle_count]` what is held at rest: the box around it; None for a body that is free.
        drawing: of the solid; None where only the particles are known.
        base_speed: of what is anchored, at full activity of its last three muscles' channels, which move it ahead, up
            and to the right [m/s]; 0 where it is held.
    """

    head: Mask
    tail: Mask
    muscles: tuple[str, ...]
    sites: Array
    edge: float
    malleable: bool = False
    notes: tuple[str, ...] = ()
    rings: tuple[float, ...] = ()
    anchored: Mask | None = None
    base_speed: float = 0.0
    drawing: Drawing | None = None

    @classmethod
    def of(
        cls, sample: SolidSample, membership: Array, muscles: tuple[str, ...], *, head: Mask, tail: Mask, **arrays: Any
    ) -> "Body":
        """The body of a sample, with arrays over its particles as above; without, it is of muscle with fibres ahead.

        Its notes are those of the sample.
        """
        return cls(
            positions=sample.positions,
            volumes=sample.volumes,
            sites=sample.sites,
            edge=sample.edge,
            muscle_membership=membership,
            muscles=muscles,
            head=head,
            tail=tail,
            **uniform_arrays(len(sample.positions)) | {"notes": sample.notes} | arrays,
        )

    @property
    def base_channels(self) -> int:
        """How many of the muscles, the last ones, are channels that move the base, and contract nothing."""
        return len(BASE_CHANNELS) if self.base_speed else 0

    @property
    def box(self) -> tuple[Array, Array]:
        """Lower and upper corner `[3]` [m] of the box around the body.

        The solid part of a cube is taken as a plate of its cross-section, by half of whose thickness it reaches beyond
        its particle: exact for a flat end, and right to a tenth of a cube for a round one.
        """
        reach = self.volumes[:, None] / (2.0 * self.edge**2)
        return (self.positions - reach).min(axis=0), (self.positions + reach).max(axis=0)

    @property
    def size(self) -> Array:
        """Length, height and width `[3]` [m]."""
        low, high = self.box
        found: Array = high - low
        return found

    def anchor(self, shift: Array) -> tuple[Box, ...]:
        """The box of the cubes that are held, of a body moved by `shift` `[3]` [m]; none if none are."""
        if self.anchored is None or self.base_speed:
            return ()
        held = self.sites[self.anchored] + shift
        low, high = held.min(axis=0) - self.edge / 2, held.max(axis=0) + self.edge / 2
        corners = (float(low[0]), float(low[1]), float(low[2])), (float(high[0]), float(high[1]), float(high[2]))
        return (corners,)

    @property
    def drive(self) -> Drive | None:
        """The base that moves; None for none."""
        if self.anchored is None or not self.base_speed:
            return None
        return Drive(self.anchored, self.base_speed)

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


_MOST_KEPT = 100_000
"""Particles of one design's bodies that are kept, some 25 MB."""

_D = TypeVar("_D", bound=Design)


def sampled_once(method: Callable[[_D, Fidelity], Body]) -> Callable[[_D, Fidelity], Body]:
    """Decorate `body` of an immutable design that reads only the lattice and the frame of a fidelity: its last bodies
    are kept.

    To sample a solid takes up to a second. Whoever is given a body must not write into its arrays. Large ones are not
    kept: they are seldom asked for twice, and take the memory of a simulation.
    """

    @functools.wraps(method)
    def body(design: _D, fidelity: Fidelity) -> Body:
        kept: dict[tuple[float, int, str], Body] = vars(design).setdefault("_bodies", {})
        lattice = fidelity.grid_spacing, fidelity.particles_per_cell, fidelity.robot
        if (found := kept.get(lattice)) is None:
            found = kept[lattice] = method(design, fidelity)
            while sum(each.particle_count for each in kept.values()) > _MOST_KEPT:
                kept.pop(next(iter(kept)))
        return found

    return body


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
