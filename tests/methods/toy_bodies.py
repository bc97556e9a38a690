"""A known body, to be found in a design space without simulation."""

import numpy as np
import torch

from tests.methods.toy import Quadratic
from zoobench.arrays import Array
from zoobench.cell.episode import Evaluation
from zoobench.cell.robot import Robot
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Budget, Ref
from zoobench.tasks.base import Metric

NOW = torch.zeros(1, dtype=torch.float64)


def robot_of(design: str, controller: str = "fixed-sine") -> Robot:
    """The robot at a coarse resolution, at which a block is of whole cells."""
    return Robot.of(Ref.parse(design), Ref(controller), Fidelity(1 / 60), Ref("turning"))


class Sculpture(Quadratic):
    """Score: the share of a block's volume that exists if x > 0 and does not exist otherwise."""

    def __init__(self, budget: Budget) -> None:
        super().__init__(budget)
        self.robot = robot_of("voxel")  # type: ignore[assignment]
        self.body = self.robot.body
        self.parameter_count = self.robot.parameter_count

    def initial(self, rng: np.random.Generator) -> Array:
        return self.robot.initial(rng)  # type: ignore[attr-defined, no-any-return]

    def _one(self, params: Array) -> tuple[Evaluation, Array]:
        draft = self.robot.draft(torch.as_tensor(params)[None], NOW)  # type: ignore[attr-defined]
        solid = draft.form.occupancy[0].numpy() > 0.5
        score = float(np.average(solid == (self.body.positions[:, 0] > 0.0), weights=self.body.volumes))
        return Evaluation(score, {"score": Metric(score, "1")}, np.array([score])), np.zeros(0)
