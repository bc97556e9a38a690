"""The worlds behind an environment, simulated from the first episode on: the common part of one world and many."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import gymnasium
import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.free_cell import free_cell
from zoobench.cell.problem import Problem
from zoobench.cell.session import Session, Step, new_session, observation_model
from zoobench.cell.vector_parts import Action
from zoobench.errors import UsageError
from zoobench.gym.beginnings import Beginning, Beginnings
from zoobench.gym.channels import Channels, Floats
from zoobench.gym.drawn_physics import with_physics
from zoobench.render.pace import Pace
from zoobench.render.present import Present
from zoobench.render.viewpoint import View
from zoobench.spec import FRAME_SECONDS, Scalar
from zoobench.tasks.base import Task

if TYPE_CHECKING:
    from zoobench.render.live import LivePicture
    from zoobench.render.viewer import Viewer

METADATA: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": round(1.0 / FRAME_SECONDS)}
"""Metadata of every environment."""


class Worlds:
    """The worlds of an environment.

    To make them compiles and simulates nothing: it may be done in a process that is forked later.

    Args:
        problem: the cell.
        count: number of worlds.
        action: see `Channels`.
        beginnings: of its episodes.
        view: of the pictures.
        render_mode: None, `rgb_array`, or `human` for a page in the browser that shows the first world.

    Raises:
        UsageError: an option cannot be used.
    """

    _beginnings: Beginnings | None = None
    _is_shown = False

    def __init__(
        self,
        problem: Problem,
        count: int,
        action: Action,
        beginnings: Beginnings,
        view: View,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *METADATA["render_modes"]):
            raise UsageError(
                f"The render mode {render_mode!r} is not offered here. Choose {' or '.join(METADATA['render_modes'])}."
            )
        if problem.robot.space is not None:
            raise UsageError(f"The design {problem.spec.design.name!r} is a design space. Choose a fixed body.")
        self._problem = problem
        self._take(count, Channels(problem.body.muscle_count, observation_model(problem).layout, action))
        self._beginnings, self._view = beginnings, view
        self._is_shown = render_mode == "human"

    @classmethod
    def of(cls, session: Session, action: Action) -> Self:
        """The worlds of a session that is there already; they have no pictures."""
        made = cls.__new__(cls)
        made.session = session
        made._take(session.worlds, Channels(session.muscle_count, session.layout, action))
        return made

    def _take(self, count: int, channels: Channels) -> None:
        self.count, self.channels = count, channels
        self._begun = [Beginning()] * count
        self._pictures: dict[int, LivePicture] = {}
        self._viewer: Viewer | None = None
        self._pace = Pace()

    @cached_property
    def session(self) -> Session:
        """The session, which starts the simulator."""
        return new_session(self._problem, self.count, keeps_history=True)

    def physics(self, world: int) -> dict[str, Scalar]:
        """The parameters of the environment that were drawn for the episode of a world, by name."""
        return dict(self._begun[world].physics)

    def begin(self, generators: Sequence[np.random.Generator], worlds: Iterable[int] | None = None) -> Floats:
        """Begin episodes in these worlds, by default in all; inputs of the policy for all `[worlds, count]`.

        Args:
            generators: of each world.
        """
        chosen = list(range(self.count) if worlds is None else worlds)
        for world in chosen:
            if self._beginnings is not None:
                self._begun[world] = self._beginnings.draw(generators[world])
            if picture := self._pictures.pop(world, None):
                picture.close()
        begun = {world: self._begun[world] for world in chosen}
        if self._beginnings is not None and self._begun[0].physics:
            self._move_to(self._begun[0].physics, self._beginnings.physics.recurs)
        lead_ins = {world: each.lead_in for world, each in begun.items() if each.lead_in is not None}
        tasks = {world: each.task for world, each in begun.items() if each.task is not None}
        seen = self._inputs(self.session.begin(chosen, lead_ins=lead_ins, tasks=tasks))
        if self._is_shown and 0 in chosen:
            self._show_start()
        return seen

    def step(self, actions: Floats) -> tuple[Floats, Step]:
        """Simulate a control frame in every world; inputs of the policy `[worlds, count]` and the step's result.

        Raises:
            UsageError: actions of another shape or not finite, or an episode is over.
        """
        expected = (self.count, *self.channels.action_space.shape)
        if np.shape(actions) != expected:
            raise UsageError(f"Actions of shape {np.shape(actions)} were given; {expected} was expected.")
        step = self.session.step(self.channels.activity(actions, self._times()))
        if self._viewer is not None and self._viewer.is_watched:
            if self._viewer.is_due or step.terminated[0] or step.truncated[0]:
                self._viewer.show(Present.of(self.session))
            self._pace.wait(FRAME_SECONDS)
        return self._inputs(step.observations), step

    def picture(self, world: int) -> NDArray[np.uint8]:
        """A picture of a world as it is now `[height, width, 3]`.

        Raises:
            UsageError: the extra `render` is not installed, or the system has no OpenGL.
        """
        from zoobench.render.live import LivePicture

        present = Present.of(self.session, world)
        if world not in self._pictures:
            self._pictures[world] = LivePicture(self._problem, present.positions, self._task(world), self._view)
        return self._pictures[world].at(present)

    def close(self) -> None:
        """Close the pictures and the page."""
        while self._pictures:
            self._pictures.popitem()[1].close()
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None

    def _move_to(self, physics: Mapping[str, Scalar], recurs: bool) -> None:
        """Simulate in other physics from here on: a scene of its own, which comes to rest anew.

        That is for a single world, as all worlds of a solver share their scene. Physics that do not recur would fill
        the folder of scenes at rest.
        """
        self._problem = Problem(with_physics(self._problem.spec, physics), worlds=1)
        self.session = new_session(self._problem, 1, keeps_history=True, keeps_rest=recurs)

    def _show_start(self) -> None:
        """Show the start of the first world's episode on a page, whose address is said when it is opened."""
        from zoobench.render.viewer import Viewer

        if self._viewer is None:
            self._viewer = Viewer()
            gymnasium.logger.warn(f"Open {self._viewer.address} in a browser to watch.")
        self._viewer.begin(self._problem, Present.of(self.session), self._task(0))

    def _task(self, world: int) -> Task:
        """The task of a world's episode."""
        return self._begun[world].task or self._problem.task

    def _times(self) -> Array:
        """Times of the waves `[worlds]` [s]."""
        return self.session.times + [begun.time for begun in self._begun]

    def _inputs(self, observations: Array) -> Floats:
        return self.channels.inputs(observations, self._times())


def problem_of(env: str, design: str, task: str, fidelity: str, frames: int, worlds: int) -> Problem:
    """The problem of a cell with an unlimited budget; components are written as on the command line.

    Raises:
        UnknownNameError, UsageError, SceneError: the components are unknown or cannot be simulated.
    """
    if frames < 1 or worlds < 1:
        raise UsageError(f"Episodes of {frames} frames in {worlds} worlds are nothing. Give at least 1 of each.")
    return Problem(free_cell(env, task, design, fidelity, frames), worlds=worlds)


def refuse_options(options: object) -> None:
    """Refuse options of `reset`.

    Raises:
        UsageError: there is one.
    """
    if options:
        raise UsageError(
            f"reset takes no options, and {options!r} was given. The random parts of an episode are chosen when "
            "the environment is made: draw=('pose', 'phase', 'path') and physics={'friction': (0.2, 0.8)}."
        )


def outcome(step: Step, world: int) -> dict[str, Any]:
    """The entries of `info` for a world whose episode is over: score and metrics, or the reason of its failure."""
    if failure := step.failures.get(world):
        return {"failure": str(failure)}
    if evaluation := step.evaluations.get(world):
        metrics = {name: metric.value for name, metric in evaluation.metrics.items()}
        return {"score": evaluation.score, "metrics": metrics}
    return {}
