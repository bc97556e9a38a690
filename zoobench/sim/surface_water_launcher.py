"""Launches of the kernels of a robot in water by forces on its surface, see `kernels.panel_forces`."""

import torch

from zoobench.errors import UsageError
from zoobench.sim.kernels import panel_forces, panel_forces_adjoint
from zoobench.sim.launch import Launch
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.surface_panels import SurfacePanels
from zoobench.sim.model.tensors import lazy_zeros, put
from zoobench.sim.rest_frame_launcher import RestFrameLauncher


class SurfaceWaterLauncher(RestFrameLauncher):
    """A `Launcher` of a robot in its rest frame in water by forces on its surface.

    Raises:
        UsageError: the robot is not to be simulated in its rest frame, or as of `RestFrameLauncher`.
    """

    def __init__(
        self, scene: Scene, fidelity: Fidelity, worlds: int, real: torch.dtype, device: str, parallel: bool
    ) -> None:
        if fidelity.robot != "lagrangian":
            raise UsageError(
                "Water by forces on the surface has its robot in its rest frame. Give robot=lagrangian with the "
                "fidelity."
            )
        super().__init__(scene, fidelity, worlds, real, device, parallel)
        assert scene.surface_water is not None
        self._advance = Launch(panel_forces.advance_swimmer)
        self._reverse = Launch(panel_forces_adjoint.reverse_swimmer)
        panels = SurfacePanels.of(scene.robot, scene.surface_water, self._rest, fidelity.grid_spacing)
        count = len(panels.cell)
        bend = lazy_zeros((count, 2 * panels.around.shape[1], 4), real, device)
        put(bend[..., :3], panels.bend.reshape(count, -1, 3))
        self._tables = (
            *self._tables, self._of_nodes(), torch.as_tensor(panels.cell, device=device),
            torch.as_tensor(panels.around, device=device), self._wide(panels.weights), self._wide(panels.given), bend,
        )  # fmt: skip
        self._room = (*self._room, self._of_nodes())
