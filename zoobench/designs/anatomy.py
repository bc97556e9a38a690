"""Animals made of parts: solids with muscles, fibres, stiffness and density, sampled at any resolution."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body, Drawing, sampled_once
from zoobench.designs.sampling import Shape
from zoobench.designs.shapes import Distance, Plane, Point, smooth_union
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity

REFERENCE_LENGTH = 0.10
"""Length of an animal as drawn [m]; other lengths scale it uniformly."""

THINNEST = 0.017
"""Thickness of fins [m]: two particles across on a grid of 1/64 m, and still one on a grid of 1/32 m."""

SWIMMER_LENGTH = 0.15
"""Length of a swimmer [m], unless another is asked for: ten cells on a grid of 1/64 m."""

TAIL = 0.0105
"""Thickness of a swimmer's tail fin as drawn [m]: at `SWIMMER_LENGTH` three particles on a grid of 1/64 m."""

SWIMMER_PARTICLES = 27
"""Particles per cell of a swimmer, at least. With 8, a stem of the tail that is a cell or two thick comes apart where
it is bent sharply, though hardly stretched: under square waves at 8 Hz, at draft, neighbours in the fish of version 4
were 20 times as far apart as at rest, with 27 never more than 2.3 times. In water on a grid it costs half as much
again."""

STIFF, SOFT, LIGHT = 2.0, 0.5, 0.92
"""Stiffness of fins and skulls and of fat, and density of fat, relative to muscle [-]. Real bone is a thousand times as
stiff, which would shorten the time step by the root of that."""

_POINTS = 1_000_000  # by which an animal is sampled: it fills a third of its box, and fins are a fiftieth of it

_MARGIN = 0.004  # [m] over which the tissues of two parts blend


@dataclass(frozen=True)
class Muscles:
    """Muscles of a part: their names, and the share of each `[n, len(names)]` at points `[n, 3]` [m]."""

    names: tuple[str, ...]
    shares: Callable[[Array], Array]


def whole(name: str) -> Muscles:
    """One muscle that fills the part."""
    return Muscles((name,), lambda points: np.ones((len(points), 1)))


def opposed(names: tuple[str, str], axis: int, low: float, high: float) -> Muscles:
    """Two antagonists: the first muscle below `low`, the second above `high` along an axis [m]."""

    def shares(points: Array) -> Array:
        second = np.clip((points[:, axis] - low) / (high - low), 0.0, 1.0)
        return np.stack([1.0 - second, second], axis=1)

    return Muscles(names, shares)


def in_a_row(names: Sequence[str], rear: float, front: float) -> Muscles:
    """Muscles of equal length along x from `rear` to `front` [m], the first at the tail.

    Points behind `rear` belong to the first; points before `front` have no muscle.
    """

    def shares(points: Array) -> Array:
        slice_index = np.floor((points[:, 0] - rear) / (front - rear) * len(names)).astype(int)
        return np.eye(len(names) + 1)[np.clip(slice_index, 0, len(names)), :-1]

    return Muscles(tuple(names), shares)


def crossed(first: Muscles, second: Muscles) -> Muscles:
    """Every muscle of `first` divided by the muscles of `second`; names are joined."""

    def shares(points: Array) -> Array:
        found: Array = first.shares(points)[:, :, None] * second.shares(points)[:, None, :]
        return found.reshape(len(points), -1)

    return Muscles(tuple(f"{one}-{other}" for one in first.names for other in second.names), shares)


def beside(first: Muscles, second: Muscles) -> Muscles:
    """The muscles of both."""
    return Muscles(first.names + second.names, lambda points: np.hstack([first.shares(points), second.shares(points)]))


def _sides(points: Array) -> Array:
    """Left and right; points on the middle plane belong to both, so that a symmetric body does not turn."""
    right = (1.0 + np.sign(np.round(points[:, 2], 9))) / 2
    return np.stack([1.0 - right, right], axis=1)


SIDES = Muscles(("left", "right"), _sides)
NO_MUSCLE = Muscles((), lambda points: np.zeros((len(points), 0)))


@dataclass(frozen=True, kw_only=True)
class BodyPart:
    """A part of an animal.

    Attributes:
        solid: its signed distance; a pair of limbs is one `mirrored` solid.
        fibre: direction of contraction on the right side, mirrored on the left. Its sign is arbitrary, but agrees with
            that of adjacent parts.
        stiffness, density_ratio: relative to muscle [-].
    """

    solid: Distance
    muscles: Muscles = NO_MUSCLE
    fibre: Point = (1.0, 0.0, 0.0)
    stiffness: float = 1.0
    density_ratio: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Animal:
    """A body made of parts, drawn `REFERENCE_LENGTH` long and scaled to its length.

    Attributes:
        box: length, height and width of the bounding box [m].
        parts: in the order of the controller's channels.
        neck, rump: the head lies before `neck` and the tail behind `rump` along x [m].
        blend: width of the fillets between parts [m].
        length: of the animal [m].
        particles_per_cell: at least so many, whatever the fidelity says.
        middle: height of the plane about which a swimmer is drawn [m]; without, it stands, and is cut off at y = 0.
    """

    box: Point
    parts: tuple[BodyPart, ...]
    neck: float
    rump: float
    blend: float = 0.006
    length: float = REFERENCE_LENGTH
    particles_per_cell: int = 1
    middle: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.length < np.inf:
            raise UsageError(f"An animal {self.length:g} m long has no body. Give a positive length.")

    @property
    def scale(self) -> float:
        """Scale relative to the drawing [-]."""
        return self.length / REFERENCE_LENGTH

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the muscles of all parts."""
        return tuple(name for part in self.parts for name in part.muscles.names)

    def distance(self, points: Array) -> Array:
        """Signed distance `[n]` [m] of points `[n, 3]` [m] to the surface; negative inside."""
        drawn: Array = np.divide(points, self.scale, order="F")  # one coordinate after the other is twice as fast
        skin = smooth_union([part.solid(drawn) for part in self.parts], self.blend)
        return self.scale * (np.maximum(skin, -drawn[:, 1]) if self.middle is None else skin)

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        length, height, width = (self.scale * edge for edge in self.box)
        solid = Shape.standing(lambda points: self.distance(points) <= 0.0, length, height, width)
        return replace(solid, points=_POINTS, level=None if self.middle is None else self.scale * self.middle)

    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution; its properties are smooth functions of place."""
        least = self.particles_per_cell if fidelity.robot == "mpm" else 1
        return self._body(fidelity.with_particles(least))

    @sampled_once
    def _body(self, fidelity: Fidelity) -> Body:
        """On this lattice, which has particles enough; several fidelities may share it."""
        sample = self.shape.sample(fidelity)
        drawn = sample.points / self.scale
        tissue = self._tissue(drawn)
        density = sample.mean(tissue @ [part.density_ratio for part in self.parts])
        shares = self._shares(drawn, tissue)
        return Body.of(
            sample,
            sample.mean(shares),
            self.muscles,
            head=sample.mostly(drawn[:, 0] > self.neck),
            tail=sample.mostly(drawn[:, 0] < self.rump),
            stiffness=sample.mean(tissue @ [part.stiffness for part in self.parts]),
            # normalised to the mass of the same volume of muscle, so that an animal neither sinks nor rises
            density_ratio=density / np.average(density, weights=sample.volumes),
            fibres=sample.direction(self._directions(drawn, tissue), shares.sum(axis=1)),
            drawing=self._drawing,
        )

    @property
    def _drawing(self) -> Drawing:
        """The solid in its bounding box, that of a swimmer as far above its middle as below."""
        lower, upper = np.array(self.shape.lower), np.array(self.shape.upper)
        if self.middle is not None:
            upper[1] = 2.0 * self.scale * self.middle
        return Drawing(self.distance, lower, upper)

    def _tissue(self, drawn: Array) -> Array:
        """Share of each part at each point `[n, part_count]`: 1 in the part with the least distance, blended nearby."""
        drawn = np.asfortranarray(drawn)
        distances = [part.solid(drawn) for part in self.parts]
        least = reduce(np.minimum, distances)
        weights = np.stack([np.maximum(1.0 - (each - least) / _MARGIN, 0.0) for each in distances], axis=1)
        found: Array = weights / weights.sum(axis=1, keepdims=True)
        return found

    def stiffness(self, points: Array) -> Array:
        """Stiffness relative to muscle `[n]` [-] at points `[n, 3]` [m]."""
        return self._tissue(points / self.scale) @ [part.stiffness for part in self.parts]

    def membership(self, points: Array) -> Array:
        """Share of each muscle `[n, muscle_count]` [-] at points `[n, 3]` [m]; their sum is less than 1 in passive
        tissue."""
        drawn = points / self.scale
        return self._shares(drawn, self._tissue(drawn))

    def _shares(self, drawn: Array, tissue: Array) -> Array:
        """Share of each muscle `[n, muscle_count]` [-], from that of each part `[n, part_count]` [-]."""
        return np.hstack([tissue[:, [n]] * part.muscles.shares(drawn) for n, part in enumerate(self.parts)])

    def fibres(self, points: Array) -> Array:
        """Unit directions of contraction `[n, 3]`, the mean over the tissues, at points `[n, 3]` [m]."""
        drawn = points / self.scale
        return self._directions(drawn, self._tissue(drawn))

    def _directions(self, drawn: Array, tissue: Array) -> Array:
        """Unit directions `[n, 3]`, from the share of each part `[n, part_count]` [-]."""
        directions = np.array([part.fibre for part in self.parts])
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        mean = tissue @ directions
        mean[:, 2] *= np.sign(np.round(drawn[:, 2], 9))
        mean[np.linalg.norm(mean, axis=1) < 1e-6] = (1.0, 0.0, 0.0)
        found: Array = mean / np.linalg.norm(mean, axis=1, keepdims=True)
        return found


MIDDLE = 0.03125 / 1.5
"""Height of a swimmer's middle as drawn, in some 3/4 of it [m]. At `SWIMMER_LENGTH` it is two cells of 1/64 m, three
of 1/96 m and four of 1/128 m, so that what is symmetric as drawn is sampled so; it dives otherwise."""


def level(ahead: float) -> Plane:
    """The level plane through a swimmer's middle, with its origin so far ahead [m]: outlines are drawn as (x, z)."""
    return Plane((ahead, MIDDLE, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def swimmer(length: float, height: float, width: float, *parts: BodyPart) -> Animal:
    """A swimmer of this length [m], drawn with this height and width [m]."""
    return Animal(
        box=(REFERENCE_LENGTH, height, width), parts=parts, neck=0.022, rump=-0.022, length=length,
        particles_per_cell=SWIMMER_PARTICLES, middle=MIDDLE,
    )  # fmt: skip


def myomeres(trunk: Distance, sides: Muscles = SIDES, *, front: Muscles | None = None) -> BodyPart:
    """A trunk with four segments of muscle on each of two sides, from -0.046 to 0.040 m along x.

    Args:
        front: the muscles of the two foremost segments, where they are others.
    """
    segments = in_a_row(("segment-1", "segment-2", "segment-3", "segment-4"), -0.046, 0.040)
    rear, fore = _some(segments, slice(2)), _some(segments, slice(2, 4))
    muscles = beside(crossed(rear, sides), crossed(fore, front or sides))
    return BodyPart(solid=trunk, muscles=muscles)


def _some(muscles: Muscles, which: slice) -> Muscles:
    """Some of these muscles."""
    return Muscles(muscles.names[which], lambda points: muscles.shares(points)[:, which])


def paired(name: str, solid: Distance, fibre: Point) -> BodyPart:
    """A pair of limbs with a muscle on each side."""
    return BodyPart(solid=solid, muscles=crossed(whole(name), SIDES), fibre=fibre)


def stiff(*solids: Distance) -> tuple[BodyPart, ...]:
    """Stiff parts without muscle."""
    return tuple(BodyPart(solid=solid, stiffness=STIFF) for solid in solids)


def soft(*solids: Distance) -> tuple[BodyPart, ...]:
    """Soft parts without muscle."""
    return tuple(BodyPart(solid=solid, stiffness=SOFT) for solid in solids)
