"""Shape: to take on given proportions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, Task, constant
from zoobench.tasks.extents import extent
from zoobench.tasks.readings import common_readings

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "shape", tags=("shape",))
@dataclass(frozen=True, kw_only=True)
class ShapeTask(Task):
    """Take on given proportions, and keep them.

    The error is the distance of the body's extents along x, y and z from the wanted ones, as that of two points [m].
    The score is by how much it is less than at the start, averaged over the frames [m]; the error at the start is the
    best possible. The extents are those of the bulk: 1 % of the matter at either end is disregarded.

    * `length`, `height`, `width`: wanted extents along x, y and z, relative to those at the start [-].
    """

    length: float = 0.9
    height: float = 1.1
    width: float = 1.0
    unit: ClassVar[str] = "m"

    def __post_init__(self) -> None:
        wanted = (self.length, self.height, self.width)
        if min(wanted) <= 0.0:
            raise UsageError(f"Proportions of {wanted} are those of no body. Give positive ones.")
        if wanted == (1.0, 1.0, 1.0):
            raise UsageError("A body has the proportions that it starts with. Give others: shape[length=0.8].")

    def reward(self, motion: Motion) -> "Tensor":
        """By how much the error is less than at the start, at the end of every frame `[frames, worlds]` [m]."""
        error = self._error(motion)
        return error[0] - error[1:]

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The error at the start and at the end, and the common readings."""
        error = self._error(motion)
        return {"first_error": (error[0], "m"), "final_error": (error[-1], "m"), **common_readings(motion)}

    def _error(self, motion: Motion) -> "Tensor":
        """Distance of the extents from the wanted ones in every state `[frames + 1, worlds]` [m]."""
        import torch

        extents = torch.stack([extent(motion, axis) for axis in range(3)], dim=-1)
        wanted = constant((self.length, self.height, self.width), extents.dtype) * extents[0]
        error: Tensor = torch.linalg.vector_norm(extents - wanted, dim=-1)
        return error
