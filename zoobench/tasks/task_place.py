"""What a task may ask of the environment and the design of a cell, before anything is simulated."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TaskPlace:
    """Where a robot has a task.

    Attributes:
        object_place: of the objects, one of `zoobench.envs.objects.Place`; empty without any.
        is_thrown: whether they begin with a velocity.
        is_raised: whether they begin above the ground, on an obstacle.
        is_flat: whether the robot stands on level ground with nothing on it.
        is_deep: whether water surrounds the robot.
        is_held: whether it hangs from a base that stays where it is.
        is_moved: whether it hangs from a base that moves.
    """

    object_place: str = ""
    is_thrown: bool = False
    is_raised: bool = False
    is_flat: bool = False
    is_deep: bool = False
    is_held: bool = False
    is_moved: bool = False
