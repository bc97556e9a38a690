"""Launches of the kernels of a robot in its rest frame, see `kernels.rest_frame`."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import torch
from scipy.sparse import csr_array
from torch import Tensor

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.sim.kernels.rest_frame_substeps import advance_rest_frame, reverse_rest_frame
from zoobench.sim.kernels.survey import survey
from zoobench.sim.launch import Launch
from zoobench.sim.launcher import Launcher
from zoobench.sim.model.body_parts import BodyParts
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.rest_cells import LANES, RestCells
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.state import Matter, Parameters
from zoobench.sim.model.surface_panels import SurfacePanels
from zoobench.sim.model.tensors import lazy_zeros, put


class RestFrameLauncher(Launcher):
    """A `Launcher` of a robot in its rest frame, on firm ground or in free flight, with a thread for each world where
    all run at once.

    Raises:
        UsageError: matter surrounds the robot, it is held, or it is of no lattice.
    """

    def __init__(
        self, scene: Scene, fidelity: Fidelity, worlds: int, real: torch.dtype, device: str, parallel: bool
    ) -> None:
        if scene.medium or scene.water or scene.objects:
            raise UsageError(
                "A robot in its rest frame (robot=lagrangian) moves on firm ground and in water by forces on its "
                "surface. Choose an environment without a bed, water of another kind or objects, or robot=mpm."
            )
        if scene.robot.anchor or scene.robot.drive is not None:
            raise UsageError(
                "A robot in its rest frame (robot=lagrangian) cannot be held. Choose another design, or robot=mpm."
            )
        super().__init__(scene, fidelity, worlds, real, device, parallel=False)
        self.variant = replace(self.variant, rest_frame=True, at_once=parallel)
        # Taichi's own optimisation gains a twentieth, and compiles for 30 s in place of 6
        self._advance, self._reverse, self._survey = (
            Launch(kernel) for kernel in (advance_rest_frame, reverse_rest_frame, survey)
        )
        self._rest = RestCells.of(scene.robot, fidelity)
        self._inverse = self._of_nodes()
        self._limbs = self._list_limbs(self._rest)
        self._tables = (*self._list_cells(self._rest), *self._limbs, *self._list_panels(self._rest))
        # gathered from the particles of the worlds
        self._room = self._of_nodes(), self._of_worlds(len(self._rest.nodes), 6, LANES), self._of_nodes()

    @property
    def robot_nodes(self) -> int:
        """Nodes that the robot carries with it."""
        return len(self._rest.places)

    def place_nodes(self, matter: Matter, origin: Array) -> None:
        """As `Launcher.place_nodes`: at rest, and with the mean velocity of the mass around each."""
        rest, robot = self._rest, self._scene.robot
        put(matter.nodes[:, :, :, 0, :3], rest.places - origin)
        masses = robot.volumes * robot.density_ratio
        momentum = np.stack([rest.on_nodes(masses * speed) for speed in robot.velocities.T], axis=1)
        put(matter.nodes[:, :, :, 1, :3], momentum / rest.on_nodes(masses)[:, None])

    def add_deformation(self, adjoint: Matter, by_deformation: Tensor) -> None:
        """As `Launcher.add_deformation`: F follows from the places of the nodes."""
        given = by_deformation.cpu().numpy().transpose(0, 1, 3, 2)  # by particle, column and row
        for world, columns in enumerate(given):
            places = self._deformation_map @ columns.reshape(-1, 3)
            adjoint.nodes[0, world, :, 0, :3] += torch.as_tensor(places, dtype=self._real, device=self._device)

    @cached_property
    def _deformation_map(self) -> csr_array:
        return self._rest.deformation_map()

    def keep(self, nodes: int) -> None:
        """Nothing is kept but the states, which hold the forces."""

    def advance(self, matter: Matter, parameters: Parameters, plan: LaunchPlan, stride: int) -> None:
        """As `Launcher.advance`."""
        self._note("forward", plan)
        self._advance(*self._arrays(matter, parameters, plan), *self._tables, stride, self.variant)

    def reverse(
        self,
        matter: Matter,
        parameters: Parameters,
        plan: LaunchPlan,
        matter_adjoint: Matter,
        parameter_adjoint: Parameters,
    ) -> None:
        """As `Launcher.reverse`."""
        self._note("reverse", plan)
        adjoints = matter_adjoint.state, matter_adjoint.nodes, parameter_adjoint.body
        self._reverse(*self._arrays(matter, parameters, plan), *self._tables, *self._room, *adjoints, self.variant)

    def _arrays(self, matter: Matter, parameters: Parameters, plan: LaunchPlan) -> tuple[Tensor, ...]:
        return (
            matter.state, matter.nodes, parameters.body, plan.slots, plan.dt, self.constants, self.terrain,
        )  # fmt: skip

    def _list_cells(self, cells: RestCells) -> tuple[Tensor, ...]:
        """The cells as the kernels take them, and memory for their laws and the nodes' inverse masses."""
        count, shapes = len(cells.nodes), len(cells.slopes)
        turned = cells.slopes.transpose(0, 3, 2, 1).reshape(shapes, 3 * LANES, LANES)  # by lane and axis
        return (
            *(torch.as_tensor(each, device=self._device) for each in (cells.nodes, cells.particles, cells.shape)),
            self._wide(cells.slopes.reshape(shapes, 3 * LANES, LANES)), self._wide(turned),
            self._wide(cells.masses), self._wide(cells.weights), self._of_worlds(count, 7, LANES), self._inverse,
        )  # fmt: skip

    def _list_limbs(self, cells: RestCells) -> tuple[Tensor, ...]:
        """The parts that can meet as the kernels take them, and memory for those that do."""
        parts = BodyParts.of(cells, self._scene.robot, self._fidelity)
        boxes = self._of_worlds(len(parts.members) + len(parts.first), 2, 4)
        put(boxes[:, : len(parts.members), 0, 3], np.abs(cells.weights).sum(axis=1).max(axis=1))
        meeting = torch.zeros((self._worlds, len(parts.apart) + 1), dtype=torch.int32, device=self._device)
        lists = (torch.as_tensor(each, device=self._device) for each in (parts.members, parts.first, parts.apart))
        return (*lists, self._wide(parts.share), boxes, meeting)

    def _list_panels(self, cells: RestCells) -> tuple[Tensor, ...]:
        """Memory for the displaced volumes, and the surface's panels as the kernels take them; none out of water."""
        robot, water = self._scene.robot, self._scene.surface_water
        panels = SurfacePanels.of(robot, water, cells, self._fidelity.grid_spacing) if water else SurfacePanels.none()
        count = len(panels.cell)
        bend = lazy_zeros((count, 2 * panels.around.shape[1], 4), self._real, self._device)
        put(bend[..., :3], panels.bend.reshape(count, 2 * panels.around.shape[1], 3))
        return (
            self._of_nodes(), *(torch.as_tensor(each, device=self._device) for each in (panels.cell, panels.around)),
            self._wide(panels.weights), self._wide(panels.given), bend,
        )  # fmt: skip

    def _of_worlds(self, *shape: int) -> Tensor:
        """Zeros `[worlds, *shape]`."""
        return lazy_zeros((self._worlds, *shape), self._real, self._device)

    def _of_nodes(self) -> Tensor:
        """Zeros `[worlds, nodes]`."""
        return self._of_worlds(self.robot_nodes)

    def _wide(self, values: Array) -> Tensor:
        """Values in memory that is aligned for rows of eight lanes."""
        tensor = lazy_zeros(values.shape, self._real, self._device)
        put(tensor, values)
        return tensor
