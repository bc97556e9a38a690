"""The closed loop of robots side by side: from observations to muscle activity, and its adjoint."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.observation import ObservationModel, seen_by
from zoobench.cell.robot import Built, Robot
from zoobench.controllers.base import ClosedLoop
from zoobench.sim.model.elastic_bodies import SceneObject
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Task

if TYPE_CHECKING:
    from torch import Tensor

    from zoobench.sim.model.rollout import FeedbackAdjoint, FloatArray, Rollout


class FeedbackLoops:
    """The controllers of one episode, each with its body.

    Attributes:
        gradients: of the loss by the parameters, as far as the adjoint has run `[worlds, parameter_count]`.
    """

    def __init__(
        self,
        robot: Robot,
        controller: ClosedLoop,
        built: Sequence[Built],
        task: Task | None,
        frames: int,
        objects: tuple[SceneObject, ...],
    ) -> None:
        self._robot, self._controller, self._built = robot, controller, built
        self._observation_models = [ObservationModel(one.body, task, frames, objects) for one in built]
        self._start: FloatArray = np.zeros(0)
        self.gradients = np.zeros((len(built), robot.parameter_count))

    @classmethod
    def of(
        cls, robot: Robot, built: Sequence[Built], task: Task, frames: int, objects: tuple[SceneObject, ...] = ()
    ) -> "FeedbackLoops | None":
        """The loops of a robot with a closed-loop controller in an episode of so many frames; None with an open loop.

        `task` is the one that the robot was made for, `objects` are those of the scene.
        """
        controller = robot.controller
        if not isinstance(controller, ClosedLoop):
            return None
        return cls(robot, controller, built, seen_by(controller, task), frames, objects)

    def act(self, frame: int, positions: "FloatArray", velocities: "FloatArray") -> Array:
        """Activity of a frame `[worlds, muscle_count]`, from the state at its start `[worlds, all particles, 3]`."""
        import torch

        if frame == 0:
            self._start = positions.copy()
        with torch.no_grad():
            states = [self._state(world, positions, velocities, self._start) for world in range(len(self._built))]
            return np.stack([self._respond(frame, world, *state) for world, state in enumerate(states)])

    def adjoint(self, rollout: "Rollout") -> "FeedbackAdjoint":
        """The adjoint of `act`: from the adjoint of a frame's activity `[worlds, muscle_count]` to that of the state.

        Frames are called from the last to the first. Each call adds to `gradients`. All frames observe the start of the
        episode as well, and the first returns their sum.
        """
        import torch

        start_adjoint = np.zeros(rollout.positions[0].shape)

        def frame_adjoint(frame: int, activity_adjoint: Array) -> tuple[Array, Array]:
            state_adjoints = []
            for world in range(len(self._built)):
                state = self._state(world, rollout.positions[frame], rollout.velocities[frame], self._start)
                leaves = (self._built[world].row, *(part.requires_grad_() for part in state))
                activity = self._respond(frame, world, *state)
                # of a scalar, see `Built.gradient`; all frames share the graph of the body's form, so it is retained
                weighted = (activity * torch.as_tensor(activity_adjoint[world])).sum()
                gradient, *adjoints = torch.autograd.grad(weighted, leaves, retain_graph=True)
                self.gradients[world] += gradient[0].numpy()
                state_adjoints.append([adjoint.numpy() for adjoint in adjoints])
            positions, velocities, starts = (np.stack(parts) for parts in zip(*state_adjoints, strict=True))
            start_adjoint[:] += starts
            return (positions if frame else positions + start_adjoint), velocities

        self._start = rollout.positions[0]
        return frame_adjoint

    @staticmethod
    def _state(world: int, *parts: "FloatArray") -> list["Tensor"]:
        import torch

        return [torch.tensor(part[world], dtype=torch.float64) for part in parts]

    def _respond(self, frame: int, world: int, positions: "Tensor", velocities: "Tensor", start: "Tensor") -> "Tensor":
        import torch

        built = self._built[world]
        occupancy = built.matter["occupancy"][0] if built.matter else torch.as_tensor(built.body.occupancy)
        membership = built.matter["muscle_membership"][0] if built.matter else None
        model = self._observation_models[world]
        observation = model.observe(frame, positions, velocities, start, occupancy, membership)
        control = built.row[0, : self._robot.control_count]
        time = frame * FRAME_SECONDS
        activity = self._controller.response(control, time, observation, self._robot.body.muscle_count)
        return activity * self._robot.strength(torch.tensor(time, dtype=torch.float64))
