"""The present moment of an episode that is being simulated, as the data of pictures."""

from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.cell.session import Session
from zoobench.render.recording import BodyPlaces, Recording, target_path, vorticity
from zoobench.render.viewpoint import Region, region_of
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Task

_REACH = 1.0  # of the ground that is drawn on every side of a robot on bare ground [body lengths]


class Present(NamedTuple):
    """A world at a moment of its episode.

    Attributes:
        seconds: since its start [s].
        positions: of all particles, the robot's first `[particle_count, 3]` [m].
        activity: of the muscles in the frame that ends then `[muscle_count]`, in [-1, 1].
        flow: velocity of water on a grid, see `Solver.flow`.
        offset: how far the arena has moved after the robot `[3]` [m].
    """

    seconds: float
    positions: Array
    activity: Array
    flow: Array | None = None
    offset: Array = np.zeros(3)

    @classmethod
    def of(cls, session: Session, world: int = 0) -> Self:
        """A world of a session as it is now."""
        return cls(
            float(session.times[world]),
            session.positions(world),
            session.activity(world),
            session.flow(world),
            session.offset(world),
        )


class LiveWorld:
    """A world that is being simulated: a recording of one moment, which each next one overwrites.

    Args:
        problem: the cell.
        positions: of all particles at the start of the episode, the robot's first `[particle_count, 3]` [m].
        task: of the episode, whose target is drawn.

    Attributes:
        recording: its `centre` and `target` are those of all control frames; that of the future is the present one.
        frame: the present control frame, counted from the start.
        activation: of every robot particle, by its share of each muscle `[robot_count]`; positive contracts.
    """

    def __init__(self, problem: Problem, positions: Array, task: Task) -> None:
        frames, body = problem.spec.frames, problem.body
        places = BodyPlaces.of(problem.scene, positions[None].astype(np.float32))
        masses = body.masses(1.0)
        self._weights, self._spacing = masses / masses.sum(), problem.fidelity.grid_spacing
        centre = self._weights @ positions[: len(masses)]
        nx, _, nz = problem.scene.cells(self._spacing)
        self.frame, self.activation = 0, np.zeros(len(masses))
        self.recording = Recording(
            scene=problem.scene,
            body=body,
            particle_edge=problem.fidelity.particle_edge,
            times=np.zeros(1),
            robot=places.robot,
            objects=places.objects,
            medium=places.medium,
            centre=np.tile(centre, (frames + 1, 1)),
            target=target_path(task, centre, frames),
            vorticity=None if problem.scene.water is None else np.zeros((1, nx + 1, nz + 1)),
            offsets=np.zeros((1, 3)),
        )

    @property
    def offset(self) -> Array:
        """How far the arena has moved after the robot `[3]` [m]."""
        assert self.recording.offsets is not None
        found: Array = self.recording.offsets[0]
        return found

    @property
    def moved(self) -> Array:
        """How far the robot's centre of mass is from where it began `[3]` [m]."""
        found: Array = self.recording.centre[self.frame] - self.recording.centre[0]
        return found

    @property
    def region(self) -> Region:
        """The region that is drawn: as of a film, but on bare ground with space for the robot to move."""
        region = region_of(self.recording)
        if not self.recording.scene.is_bare:
            return region
        room = np.array([1.0, 0.0, 1.0]) * _REACH * float(np.ptp(self.recording.body.positions[:, 0]))
        return replace(region, low=region.low - room, high=region.high + room)

    def take(self, present: Present) -> None:
        """Go on to a moment of the episode."""
        recording = self.recording
        places = BodyPlaces.of(recording.scene, present.positions[None].astype(np.float32))
        self.frame = round(present.seconds / FRAME_SECONDS)
        self.activation[:] = recording.body.muscle_membership @ present.activity
        self.offset[:] = present.offset
        recording.robot[0], recording.medium[0] = places.robot[0], places.medium[0]
        for name, place in places.objects.items():
            recording.objects[name][0] = place[0]
        recording.centre[self.frame :] = self._weights @ present.positions[: len(self._weights)]
        if recording.vorticity is not None and present.flow is not None:
            recording.vorticity[0] = vorticity(present.flow, self._spacing)
