"""A film of one episode, simulated again: where everything is at its moments, as plain data."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.episode import Episode, Evaluation
from zoobench.cell.problem import Problem
from zoobench.designs.feasibility import SOLID
from zoobench.errors import DivergenceError, UsageError
from zoobench.spec import FRAME_SECONDS, RunSpec

if TYPE_CHECKING:
    from zoobench.designs.base import Body
    from zoobench.sim.model.scene import Scene
    from zoobench.tasks.paths import Path as Route

Places = NDArray[np.float32]

_LARGEST = 4 * 2**30
"""Bytes that the positions of a film may take."""


@dataclass(frozen=True)
class Film:
    """An episode, at some of the boundaries of its control frames, here called moments.

    Attributes:
        spec: what was simulated.
        evaluation: what it scored.
        scene: its matter and ground; the positions in it are those before it came to rest.
        body: the robot at rest in its own frame, as it was simulated.
        particle_edge: edge of the cube that a particle stands for [m].
        lattice: edge of the cubic lattice whose points the robot's particles are, or some of them [m].
        kept: `[moments]` which boundaries, counted in control frames from the start.
        times: `[moments]` since the episode began [s].
        robot: `[moments, robot_count, 3]` where the robot's particles are [m].
        medium: `[moments, medium_count, 3]` where the medium's are [m], without those whose place the robot takes; none
            on bare ground.
        activity: `[moments, muscle_count]` of every muscle in the frame that ends then, in [-1, 1]; 0 at the start.
        centre: `[frames + 1, 3]` the robot's centre of mass at all boundaries, kept or not [m].
        target: `[frames + 1, 3]` where the target is then [m]; None if the task has none that moves.
    """

    spec: RunSpec
    evaluation: Evaluation
    scene: "Scene"
    body: "Body"
    particle_edge: float
    lattice: float
    kept: NDArray[np.int64]
    times: Array
    robot: Places
    medium: Places
    activity: Array
    centre: Array
    target: Array | None

    @property
    def solid(self) -> NDArray[np.bool_]:
        """Whether a robot particle is there `[robot_count]`: the others are empty space of a design."""
        return self.body.occupancy > SOLID

    @property
    def activation(self) -> Array:
        """Of every robot particle, by its share of each muscle `[moments, robot_count]`; above 0 it contracts."""
        found: Array = self.activity @ self.body.muscle_membership.T
        return found


def film(
    spec: RunSpec,
    params: Sequence[float],
    *,
    moments: Sequence[int] | None = None,
    progress: Callable[[int], None] | None = None,
) -> Film:
    """Simulate the episode of a solution again.

    Args:
        spec: of the run that found the parameters.
        params: `[parameter_count]` of controller and design.
        moments: those to keep, counted in control frames from the start (0), in rising order; all if None.
        progress: called with the number of control frames simulated so far.

    Raises:
        UnknownNameError, UsageError: the spec or the parameters are not of this zoobench, or the film is too large.
        DivergenceError: the episode blows up, which it did not when it was scored.
    """
    problem = Problem(spec, worlds=1)
    if len(params) != problem.parameter_count:
        raise UsageError(
            f"The stored solution has {len(params)} parameters, and {spec.controller} with {spec.design} now takes "
            f"{problem.parameter_count}. Do the run again with this version."
        )
    kept = np.arange(spec.frames + 1) if moments is None else np.asarray(moments)
    places, frame = _room(len(kept), problem.scene.particle_count), 0
    rows = {kept_frame: row for row, kept_frame in enumerate(kept.tolist())}

    def watch(place: Array) -> None:
        nonlocal frame
        if frame in rows:
            places[rows[frame]] = place
        if progress is not None:
            progress(frame)
        frame += 1

    problem.prepare()
    episode = problem.observe(np.asarray(params), watch=watch)
    if episode.evaluation.failure is not None:
        raise DivergenceError(episode.evaluation.failure)
    return _film(problem, episode, places, kept)


def evenly(frames: int, count: int) -> list[int]:
    """At most `count` moments of an episode, the start and the end among them."""
    found: list[int] = np.unique(np.linspace(0, frames, count).round().astype(int)).tolist()
    return found


def _there(scene: "Scene", occupancy: Array) -> NDArray[np.bool_]:
    """Whether a medium particle has most of its place `[particle_count]`: in a design space the robot may have it."""
    from zoobench.sim.model.state import medium_share

    if scene.medium is None:
        return np.zeros(0, bool)
    found: NDArray[np.bool_] = medium_share(scene.medium, occupancy[None])[0] > 0.5
    return found


def _room(moments: int, particle_count: int) -> Places:
    """Room for all that is kept `[moments, particle_count, 3]`.

    Raises:
        UsageError: no computer is meant to hold so much.
    """
    size = 12 * moments * particle_count
    if size > _LARGEST:
        raise UsageError(
            f"{moments} moments of {particle_count:,} particles take {size / 2**30:.0f} GiB, and "
            f"{_LARGEST // 2**30} GiB are the most. Keep fewer: --every {2 * -(-size // _LARGEST)}."
        )
    return np.zeros((moments, particle_count, 3), np.float32)


def _film(problem: Problem, episode: Episode, places: Places, kept: NDArray[np.int64]) -> Film:
    robot_count, occupancy = problem.scene.robot.particle_count, episode.body["occupancy"]
    centre = episode.motion.centre_of_mass()[:, 0].detach().numpy()
    route: Route | None = getattr(problem.task, "route", None)
    clock = np.arange(problem.spec.frames + 1, dtype=np.float64) * FRAME_SECONDS
    fidelity = problem.fidelity
    return Film(
        spec=problem.spec,
        evaluation=episode.evaluation,
        scene=problem.scene,
        body=replace(problem.body, occupancy=occupancy, muscle_membership=episode.body["muscle_membership"]),
        particle_edge=fidelity.particle_edge,
        lattice=fidelity.grid_spacing / np.ceil(fidelity.particles_per_cell ** (1 / 3) - 1e-9),
        kept=kept,
        times=clock[kept],
        robot=places[:, :robot_count],
        medium=places[:, robot_count:][:, _there(problem.scene, occupancy)],
        activity=np.vstack([np.zeros_like(episode.actuation[:1]), episode.actuation])[kept],
        centre=centre,
        target=None if route is None else centre[0] + route.positions(clock),
    )
