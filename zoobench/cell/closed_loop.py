"""The closed loop of robots side by side: from what they feel to what their muscles do, and back in reverse."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.observation import ObservationModel
from zoobench.cell.robot import Built, Robot
from zoobench.controllers.base import ClosedLoop
from zoobench.spec import FRAME_SECONDS

if TYPE_CHECKING:
    from torch import Tensor

    from zoobench.sim.model.rollout import FeedbackAdjoint, FloatArray, Rollout


class FeedbackLoops:
    """The controllers of one episode, each with the body that it moves.

    Attributes:
        gradients: `[worlds, parameter_count]`, what the pulls on the activity so far come to.
    """

    def __init__(self, robot: Robot, controller: ClosedLoop, built: Sequence[Built]) -> None:
        self._robot, self._controller, self._built = robot, controller, built
        self._observation_model = ObservationModel(robot.body)
        self._start: FloatArray = np.zeros(0)
        self.gradients = np.zeros((len(built), robot.parameter_count))

    @classmethod
    def of(cls, robot: Robot, built: Sequence[Built]) -> "FeedbackLoops | None":
        """What closes the robot's loop; None where it is open."""
        controller = robot.controller
        return cls(robot, controller, built) if isinstance(controller, ClosedLoop) else None

    def act(self, frame: int, positions: "FloatArray", velocities: "FloatArray") -> Array:
        """The activity of a frame `[worlds, muscles]`, from the state at its start `[worlds, particle_count, 3]`."""
        import torch

        if frame == 0:
            self._start = positions.copy()
        with torch.no_grad():
            return np.stack(
                [self._respond(frame, world, *self._state(world, positions, velocities)) for world in self._worlds()]
            )

    def adjoint(self, rollout: "Rollout") -> "FeedbackAdjoint":
        """Of `act` along an episode: a function that adds to `gradients` and returns pulls on the state."""
        import torch

        def pull_back(frame: int, pull: Array) -> tuple[Array, Array]:
            found = []
            for world in self._worlds():
                state = self._state(world, rollout.positions[frame], rollout.velocities[frame])
                leaves = (self._built[world].row, *(part.requires_grad_() for part in state))
                activity = self._respond(frame, world, *state)
                # the body's form is shared by all frames
                gradient, *pulls = torch.autograd.grad(
                    activity, leaves, torch.as_tensor(pull[world]), retain_graph=True
                )
                self.gradients[world] += gradient[0].numpy()
                found.append([part.numpy() for part in pulls])
            positions, velocities = zip(*found, strict=True)
            return np.stack(positions), np.stack(velocities)

        self._start = rollout.positions[0]
        return pull_back

    def _worlds(self) -> range:
        return range(len(self._built))

    @staticmethod
    def _state(world: int, *parts: "FloatArray") -> list["Tensor"]:
        import torch

        return [torch.tensor(part[world], dtype=torch.float64) for part in parts]

    def _respond(self, frame: int, world: int, positions: "Tensor", velocities: "Tensor") -> "Tensor":
        import torch

        built = self._built[world]
        (start,) = self._state(world, self._start)
        whole = torch.as_tensor(self._robot.body.occupancy)
        presence = built.matter["occupancy"][0] if built.matter else whole
        observation = self._observation_model.observe(positions, velocities, start, presence)
        control = built.row[0, : self._robot.control_count]
        return self._controller.response(control, frame * FRAME_SECONDS, observation, self._robot.body.muscle_count)
