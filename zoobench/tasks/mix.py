"""Mixtures: a weighted sum of the other tasks."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import add
from typing import TYPE_CHECKING, Any, ClassVar

from zoobench.errors import UsageError
from zoobench.inputs import NO_FILE, InputFile
from zoobench.registry import COMPOSED, Kind, register
from zoobench.tasks.base import Motion, Observed, ObservedPart, Route, Situation, Task
from zoobench.tasks.final_position import FinalPosition
from zoobench.tasks.movement_speed import MovementSpeed
from zoobench.tasks.paths import PathShape
from zoobench.tasks.penalties import MusclePower, SidewaysSpeed
from zoobench.tasks.readings import common_readings
from zoobench.tasks.turning import Turning
from zoobench.tasks.velocity_tracking import VelocityTracking
from zoobench.tasks.waypoint_following import WaypointFollowing

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.TASK, "mix", tags=("locomotion", COMPOSED), added=("target", "power", "sideways"))
@dataclass(frozen=True, kw_only=True)
class Mix(Task):
    """A weighted sum of other tasks, as in `mix[movement-speed=1,turning=0.2]`.

    Score, reward and objective are sums of weight times those of the tasks. These are in m/s (movement-speed, turning,
    velocity-tracking, sideways), in m (waypoint-following, final-position) or in W (power), so that a weight has the
    unit 1/(m/s), 1/m or 1/W and the sum has none. A negative weight punishes, as in `mix[movement-speed=1,power=-0.1]`.
    The score of every task with a weight is reported, too, in its unit.

    * `movement_speed`, `turning`, `velocity_tracking`, `waypoint_following`, `final_position`: the weights; one at
      least is not zero.
    * `power`: weight of the power that the muscles put into the body. Their positive work counts, as in the cost of
      transport: a muscle that is stretched while it pulls gives nothing back.
    * `sideways`: weight of the speed to the side of `heading`, which is 0 of straight motion.
    * `heading`: of movement-speed and sideways.
    * `path`, `speed`, `path_seed`, `target`: of velocity-tracking and waypoint-following.
    * `direction_weight`: of velocity-tracking.
    * `x`, `z`: of final-position.
    """

    movement_speed: float = 0.0
    turning: float = 0.0
    velocity_tracking: float = 0.0
    waypoint_following: float = 0.0
    final_position: float = 0.0
    heading: float = 0.0
    path: PathShape = "arc"
    speed: float = 0.05
    path_seed: int = 0
    target: InputFile = NO_FILE
    direction_weight: float = 0.9
    x: float = 0.1
    z: float = 0.0
    power: float = 0.0
    sideways: float = 0.0
    unit: ClassVar[str] = "1"

    def __post_init__(self) -> None:
        if not self.terms:
            raise UsageError("A mixture without weights has no score. Give some: mix[movement-speed=1,turning=0.2].")

    @cached_property
    def terms(self) -> dict[str, tuple[float, Task]]:
        """Weight and task by name, of all with a weight.

        Raises:
            UsageError: a task refuses its parameters.
        """
        route: dict[str, Any] = {name: getattr(self, name) for name in ("path", "speed", "path_seed", "target")}
        made: dict[str, Task] = {
            "movement_speed": MovementSpeed(heading=self.heading),
            "turning": Turning(),
            "velocity_tracking": VelocityTracking(**route, direction_weight=self.direction_weight),
            "waypoint_following": WaypointFollowing(**route),
            "final_position": FinalPosition(x=self.x, z=self.z),
            "power": MusclePower(),
            "sideways": SidewaysSpeed(heading=self.heading),
        }
        return {name: (getattr(self, name), task) for name, task in made.items() if getattr(self, name)}

    @property
    def routes(self) -> tuple[Route, ...]:
        """The paths of the targets of its tasks."""
        return tuple(route for _, task in self.terms.values() for route in task.routes)

    @property
    def observed_parts(self) -> Mapping[str, ObservedPart]:
        """The parts of the observations that its tasks add."""
        return {
            f"{name}_{part}": told
            for name, (_, task) in self.terms.items()
            for part, told in getattr(task, "observed_parts", {}).items()
        }

    def observed(self, situation: Situation) -> Mapping[str, "Tensor"]:
        """The observations that its tasks add, each under the task's name."""
        return {
            f"{name}_{part}": values
            for name, (_, task) in self.terms.items()
            if isinstance(task, Observed)
            for part, values in task.observed(situation).items()
        }

    def reward(self, motion: Motion) -> "Tensor":
        """The weighted sum of the rewards `[frames, worlds]` [-]."""
        return reduce(add, [weight * task.reward(motion) for weight, task in self.terms.values()])

    def score(self, motion: Motion) -> "Tensor":
        """The weighted sum of the scores `[worlds]` [-]."""
        return reduce(add, [weight * task.score(motion) for weight, task in self.terms.values()])

    def objective(self, motion: Motion) -> "Tensor":
        """The weighted sum of the objectives `[worlds]` [-]."""
        return reduce(add, [weight * task.objective(motion) for weight, task in self.terms.values()])

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """The score of every task with a weight, by its name, and the common readings."""
        scores = {name: (task.score(motion), task.unit) for name, (_, task) in self.terms.items()}
        return {**scores, **common_readings(motion)}
