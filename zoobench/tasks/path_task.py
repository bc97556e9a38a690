"""The common part of tasks with a target that moves along a path."""

from dataclasses import dataclass
from functools import cached_property

from zoobench.inputs import NO_FILE, InputFile
from zoobench.tasks.base import Route, Task
from zoobench.tasks.paths import Path, PathShape
from zoobench.tasks.target_file import FilePath


@dataclass(frozen=True, kw_only=True)
class PathTask(Task):
    """A task with one target.

    Attributes:
        path, speed, path_seed: of a path by formula, see `Path`.
        target: a file with a path instead, see `FilePath`; empty for none.

    Raises:
        UsageError: there is no such path.
    """

    path: PathShape = "arc"
    speed: float = 0.05
    path_seed: int = 0
    target: InputFile = NO_FILE

    def __post_init__(self) -> None:
        _ = self.route  # checks the path

    @cached_property
    def route(self) -> Path | FilePath:
        """The path of the target, relative to the robot's start."""
        return FilePath(self.target) if self.target else Path(self.path, self.speed, self.path_seed)

    @property
    def routes(self) -> tuple[Route, ...]:
        """The path of the target."""
        return (self.route,)
