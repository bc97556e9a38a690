"""The caterpillar: a row of round segments that lie on a broad sole, each with its own muscles."""

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
_PITCH = 0.17  # between segment centres
_SEGMENT_RADII = (0.245, 0.65, 0.5)  # ellipsoids that overlap, leaving a waist of 0.94 between two segments
_AXIS_HEIGHT = 0.35  # the ground cuts the ellipsoids off: one sole of 92 x 42 mm, four cells wide at `standard`

_SIDES = ("left", "right")
_MUSCLES = (
    *(f"ventral-{number + 1}-{side}" for number in range(_SEGMENTS) for side in _SIDES),  # from the tail
    *(f"dorsal-{side}" for side in _SIDES),
)


@register(Kind.DESIGN, "caterpillar", version=3, tags=("animal", "land"))
@dataclass(frozen=True, kw_only=True)
class Caterpillar:
    """A segmented crawler, 0.10 m long, with eight ventral and two dorsal muscles.

    It lies on its belly: feet and gaps of a cell or two give it another gait on every grid, and break on fine ones.
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
        membership = sample.mean(self.membership(sample.points))
        rings = tuple((self.length * (_centres()[1:] + _centres()[:-1]) / 2).tolist())
        return Body.of(sample, membership, _MUSCLES, **sample.ends(_PITCH * self.length), rings=rings)

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
    """Union of the segments above the ground, in unit coordinates."""
    x, y, z = unit.T.copy()  # one coordinate at a time is five times faster than points of three
    along = np.abs(x[:, None] - _centres()).min(axis=1)  # all segments are equal, so the nearest one decides
    length, height, width = _SEGMENT_RADII
    segment = (along / length) ** 2 + ((y - _AXIS_HEIGHT) / height) ** 2 + (z / width) ** 2 <= 1.0
    return np.asarray(segment & (y >= 0.0))
