"""The caterpillar: a row of round segments on short feet, each with its own muscles."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body, check_size, sampled_once
from zoobench.designs.sampling import Shape
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_SEGMENTS = 4
# relative to the body's length, height and width
_PITCH = 0.2167  # between segment centres
_SEGMENT_RADII = (0.175, 0.42, 0.5)  # ellipsoids that overlap, leaving a waist of 0.79 between two segments
_AXIS_HEIGHT = 0.58  # the belly clears the ground by 8 mm: less is below what the contact of any grid resolves
_FOOT_RADII = (0.065, 0.22, 0.17)
_FOOT_HEIGHT = 0.16  # centre: the foot is cut off at the ground
_FOOT_SIDE = 0.25  # centre, left and right of the middle

_SIDES = ("left", "right")
_MUSCLES = (
    *(f"ventral-{number + 1}-{side}" for number in range(_SEGMENTS) for side in _SIDES),  # from the tail
    *(f"dorsal-{side}" for side in _SIDES),
)


@register(Kind.DESIGN, "caterpillar", version=2, tags=("animal", "land"))
@dataclass(frozen=True, kw_only=True)
class Caterpillar:
    """A segmented crawler, 0.10 m long, with eight ventral and two dorsal muscles.

    All fibres run along the body. A ventral muscle of one side and segment bends the body up and to the other side
    there; the dorsal pair bends the whole back down. Waves along the ventral muscles crawl, a difference between left
    and right turns.

    * `length`, `width`, `height`: of the whole body [m].
    """

    length: float = 0.10
    width: float = 0.05
    height: float = 0.05

    def __post_init__(self) -> None:
        check_size("caterpillar", self.length, self.width, self.height)

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        size = (self.length, self.height, self.width)
        return Shape.standing(lambda points: _inside(points / size), *size)

    @sampled_once
    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution."""
        sample = self.shape.sample(fidelity)
        along, end = sample.points[:, 0], _PITCH * self.length
        membership = sample.mean(self.membership(sample.points))
        head, tail = sample.mostly(along > end), sample.mostly(along < -end)
        return Body.of(sample, membership, _MUSCLES, head=head, tail=tail)

    def membership(self, points: Array) -> Array:
        """The share of each muscle `[n, 10]` at points `[n, 3]` [m]."""
        x, y, z = (points / (self.length, self.height, self.width)).T
        segment = np.abs(x[:, None] - _centres()).argmin(axis=1)
        left = np.where(y > _AXIS_HEIGHT, 2 * _SEGMENTS, 2 * segment)
        found = np.zeros((len(points), len(_MUSCLES)))
        found[np.arange(len(points)), left + (z > 0.0)] = 1.0
        return found


def _centres() -> Array:
    """Centres of the segments along x from the tail, in unit coordinates `[4]`."""
    return np.linspace(-1.0, 1.0, _SEGMENTS) * (_SEGMENTS - 1) / 2 * _PITCH


def _inside(unit: Array) -> Mask:
    """Union of the segments and the feet, in unit coordinates."""
    x, y, z = unit.T.copy()  # one coordinate at a time is five times faster than points of three
    along = np.abs(x[:, None] - _centres()).min(axis=1)  # all segments are alike, so the nearest one decides
    segment = _in_ellipsoid((along, y, z), (0.0, _AXIS_HEIGHT, 0.0), _SEGMENT_RADII)
    foot = _in_ellipsoid((along, y, np.abs(z)), (0.0, _FOOT_HEIGHT, _FOOT_SIDE), _FOOT_RADII)
    return np.asarray((segment | foot) & (y >= 0.0))


def _in_ellipsoid(columns: Sequence[Array], centre: Sequence[float], radii: Sequence[float]) -> Mask:
    x, y, z = (((column - c) / r) ** 2 for column, c, r in zip(columns, centre, radii, strict=True))
    inside: Mask = x + y + z <= 1.0
    return inside
