"""The film of an episode: the episode simulated again, as plain data."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.episode import Episode, Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import DivergenceError, UsageError
from zoobench.render.recording import BodyPlaces, Positions, Recording, target_path, vorticity
from zoobench.spec import FRAME_SECONDS, RunSpec

_LARGEST = 4 * 2**30
"""Bytes that the positions of a film may take."""


@dataclass(frozen=True, kw_only=True)
class Film(Recording):
    """An episode at some of the boundaries of its control frames, here called moments.

    `centre` and `target` are those of all boundaries `[frames + 1, 3]`.

    Attributes:
        spec: of the run or cell that was simulated.
        evaluation: its score and values.
        kept: `[moments]` the boundaries of the moments, counted in control frames from the start.
        activity: `[moments, muscle_count]` of every muscle in the frame that ends then, in [-1, 1]; 0 at the start.
    """

    spec: RunSpec
    evaluation: Evaluation
    kept: NDArray[np.int64]
    activity: Array

    @property
    def activation(self) -> Array:
        """Activation of robot particles by their shares of muscles `[moments, robot_count]`; positive contracts."""
        return self.activity @ self.body.muscle_membership.T


def film(
    spec: RunSpec,
    params: Sequence[float],
    *,
    moments: Sequence[int] | None = None,
    progress: Callable[[int], None] = lambda _: None,
) -> Film:
    """Simulate the episode of a solution again.

    Args:
        spec: of the run whose solution this is.
        params: `[parameter_count]` of controller and design.
        moments: those to keep, counted in control frames from the start (0), in ascending order; all if None.
        progress: called with the number of control frames simulated so far.

    Raises:
        UnknownNameError, UsageError: this version has other components or parameters, or the film is too large.
        DivergenceError: the episode diverges, which it did not when it was scored.
    """
    problem = Problem(spec, worlds=1)
    if len(params) != problem.parameter_count:
        raise UsageError(
            f"The stored solution has {len(params)} parameters, and {spec.controller} with {spec.design} now takes "
            f"{problem.parameter_count}. Do the run again with this version."
        )
    kept = np.arange(spec.frames + 1) if moments is None else np.asarray(moments)
    reel = _Reel(kept, problem.fidelity.grid_spacing, progress)
    episode = problem.episode(np.asarray(params), watch=reel.take)
    if episode.evaluation.failure is not None:
        raise DivergenceError(episode.evaluation.failure)
    return _film(problem, episode, reel)


def evenly(frames: int, count: int) -> list[int]:
    """At most `count` moments of an episode, the start and the end among them."""
    found: list[int] = np.unique(np.linspace(0, frames, count).round().astype(int)).tolist()
    return found


class _Reel:
    """The recorder of an episode while it is simulated.

    Args:
        kept: the moments, counted in control frames.
        spacing: of the grid [m].
        progress: called with the number of control frames simulated so far.

    Attributes:
        places: positions of all particles `[moments, particle_count, 3]` [m].
        vorticity: of water on a grid, an array for each moment so far.
    """

    def __init__(self, kept: NDArray[np.int64], spacing: float, progress: Callable[[int], None]) -> None:
        self.kept = kept
        self.places: Positions = np.zeros((0, 0, 3), np.float32)
        self.vorticity: list[Array] = []
        self._spacing, self._progress, self._frame = spacing, progress, 0
        self._rows = {frame: row for row, frame in enumerate(kept.tolist())}

    def take(self, place: Array, flow: Array | None) -> None:
        """Keep a moment if it is one of them; see `zoobench.cell.episode_runner.Watch`."""
        if not self._frame:
            self.places = _allocate(self.kept, len(place))
        if self._frame in self._rows:
            self.places[self._rows[self._frame]] = place
            if flow is not None:
                self.vorticity.append(vorticity(flow, self._spacing))
        self._progress(self._frame)
        self._frame += 1


def _allocate(kept: NDArray[np.int64], particle_count: int) -> Positions:
    """An array for the positions `[moments, particle_count, 3]` at the frames that are kept `[moments]`.

    Raises:
        UsageError: it would be larger than `_LARGEST`.
    """
    moments = len(kept)
    size = 12 * moments * particle_count
    if size > _LARGEST:
        every = int(np.diff(kept).max(initial=1)) * 2 * -(-size // _LARGEST)
        raise UsageError(
            f"{moments} moments of {particle_count:,} particles take {size / 2**30:.0f} GiB, and "
            f"{_LARGEST // 2**30} GiB are the most. Keep fewer, as `zoobench render --every {every}` does."
        )
    return np.zeros((moments, particle_count, 3), np.float32)


def _film(problem: Problem, episode: Episode, reel: _Reel) -> Film:
    record, kept = episode.record, reel.kept
    centre = record.motion.centre_of_mass()[:, 0].detach().numpy()
    places = BodyPlaces.of(record.scene, reel.places)
    return Film(
        spec=problem.spec,
        evaluation=episode.evaluation,
        scene=record.scene,
        body=record.body,
        particle_edge=problem.fidelity.particle_edge,
        kept=kept,
        times=kept.astype(np.float64) * FRAME_SECONDS,
        robot=places.robot,
        objects=places.objects,
        medium=places.medium,
        vorticity=np.array(reel.vorticity) if reel.vorticity else None,
        activity=np.vstack([np.zeros_like(record.actuation[:1]), record.actuation])[kept],
        centre=centre,
        target=target_path(problem.task, centre[0], problem.spec.frames),
        offsets=record.offsets[kept],
    )
