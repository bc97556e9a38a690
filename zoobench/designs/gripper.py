"""The gripper: fingers of muscle that hang from a base that is held."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body, check_size, sampled_once
from zoobench.designs.quarters import BASE, check_base_speed, with_base
from zoobench.designs.sampling import Shape
from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_ROWS = 2
_TIP = 0.25
"""Share of a finger's length that is its tip."""


@register(Kind.DESIGN, "gripper", tags=("land", "anchored", "gripper"))
@dataclass(frozen=True, kw_only=True)
class Gripper:
    """Fingers that hang from a base and close about what is between them.

    The base is held where it is, or moves. Every finger has two rows of muscles along it, inside and outside: it closes
    where the inner ones contract. Two fingers are before and behind each other; three and four are around a circle, the
    first ahead.

    * `fingers`: 2, 3 or 4.
    * `length`: of a finger [m].
    * `thickness`: of a finger, square [m]; it needs four cells to grip.
    * `opening`: between fingers that face each other, or within the circle of their inner sides [m].
    * `clearance`: below the fingers [m].
    * `base_speed`: of the base at full activity of its channels, which move it ahead, up and to the right [m/s]; 0
      where it is held.
    """

    fingers: int = 2
    length: float = 0.09
    thickness: float = 0.035
    opening: float = 0.07
    clearance: float = 0.012
    base_speed: float = 0.0

    def __post_init__(self) -> None:
        check_size("finger", self.length, self.thickness, self.thickness)
        check_base_speed(self.base_speed)
        if self.fingers not in (2, 3, 4) or not 0.0 < self.opening < np.inf or not 0.0 <= self.clearance < np.inf:
            raise UsageError(
                f"A gripper with {self.fingers} fingers, an opening of {self.opening:g} m and a clearance of "
                f"{self.clearance:g} m is not offered. Give 2 to 4 fingers, a positive opening and a clearance of 0 or "
                "more."
            )
        if self.fingers > 2 and self.opening < self.thickness:
            raise UsageError(
                f"{self.fingers} fingers of {self.thickness:g} m overlap about an opening of {self.opening:g} m. Give "
                f"an opening of {self.thickness:g} m or more."
            )

    @property
    def _reach(self) -> float:
        """From the axis to the outer sides of the fingers [m]."""
        return self.opening / 2 + self.thickness

    @property
    def _side(self) -> float:
        """Half the width of the base [m]."""
        return self.thickness / 2 if self.fingers == 2 else self._reach

    @property
    def _ceiling(self) -> float:
        """Height of the underside of the base [m]."""
        return self.clearance + self.length

    @cached_property
    def _directions(self) -> Array:
        """Unit vectors along x and z from the axis to the fingers `[fingers, 2]`."""
        angles = 2.0 * np.pi * np.arange(self.fingers) / self.fingers
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)

    @cached_property
    def shape(self) -> Shape:
        """The solid with its base, a block over all fingers."""
        reach, side = self._reach, self._side
        return Shape(self._inside, (-reach, self.clearance, -side), (reach, self._ceiling + BASE, side))

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names such as `finger-1-row-1-inside`, rows from the base to the tip."""
        return tuple(
            f"finger-{finger + 1}-row-{row + 1}-{side}"
            for finger in range(self.fingers)
            for row in range(_ROWS)
            for side in ("inside", "outside")
        )

    @sampled_once
    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution."""
        fingers, side = self.fingers * self.thickness**2 * self.length, self._side
        sample = self.shape.sample(fidelity).of_volume(fingers + 4.0 * self._reach * side * BASE)
        points = sample.points
        out, aside = self._along(points)
        finger = np.eye(self.fingers)[(np.abs(aside) - out).argmin(axis=1)]
        down = (self._ceiling - points[:, 1]) / self.length
        row = np.eye(_ROWS)[np.clip(np.floor(down * _ROWS), 0, _ROWS - 1).astype(int)] * (down > 0.0)[:, None]
        middle = (self.opening + self.thickness) / 2
        inside = (finger * out).sum(axis=1) < middle
        sides = np.stack([inside, ~inside], axis=1)
        shares = np.einsum("nf,nr,ns->nfrs", finger, row, sides).reshape(len(points), -1)
        tip = down > 1.0 - _TIP
        muscles, shares = with_base(self.muscles, shares, self.base_speed)
        return Body.of(
            sample,
            sample.mean(shares),
            muscles,
            head=sample.mostly(tip & (points[:, 0] > 0.0)),
            tail=sample.mostly(tip & (points[:, 0] < 0.0)),
            fibres=np.tile([0.0, 1.0, 0.0], (len(sample.positions), 1)),
            anchored=sample.mostly(down < 0.0),
            base_speed=self.base_speed,
        )

    def _along(self, points: Array) -> tuple[Array, Array]:
        """Distances of points `[n, 3]` from the axis along each finger's direction and across it `[n, fingers]` [m]."""
        level = points[:, [0, 2]]
        return level @ self._directions.T, level @ np.stack([-self._directions[:, 1], self._directions[:, 0]])

    def _inside(self, points: Array) -> Mask:
        out, aside = self._along(points)
        within = (out > self.opening / 2) & (out < self._reach) & (np.abs(aside) < self.thickness / 2)
        x, y, z = np.abs(points[:, 0]), points[:, 1], np.abs(points[:, 2])
        base = (x < self._reach) & (z < self._side) & (y >= self._ceiling) & (y < self._ceiling + BASE)
        return np.asarray(base | (within.any(axis=1) & (y > self.clearance) & (y < self._ceiling)))
