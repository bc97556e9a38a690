"""Robots that are watched in a browser: moved by hand, by a trained gait, or by the best gait of a run that goes on."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from zoobench.arrays import Array
from zoobench.cell.free_cell import driver_of, has_gait
from zoobench.cell.problem import Problem
from zoobench.cell.session import Step, new_session
from zoobench.render.pace import Pace, Throttle
from zoobench.render.panel import Panel
from zoobench.render.present import Present
from zoobench.render.viewer import Viewer
from zoobench.spec import FRAME_SECONDS, RunSpec
from zoobench.tasks.quantities import quantity_of

Check = Callable[[], None]
"""Called in every control frame, and while nothing is simulated; it may raise KeyboardInterrupt."""

_STATES = 5.0  # times that the panel tells how it goes, at most [1/s]


@dataclass(frozen=True)
class Watched:
    """A robot that is to be watched.

    Attributes:
        cell: see `zoobench.cell.free_cell`; its body is fixed.
        words: its description, for people.
    """

    cell: RunSpec
    words: str


def watch(viewer: Viewer, newest: Callable[[], Watched | None], tell: Callable[[str], None], check: Check) -> int:
    """Simulate a robot for its viewers until KeyboardInterrupt; returns the number of control frames.

    Time passes while somebody has the page open.

    Args:
        viewer: on which it is shown.
        newest: the robot to be watched from now on, asked between two episodes; None while there is none.
        tell: called with the page's address, and then with the score of each episode that ends, or why it failed.
        check: see `Check`.

    Raises:
        UnknownNameError, UsageError, SceneError: the robot cannot be simulated.
    """
    shown: _Shown | None = None
    panel = Panel(viewer.server.gui, (), is_trained=False)
    frames, is_told = 0, False
    panel.entitle("One moment: the robot is being made.")
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            check()
            fresh = newest()
            if fresh is not None and (shown is None or fresh != shown.watched):
                shown = _Shown(fresh)
                panel = shown.panel(viewer, panel)
            if not is_told:  # a robot that cannot be watched has been reported by now
                is_told = True
                tell(f"Open {viewer.address} in a browser; Ctrl-C ends it.")
            if shown is None:
                panel.entitle("Nothing has been found yet.")
                Pace().rest()
                continue
            for step in shown.episode(viewer, panel, check):
                frames += 1
                for said in shown.said(step):
                    tell(said)
    return frames


class _Shown:
    """A robot while it is watched."""

    def __init__(self, watched: Watched) -> None:
        self.watched, self.problem = watched, Problem(watched.cell, worlds=1)
        self._is_trained = has_gait(watched.cell)
        self._drive = driver_of(self.problem) if self._is_trained else None
        self._session = new_session(self.problem, keeps_history=True)
        self._last = ""

    def panel(self, viewer: Viewer, panel: Panel) -> Panel:
        """The panel that steers it: the present one, if it can."""
        muscles = tuple(self.problem.body.muscles)
        if (panel.muscles, panel.is_trained) != (muscles, self._is_trained):
            panel = Panel(viewer.server.gui, muscles, self._is_trained)
        panel.entitle(f"**{self.watched.words}**")
        return panel

    def episode(self, viewer: Viewer, panel: Panel, check: Check) -> Iterator[Step]:
        """Simulate an episode frame by frame, until it ends or somebody wants to start again."""
        session, clock, states = self._session, Pace(), Throttle(_STATES)
        panel.wants_again()
        seen = session.begin()
        viewer.begin(self.problem, Present.of(session), self.problem.task)
        is_over = False
        while not (is_over or panel.wants_again()):
            check()
            if panel.is_paused or not viewer.is_watched:
                clock.rest()
                continue
            step = session.step(self._activity(panel, seen)[None])
            seen, is_over = step.observations, bool(step.terminated[0] or step.truncated[0])
            if is_over or viewer.is_due:
                viewer.show(Present.of(session))
            if is_over or states.is_due():
                panel.tell(self._state(viewer), session.activity(0))
            yield step
            clock.wait(FRAME_SECONDS / panel.speed)

    def said(self, step: Step) -> Iterator[str]:
        """The messages about a step: the score of an episode that it ends, or why it failed."""
        for failure in step.failures.values():
            self._last = "failed"
            yield str(failure)
        for evaluation in step.evaluations.values():
            self._last = quantity_of(self.problem.spec.task).text(evaluation.score)
            yield self._last

    def _activity(self, panel: Panel, seen: Array) -> Array:
        """Activity of the muscles in the next frame, by hand or by the gait `[muscle_count]`."""
        if self._drive is None or panel.is_by_hand:
            return panel.activity
        return self._drive(round(float(self._session.times[0]) / FRAME_SECONDS), seen[0])

    def _state(self, viewer: Viewer) -> str:
        """How the episode goes."""
        length = self.problem.spec.frames * FRAME_SECONDS
        now = f"{float(self._session.times[0]):.2f} s of {length:.2f} s, {100 * viewer.moved:.1f} cm from its start"
        return f"{now}  \nlast episode: {self._last}" if self._last else now
