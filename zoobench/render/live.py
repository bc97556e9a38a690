"""Pictures of an episode while it is simulated."""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.render.actors import PATH, TARGET, put_ground, put_medium, put_paths
from zoobench.render.canvas import Canvas, Image
from zoobench.render.film_files import put_active_robot
from zoobench.render.recording import Recording, target_path, vorticity
from zoobench.render.viewpoint import Region, camera_for, region_of
from zoobench.render.vortices import put_water
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Task

_SIZE = (640, 360)  # [pixels]
_REACH = 1.0  # of the ground that is drawn on every side of a robot on bare ground [body lengths]
_WAY = 1.0  # [m] of ground that is drawn on every side where the arena, and the camera with it, follows the robot


class LivePicture:
    """The picture of one world, drawn anew at every moment; it must be closed.

    Args:
        problem: the cell.
        positions: of all particles at the start of the episode, the robot's first `[particle_count, 3]` [m].
        task: of the episode, whose target is drawn.

    Raises:
        UsageError: the extra `render` is not installed, or the system has no OpenGL.
    """

    def __init__(self, problem: Problem, positions: Array, task: Task) -> None:
        self._recording = recording = _recording(problem, positions, task)
        self._length, self._spacing = problem.spec.frames * FRAME_SECONDS, problem.fidelity.grid_spacing
        self._weights = recording.body.masses(1.0) / recording.body.masses(1.0).sum()
        self._kept = np.zeros(1, np.int64)
        self._activation = np.zeros((1, recording.body.particle_count))
        region = _region(recording)
        camera = camera_for(region, _SIZE[0] / _SIZE[1])
        self._canvas = canvas = Canvas(*_SIZE)
        way = np.array([_WAY, 0.0, _WAY]) * recording.scene.follows
        put_ground(canvas, replace(region, low=region.low - way, high=region.high + way), camera.towards)
        self._updates = [
            put_medium(canvas, region, _SIZE[1] / 2 / camera.half_height),
            put_water(canvas, recording),
            put_active_robot(canvas, region, self._activation),
            put_paths(canvas, recording, self._kept, camera.towards),
        ]
        spec = problem.spec
        canvas.text(f"{spec.design.name} in {spec.env.name}: {spec.task.name}", 0.02, 0.93, size=1.15)
        self._clock = canvas.text("", 0.02, 0.87)
        canvas.text("centre of mass and its path", 0.02, 0.07, colour=PATH)
        if recording.target is not None:
            canvas.text("target and its path", 0.02, 0.02, colour=TARGET)
        self._camera = camera
        canvas.aim(camera)

    def at(
        self, seconds: float, positions: Array, activity: Array, flow: Array | None = None, offset: Array | None = None
    ) -> Image:
        """The picture at a moment of the episode.

        Args:
            seconds: since its start [s].
            positions: of all particles `[particle_count, 3]` [m].
            activity: of the muscles in the frame that ends then `[muscle_count]`, in [-1, 1].
            flow: velocity of water on a grid, see `Solver.flow`.
            offset: how far the arena has moved after the robot `[3]` [m].
        """
        recording, frame = self._recording, round(seconds / FRAME_SECONDS)
        count = recording.body.particle_count
        if recording.offsets is not None and offset is not None:
            recording.offsets[0] = offset
            self._canvas.aim(replace(self._camera, focus=self._camera.focus + offset))
        recording.robot[0] = positions[:count]
        recording.medium[0] = positions[count:]
        if recording.vorticity is not None and flow is not None:
            recording.vorticity[0] = vorticity(flow, self._spacing)
        recording.centre[frame:] = self._weights @ positions[:count]
        self._kept[0] = frame
        self._activation[0] = recording.body.muscle_membership @ activity
        for update in self._updates:
            update(0)
        self._clock.input = f"{seconds:.3f} s of {self._length:.3f} s"
        return self._canvas.image()

    def close(self) -> None:
        """Free what the picture takes."""
        self._canvas.plotter.close()


def _recording(problem: Problem, positions: Array, task: Task) -> Recording:
    """The world at the present moment, in arrays that are overwritten with the next one."""
    frames, body = problem.spec.frames, problem.body
    count = body.particle_count
    centre = np.average(positions[:count], axis=0, weights=body.masses(1.0))
    nx, _, nz = problem.scene.cells(problem.fidelity.grid_spacing)
    return Recording(
        scene=problem.scene,
        body=body,
        particle_edge=problem.fidelity.particle_edge,
        times=np.zeros(1),
        robot=positions[None, :count].astype(np.float32),
        medium=positions[None, count:].astype(np.float32),
        centre=np.tile(centre, (frames + 1, 1)),
        target=target_path(task, centre, frames),
        vorticity=None if problem.scene.water is None else np.zeros((1, nx + 1, nz + 1)),
        offsets=np.zeros((1, 3)),
    )


def _region(recording: Recording) -> Region:
    """What is drawn: as of a film, but on bare ground with room for what the robot may do."""
    region, scene = region_of(recording), recording.scene
    if not scene.is_bare:
        return region
    room = np.array([1.0, 0.0, 1.0]) * _REACH * float(np.ptp(recording.body.positions[:, 0]))
    return replace(region, low=region.low - room, high=region.high + room)
