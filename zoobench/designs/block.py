"""The block: a box of muscle, the default workspace of design spaces."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body, check_size, sampled_once
from zoobench.designs.sampling import Shape
from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_SIDES = ("left", "right")
_LAYERS = ("bottom", "top")
_END = 0.25  # of the length: head and tail
_MOST_ROWS = 8


@register(Kind.DESIGN, "block", version=3, tags=("land", "water"))
@dataclass(frozen=True, kw_only=True)
class Block:
    """A box with muscles in rows, left and right, bottom and top: eight of them, 0.10 m long.

    All fibres run along the body. Antagonists are left and right, which bend it sideways, and bottom and top, which
    bend it up and down.

    * `length`, `width`, `height`: of the box [m].
    * `rows`: of muscles along the body, 1 to 8, the first at the tail.
    * `columns`: 2 for left and right, 1 for no division.
    * `layers`: 2 for bottom and top, 1 for no division.
    """

    length: float = 0.10
    width: float = 0.05
    height: float = 0.05
    rows: int = 2
    columns: int = 2
    layers: int = 2

    def __post_init__(self) -> None:
        check_size("block", self.length, self.width, self.height)
        if not 1 <= self.rows <= _MOST_ROWS or self.columns not in (1, 2) or self.layers not in (1, 2):
            raise UsageError(
                f"Muscles in {self.rows} rows, {self.columns} columns and {self.layers} layers are not offered. "
                f"Give 1 to {_MOST_ROWS} rows, and 1 or 2 columns and layers."
            )

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        return Shape.standing(self._inside, self.length, self.height, self.width)

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names such as `row-1-left-bottom`, row by row from the tail; without a division its word is left out."""
        columns = [f"-{name}" for name in _SIDES] if self.columns == 2 else [""]
        layers = [f"-{name}" for name in _LAYERS] if self.layers == 2 else [""]
        return tuple(f"row-{row + 1}{side}{layer}" for row in range(self.rows) for side in columns for layer in layers)

    @sampled_once
    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution."""
        sample = self.shape.sample(fidelity).of_volume(self.length * self.height * self.width)
        membership = sample.mean(self.membership(sample.points))
        return Body.of(sample, membership, self.muscles, **sample.ends((0.5 - _END) * self.length))

    def _inside(self, points: Array) -> Mask:
        unit = points / (self.length, self.height, self.width) - (0.0, 0.5, 0.0)
        return np.asarray((np.abs(unit) < 0.5 - 1e-9).all(axis=1))

    def membership(self, points: Array) -> Array:
        """The share of each muscle `[n, muscle_count]` at points `[n, 3]` [m]."""
        unit = points / (self.length, self.height, self.width) + (0.5, 0.0, 0.5)
        along, up, across = (
            _bands(unit[:, axis], count) for axis, count in enumerate((self.rows, self.layers, self.columns))
        )
        found: Array = np.einsum("nr,nc,nl->nrcl", along, across, up)
        return found.reshape(len(points), -1)


def _bands(unit: Array, count: int) -> Array:
    """Share of each of so many equal bands of [0, 1] at each number `[n, count]`.

    A point on a border belongs to both bands equally, so that a symmetric body does not turn.
    """
    below, above = (np.clip(np.floor(unit * count + nudge), 0, count - 1).astype(int) for nudge in (-1e-9, 1e-9))
    found: Array = (np.eye(count)[below] + np.eye(count)[above]) / 2
    return found
