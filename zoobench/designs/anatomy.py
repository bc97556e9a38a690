"""Animals from parts: each part a solid with its muscles, fibres and stiffness; the body follows at any resolution."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body, Shape
from zoobench.designs.shapes import Distance, Point, smooth_union
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity

REFERENCE_LENGTH = 0.10
"""Length of an animal as it is drawn [m]; any other is a uniform scaling."""

THINNEST = 0.017
"""Thickness of fins [m]: two particles across on a grid of 1/64 m, and still one on a grid of 1/32 m."""

STIFF, SOFT, LIGHT = 2.0, 0.5, 0.92
"""Stiffness of fins and skulls and of fat, and density of fat, relative to muscle [-]. Real bone would be a thousand
times as stiff, and the time step as much shorter as the root of that."""

_MARGIN = 0.004  # [m] over which the tissues of two parts pass into each other


@dataclass(frozen=True)
class Muscles:
    """Muscle groups of a part: their names, and the share of each `[n, len(names)]` at points `[n, 3]` [m]."""

    names: tuple[str, ...]
    shares: Callable[[Array], Array]


def whole(name: str) -> Muscles:
    """One muscle that fills the part."""
    return Muscles((name,), lambda points: np.ones((len(points), 1)))


def opposed(names: tuple[str, str], axis: int, low: float, high: float) -> Muscles:
    """Two muscles that pull against each other: the first below `low`, the second above `high` along an axis [m]."""

    def shares(points: Array) -> Array:
        second = np.clip((points[:, axis] - low) / (high - low), 0.0, 1.0)
        return np.stack([1.0 - second, second], axis=1)

    return Muscles(names, shares)


def in_a_row(names: Sequence[str], rear: float, front: float) -> Muscles:
    """Muscles of equal length one behind the other along x, the first at the tail, from `rear` to `front` [m].

    What lies behind belongs to the first; what lies before is a head without muscle.
    """

    def shares(points: Array) -> Array:
        place = np.floor((points[:, 0] - rear) / (front - rear) * len(names)).astype(int)
        found: Array = np.eye(len(names) + 1)[np.clip(place, 0, len(names)), :-1]
        return found

    return Muscles(tuple(names), shares)


def crossed(first: Muscles, second: Muscles) -> Muscles:
    """Every muscle of the one divided by the other; names are joined."""

    def shares(points: Array) -> Array:
        found: Array = first.shares(points)[:, :, None] * second.shares(points)[:, None, :]
        return found.reshape(len(points), -1)

    return Muscles(tuple(f"{one}-{other}" for one in first.names for other in second.names), shares)


def _sides(points: Array) -> Array:
    """Left and right; what lies on the middle plane is both: an odd lattice must not make the body turn."""
    right = (1.0 + np.sign(np.round(points[:, 2], 9))) / 2
    return np.stack([1.0 - right, right], axis=1)


SIDES = Muscles(("left", "right"), _sides)
NO_MUSCLE = Muscles((), lambda points: np.zeros((len(points), 0)))


@dataclass(frozen=True, kw_only=True)
class Part:
    """A piece of an animal.

    Attributes:
        solid: where it is; a pair of limbs is one `mirrored` solid.
        fibre: direction in which its muscles contract, on the right side, mirrored on the left. Its
            sense has no meaning, but agrees with that of the parts that it passes into.
        stiffness, density_ratio: multiples of those of muscle [-].
    """

    solid: Distance
    muscles: Muscles = NO_MUSCLE
    fibre: Point = (1.0, 0.0, 0.0)
    stiffness: float = 1.0
    density_ratio: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Animal:
    """A body made of parts, drawn `REFERENCE_LENGTH` long and scaled to its length. The sole is a cut at y = 0.

    Attributes:
        box: length, height and width that the parts together keep to [m].
        parts: the first muscle named is the first channel of the controller.
        neck, rump: the head is before the one and the tail behind the other along x [m].
        blend: width of the fillets between parts [m].
        length: of the animal [m].
    """

    box: Point
    parts: tuple[Part, ...]
    neck: float
    rump: float
    blend: float = 0.006
    length: float = field(default=REFERENCE_LENGTH)

    def __post_init__(self) -> None:
        if not 0.0 < self.length < np.inf:
            raise UsageError(f"An animal {self.length:g} m long has no body. Give a positive length.")

    @property
    def scale(self) -> float:
        """Its size relative to the drawing [-]."""
        return self.length / REFERENCE_LENGTH

    @property
    def muscles(self) -> tuple[str, ...]:
        """The muscles of all parts."""
        return tuple(name for part in self.parts for name in part.muscles.names)

    def distance(self, points: Array) -> Array:
        """Signed distance `[n]` [m] of points `[n, 3]` [m] to the skin; negative inside."""
        drawn = points / self.scale
        skin = smooth_union([part.solid(drawn) for part in self.parts], self.blend)
        return self.scale * np.maximum(skin, -drawn[:, 1])

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        length, height, width = (self.scale * edge for edge in self.box)
        return Shape(
            inside=lambda points: self.distance(points) <= 0.0,
            lower=(-length / 2, 0.0, -width / 2),
            upper=(length / 2, height, width / 2),
        )

    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution; tissues, shares and fibres are smooth functions of place."""
        positions, volumes = self.shape.sample(fidelity)
        drawn = positions / self.scale
        density = self._tissue(drawn) @ [part.density_ratio for part in self.parts]
        return Body(
            positions=positions,
            volumes=volumes,
            stiffness=self.stiffness(positions),
            # light and heavy tissues balance: an animal weighs what as much muscle weighs, and neither sinks nor rises
            density_ratio=density / density.mean(),
            occupancy=np.ones(len(positions)),
            muscle_membership=self.membership(positions),
            fibres=self.fibres(positions),
            head=drawn[:, 0] > self.neck,
            tail=drawn[:, 0] < self.rump,
            muscles=self.muscles,
        )

    def _tissue(self, drawn: Array) -> Array:
        """How much each point belongs to each part `[n, part_count]`: all to the part it is deepest in, but near
        another."""
        distances = np.stack([part.solid(drawn) for part in self.parts], axis=1)
        weights = np.maximum(1.0 - (distances - distances.min(axis=1, keepdims=True)) / _MARGIN, 0.0)
        found: Array = weights / weights.sum(axis=1, keepdims=True)
        return found

    def stiffness(self, points: Array) -> Array:
        """Multiplier of Young's modulus `[n]` [-] at points `[n, 3]` [m]."""
        found: Array = self._tissue(points / self.scale) @ [part.stiffness for part in self.parts]
        return found

    def membership(self, points: Array) -> Array:
        """Share of each muscle `[n, muscle_count]` [-] at points `[n, 3]` [m]; less than 1 together where matter is
        passive."""
        drawn = points / self.scale
        tissue = self._tissue(drawn)
        return np.hstack([tissue[:, [n]] * part.muscles.shares(drawn) for n, part in enumerate(self.parts)])

    def fibres(self, points: Array) -> Array:
        """Unit directions `[n, 3]` in which the muscles contract: the mean over the tissues at points `[n, 3]` [m]."""
        drawn = points / self.scale
        directions = np.array([part.fibre for part in self.parts])
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        mirror = np.stack([np.ones(len(drawn)), np.ones(len(drawn)), np.sign(np.round(drawn[:, 2], 9))], axis=1)
        mean = (self._tissue(drawn) @ directions) * mirror
        mean[np.linalg.norm(mean, axis=1) < 1e-6] = (1.0, 0.0, 0.0)
        found: Array = mean / np.linalg.norm(mean, axis=1, keepdims=True)
        return found
