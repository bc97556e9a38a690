"""Terms that mixtures punish, and no tasks by themselves, as less of them is better: power and sideways motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.tasks.base import Motion, Task
from zoobench.tasks.heading import direction

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True)
class MusclePower(Task):
    """The power that the muscles put into the body, averaged over the frames [W].

    Positive work counts, as in `actuation_energy`: a muscle that is stretched while it pulls gives nothing back.
    """

    unit: ClassVar[str] = "W"

    def reward(self, motion: Motion) -> "Tensor":
        """Positive work of all muscles in every frame by its length `[frames, worlds]` [W]."""
        return motion.muscle_work.clamp(min=0.0).sum(dim=2) / motion.frame_seconds

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """None: mixtures report the score."""
        return {}


@dataclass(frozen=True)
class SidewaysSpeed(Task):
    """The speed to the side of a direction, averaged over the frames [m/s].

    It is the size of the velocity that movement-speed has along the direction, across it and level: 0 of a robot that
    goes straight ahead, or back, and does not recoil from its own strokes.

    * `heading`: the direction as of movement-speed [degrees].
    """

    heading: float = 0.0
    unit: ClassVar[str] = "m/s"

    def reward(self, motion: Motion) -> "Tensor":
        """Size of the mean particle velocity across it at the end of every frame `[frames, worlds]` [m/s]."""
        across = direction(self.heading + 90.0, motion.velocities.dtype)
        return (motion.mean_over_existing(motion.velocities[1:]) * across).sum(dim=-1).abs()

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """None: mixtures report the score."""
        return {}
