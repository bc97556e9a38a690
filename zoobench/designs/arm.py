"""The arm: a beam of muscle that hangs from a base that is held."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body, check_size, sampled_once
from zoobench.designs.quarters import BASE, check_base_speed, quarter_names, quarters, with_base
from zoobench.designs.sampling import Shape
from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_MOST_ROWS = 8
_TIP = 0.125
"""Share of the length that is the tip."""


@register(Kind.DESIGN, "arm", tags=("land", "anchored"))
@dataclass(frozen=True, kw_only=True)
class Arm:
    """An arm that hangs from a base and reaches for things: its tip is its head.

    The base is held where it is, or moves. Muscles run along the arm in rows of four, front and back, left and right;
    a row bends to the side whose muscles contract.

    * `length`: of the free part [m].
    * `thickness`: [m].
    * `rows`: of muscles, 1 to 8, the first at the base.
    * `clearance`: below the tip [m].
    * `base_speed`: of the base at full activity of its channels, which move it ahead, up and to the right [m/s]; 0
      where it is held.
    """

    length: float = 0.125
    thickness: float = 0.04
    rows: int = 2
    clearance: float = 0.03
    base_speed: float = 0.0

    def __post_init__(self) -> None:
        check_size("arm", self.length, self.thickness, self.thickness)
        check_base_speed(self.base_speed)
        if not 1 <= self.rows <= _MOST_ROWS or not 0.0 <= self.clearance < np.inf:
            raise UsageError(
                f"An arm of {self.rows} rows, {self.clearance:g} m above the ground, is not offered. Give 1 to "
                f"{_MOST_ROWS} rows and a clearance of 0 or more."
            )

    @cached_property
    def shape(self) -> Shape:
        """The solid with its base."""
        half, top = self.thickness / 2, self.clearance + self.length + BASE
        return Shape(self._inside, (-half, self.clearance, -half), (half, top, half))

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names such as `row-1-front-left`."""
        return quarter_names(f"row-{row + 1}" for row in range(self.rows))

    @sampled_once
    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution."""
        sample = self.shape.sample(fidelity).of_volume(self.thickness**2 * (self.length + BASE))
        points, top = sample.points, self.clearance + self.length
        down = (top - points[:, 1]) / self.length
        row = np.clip(np.floor(down * self.rows), 0, self.rows - 1).astype(int)
        rows = np.eye(self.rows)[row] * (down > 0.0)[:, None]
        shares = np.einsum("nr,nq->nrq", rows, quarters(points)).reshape(len(points), -1)
        muscles, shares = with_base(self.muscles, shares, self.base_speed)
        return Body.of(
            sample,
            sample.mean(shares),
            muscles,
            head=sample.mostly((down > 1.0 - _TIP) & (points[:, 0] > 0.0)),
            tail=sample.mostly((down < 0.0) & (points[:, 0] < 0.0)),
            fibres=np.tile([0.0, 1.0, 0.0], (len(sample.positions), 1)),
            anchored=sample.mostly(down < 0.0),
            base_speed=self.base_speed,
        )

    def _inside(self, points: Array) -> Mask:
        return np.asarray(((points > self.shape.lower) & (points < self.shape.upper)).all(axis=1))
