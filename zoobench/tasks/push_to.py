"""Push to: bring an object to a place (planar pushing of SoMoGym, Graule et al. 2022)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.errors import UsageError
from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion, ObservedPart, Situation, constant
from zoobench.tasks.object_readings import OBJECT_PARTS, object_seen, object_way
from zoobench.tasks.object_task import ObjectTask

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "push-to", version=2, tags=("object", "final"))
@dataclass(frozen=True, kw_only=True)
class PushTo(ObjectTask):
    """Bring an object to a place by the end of the episode.

    The reward of a frame is by how much the horizontal distance from the object's centre of mass to the place has
    fallen since the start [m]; the score is that of the last frame. At the place it is the distance at the start; a
    robot at rest scores zero, unless the object moves by itself.

    A closed loop observes the object's place, velocity and axes, relative to the robot, and the place relative to the
    object.

    * `x`, `z`: the place, from the object's centre at the start [m]; x is ahead of the robot at rest, z to its right.
    """

    x: float = 0.1
    z: float = 0.0
    unit: ClassVar[str] = "m"
    observed_parts: ClassVar[Mapping[str, ObservedPart]] = {
        **OBJECT_PARTS,
        "target_position": ObservedPart("body lengths", "from the object's centre: ahead, right"),
    }

    def __post_init__(self) -> None:
        if not (self.x or self.z):
            raise UsageError("The object begins at x = 0 and z = 0, and cannot be brought there. Give another x or z.")

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """The object, and the place relative to its centre [body lengths], ahead and right."""
        thing = situation.object
        away = thing.start + constant((self.x, 0.0, self.z), thing.start.dtype) - thing.centre
        return {**object_seen(situation), "target_position": situation.components(away) / situation.length}

    def reward(self, motion: Motion) -> "Tensor":
        """Fall of the horizontal distance to the place until the end of every frame `[frames, worlds]` [m]."""
        import torch

        way = object_way(motion)
        place = constant((self.x, 0.0, self.z), way.dtype)
        left = torch.linalg.vector_norm((place - way)[..., [0, 2]], dim=-1)
        fall: Tensor = torch.linalg.vector_norm(place) - left
        return fall
