"""The caterpillar: a row of round segments on short feet, each with its own muscles."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body, Mask, Shape, check_size
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_SEGMENTS = 4
# relative to the body's length, height and width
_PITCH = 0.2167  # between segment centres
_SEGMENT_RADII = (0.175, 0.46, 0.5)  # ellipsoids that overlap, leaving a waist of 0.79 between two segments
_AXIS_HEIGHT = 0.54
_FOOT_RADII = (0.065, 0.22, 0.17)
_FOOT_HEIGHT = 0.16  # centre: the foot is cut off at the ground
_FOOT_SIDE = 0.25  # centre, left and right of the middle


@register(Kind.DESIGN, "caterpillar", tags=("animal", "land"))
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

    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution."""
        positions, volumes = self.shape.sample(fidelity)
        unit = positions / (self.length, self.height, self.width)
        membership, names = _muscles(unit)
        head, tail = unit[:, 0] > _PITCH, unit[:, 0] < -_PITCH
        return Body.uniform((positions, volumes), membership, names, head=head, tail=tail)


def _centres() -> Array:
    """Centres of the segments along x from the tail, in unit coordinates `[4]`."""
    return np.linspace(-1.0, 1.0, _SEGMENTS) * (_SEGMENTS - 1) / 2 * _PITCH


def _inside(unit: Array) -> Mask:
    """Union of the segments and the feet, in unit coordinates."""
    columns = unit.T.copy()  # one coordinate at a time is five times faster than points of three
    solid = np.zeros(len(unit), dtype=bool)
    for x in _centres():
        solid |= _in_ellipsoid(columns, (x, _AXIS_HEIGHT, 0.0), _SEGMENT_RADII)
        for side in (-_FOOT_SIDE, _FOOT_SIDE):
            solid |= _in_ellipsoid(columns, (x, _FOOT_HEIGHT, side), _FOOT_RADII)
    return solid & (unit[:, 1] >= 0.0)


def _in_ellipsoid(columns: Array, centre: Sequence[float], radii: Sequence[float]) -> Mask:
    x, y, z = (((column - c) / r) ** 2 for column, c, r in zip(columns, centre, radii, strict=True))
    inside: Mask = x + y + z <= 1.0
    return inside


def _muscles(unit: Array) -> tuple[Array, tuple[str, ...]]:
    """Membership `[particle_count, 10]` and the muscles' names, segments counted from the tail.

    Particles on the middle plane belong to both sides equally, so that the body does not turn by itself.
    """
    segment = np.abs(unit[:, 0, None] - _centres()).argmin(axis=1)
    left_group = np.where(unit[:, 1] > _AXIS_HEIGHT, 2 * _SEGMENTS, 2 * segment)
    right_share = (1.0 + np.sign(np.round(unit[:, 2, None], 9))) / 2
    sides = ("left", "right")
    names = [f"ventral-{number + 1}-{side}" for number in range(_SEGMENTS) for side in sides]
    names += [f"dorsal-{side}" for side in sides]
    one_hot = np.eye(len(names))
    membership: Array = (1.0 - right_share) * one_hot[left_group] + right_share * one_hot[left_group + 1]
    return membership, tuple(names)
