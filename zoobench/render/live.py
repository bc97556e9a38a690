"""Pictures of an episode while it is simulated."""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.render.actors import PATH, TARGET, put_ground, put_medium, put_objects, put_paths
from zoobench.render.canvas import Canvas, Image
from zoobench.render.film_files import put_active_robot
from zoobench.render.present import LiveWorld, Present
from zoobench.render.viewpoint import View, camera_for
from zoobench.render.vortices import put_water
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Task

_USUAL = View()
_WAY = 1.0  # [m] of ground that is drawn on every side where the arena, and the camera with it, follows the robot


class LivePicture:
    """The picture of one world, drawn anew at every moment; it must be closed.

    Args:
        problem: the cell.
        positions: of all particles at the start of the episode, the robot's first `[particle_count, 3]` [m].
        task: of the episode, whose target is drawn.
        view: size and camera.

    Raises:
        UsageError: the extra `render` is not installed, or the system has no OpenGL.
    """

    def __init__(self, problem: Problem, positions: Array, task: Task, view: View = _USUAL) -> None:
        self._world = world = LiveWorld(problem, positions, task)
        self._length, self._kept = problem.spec.frames * FRAME_SECONDS, np.zeros(1, np.int64)
        recording, region = world.recording, world.region
        self._camera = camera = camera_for(region, view.width / view.height, view.camera)
        self._follows = view.camera == "follow"
        self._canvas = canvas = Canvas(view.width, view.height)
        way = np.array([_WAY, 0.0, _WAY]) * recording.scene.follows
        put_ground(canvas, replace(region, low=region.low - way, high=region.high + way), camera.towards)
        self._updates = [
            put_medium(canvas, region, view.height / 2 / camera.half_height, from_above=view.camera == "top"),
            put_water(canvas, recording),
            put_active_robot(canvas, region, world.activation[None]),
            put_objects(canvas, region),
            put_paths(canvas, recording, self._kept, camera.towards),
        ]
        spec = problem.spec
        canvas.text(f"{spec.design.name} in {spec.env.name}: {spec.task.name}", 0.02, 0.93, size=1.15)
        self._clock = canvas.text("", 0.02, 0.87)
        canvas.text("centre of mass and its path", 0.02, 0.07, colour=PATH)
        if recording.target is not None:
            canvas.text("target and its path", 0.02, 0.02, colour=TARGET)
        canvas.aim(camera)

    def at(self, present: Present) -> Image:
        """The picture at a moment of the episode."""
        self._world.take(present)
        self._kept[0] = self._world.frame
        # a camera that bobbed up and down with the robot would be hard to look at
        way = self._world.moved * (1.0, 0.0, 1.0) if self._follows else present.offset
        self._canvas.aim(replace(self._camera, focus=self._camera.focus + way))
        for update in self._updates:
            update(0)
        self._clock.input = f"{present.seconds:.3f} s of {self._length:.3f} s"
        return self._canvas.image()

    def close(self) -> None:
        """Free the picture's resources."""
        self._canvas.plotter.close()
