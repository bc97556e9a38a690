"""Launches for many threads (CUDA): all worlds at once, a substep a launch."""

import math
from typing import Any

import torch
from torch import Tensor

from zoobench.errors import SceneError
from zoobench.sim.kernels import parallel, survey
from zoobench.sim.kernels.elastic import SMALLEST_J
from zoobench.sim.kernels.layout import Variant
from zoobench.sim.kernels.transfer import AFLIP
from zoobench.sim.launch import Launch
from zoobench.sim.memory_budget import memory_share
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.state import WINDOW_SIZE, Matter, Parameters
from zoobench.sim.model.tensors import LARGEST_ARRAY

_FOUND = 9
"""Numbers that `survey.survey_each` finds of a particle."""


class ParallelDriver:
    """Takes all worlds through their substeps together, each in its own part of the grid.

    Args:
        shape: grid nodes of the arena in x, y, z.
        fields: of every node.
        variant, constants: as of the launcher; the device and the type of all numbers are those of the constants.

    Attributes:
        room: nodes of one layer of a world: those of the arena, or as many as there is memory for.
        nodes: of all worlds together.
    """

    def __init__(
        self, shape: tuple[int, int, int], fields: int, worlds: int, variant: Variant, constants: Tensor
    ) -> None:
        self._variant, self._constants = variant, constants
        device, layers = constants.device, variant.layers
        numbers = min(LARGEST_ARRAY, memory_share(device.type) // constants.itemsize)
        self.room = min(math.prod(shape), numbers // (4 * fields * worlds * layers))
        self.nodes = worlds * layers * self.room
        self._advance, self._reverse, self._survey = (
            Launch(kernel, lanes=False)
            for kernel in (parallel.advance_parallel, parallel.reverse_parallel, survey.survey_each)
        )
        # windows of the substep in hand, and its number
        self._boxes = torch.zeros((1, worlds, WINDOW_SIZE), dtype=torch.int32, device=device)
        self._step = torch.zeros(1, dtype=torch.int32, device=device)
        self._found = constants.new_zeros((worlds, 0, _FOUND))
        # the particles' additions to the adjoints of the grid, see `lane_scatter`
        self._contributions = constants.new_zeros((worlds, 0, 4 * (1 + variant.uses(AFLIP)), 4))

    def check_room(self, windows: Tensor) -> None:
        """Raise a `SceneError` if a world has more nodes in its window `[worlds, 8]` than there is room for."""
        nodes = int((windows[:, 3:6] - windows[:, :3]).prod(1).max())
        if nodes > self.room:
            raise SceneError(
                f"Matter fills {nodes} grid nodes of a world, and {len(windows)} worlds have memory for {self.room} "
                "each. Use fewer worlds or a coarser fidelity."
            )

    def advance(self, arrays: tuple[Any, ...], grid: Tensor, plan: LaunchPlan, stride: int) -> None:
        """The planned substeps of every world; `arrays` are those that the kernel takes before the grid."""
        self._step.zero_()
        for _ in range(plan.longest):
            self._advance(*arrays, grid, self._boxes, self._step, stride, self._variant)

    def reverse(self, arrays: tuple[Any, ...], grid: Tensor, adjoints: tuple[Any, ...], plan: LaunchPlan) -> None:
        """Their adjoint, last to first; `adjoints` are the arrays that the kernel takes last."""
        self._step.fill_(plan.longest - 1)
        if not self._contributions.numel():
            self._contributions = self._contributions.new_zeros((*arrays[0].shape[1:3], *self._contributions.shape[2:]))
        for _ in range(plan.longest):
            self._reverse(*arrays, grid, self._boxes, self._step, self._contributions, *adjoints, self._variant)

    def survey(
        self,
        matter: Matter,
        parameters: Parameters,
        alive: Tensor,
        report: Tensor,
        culprit: Tensor,
        count: int,
    ) -> None:
        """`survey.survey`, as a reduction of the findings of all particles."""
        if not self._found.numel():  # for all matter, as a launch with other arrays has to be prepared anew
            self._found = self._found.new_zeros((len(alive), matter.state.shape[2], _FOUND))
        arrays = (matter.state, parameters.body, self._constants, alive, self._found)
        self._survey(*arrays, count, self._variant.surveyed)
        found = self._found[:, :count]
        worst, who = found[:, :, :4].max(1)  # a NaN is the largest of all to torch
        report[:, :3], report[:, 3] = worst[:, :3].clamp(min=0.0), -worst[:, 3]
        # without any above these there is no culprit; a NaN compares with nothing
        culprit[:] = who * ~(worst <= worst.new_tensor([0.0, 0.0, 0.0, -1e30]))
        report[:, 4] = (found[:, :, 3] > -SMALLEST_J).sum(1)
        rest = found[:, :, 4:].amax(1)
        report[:, 5], report[:, 6:] = rest[:, 0].sqrt(), rest[:, 1:]
