"""Growing: higher, longer, or over more ground."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, Task
from zoobench.tasks.extents import covered_area, extent
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


class _Growth(Task):
    """Growth of a size of the body over that at the start."""

    @abstractmethod
    def _size(self, motion: Motion) -> "Tensor":
        """The size in every state `[frames + 1, worlds]`."""

    def reward(self, motion: Motion) -> "Tensor":
        """The size at the end of every frame less that at the start `[frames, worlds]`."""
        size = self._size(motion)
        return size[1:] - size[0]

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The greatest growth and that at the end, and the common readings."""
        growth = self.reward(motion)
        return {
            "greatest_growth": (growth.amax(dim=0), self.unit),
            "final_growth": (growth[-1], self.unit),
            **common_readings(motion),
        }


@register(Kind.TASK, "height", tags=("shape",))
@dataclass(frozen=True, kw_only=True)
class Height(_Growth):
    """Be higher than at the start, however.

    The score is the growth of the body's extent along y over that at the start, averaged over the frames [m]: it counts
    to grow soon and to stay so, and a jump does not. The extent is that of the bulk: 1 % of the matter at either end
    is disregarded.
    """

    unit: ClassVar[str] = "m"

    def _size(self, motion: Motion) -> "Tensor":
        return extent(motion, axis=1)


@register(Kind.TASK, "span", tags=("shape",))
@dataclass(frozen=True, kw_only=True)
class Span(_Growth):
    """Be longer than at the start, along the direction ahead.

    The score is the growth of the body's extent along x over that at the start, averaged over the frames [m]. The
    extent is that of the bulk: 1 % of the matter at either end is disregarded.
    """

    unit: ClassVar[str] = "m"

    def _size(self, motion: Motion) -> "Tensor":
        return extent(motion, axis=0)


@register(Kind.TASK, "area", tags=("shape",), added=("shrink",))
@dataclass(frozen=True, kw_only=True)
class Area(_Growth):
    """Cover more ground than at the start, or less.

    The score is the growth of the horizontal area that the body covers over that at the start, averaged over the frames
    [m^2]. The area is that of the rectangle with the same moments, 12 sqrt(det C) with the covariance C of x and z by
    occupancy, so that turning does not change it.

    * `shrink`: whether less is better: what counts is by how much the area has fallen.
    """

    shrink: bool = False
    unit: ClassVar[str] = "m^2"

    def _size(self, motion: Motion) -> "Tensor":
        area = covered_area(motion)
        return -area if self.shrink else area
