"""Launches of kernels: compiled for a scene's effects, with its constants, and counted."""

import math
from collections import Counter

import numpy as np
import torch
from torch import Tensor

from zoobench.errors import SceneError
from zoobench.sim import launch_clock, runtime
from zoobench.sim.kernels import half_step, parallel, serial, survey
from zoobench.sim.kernels.boundary import NONE, PLANE, TERRAIN, WALL_NODES
from zoobench.sim.kernels.transfer import AFLIP, APIC, PIC
from zoobench.sim.model.fidelity import Fidelity, Transfer
from zoobench.sim.model.matter import DECOMPOSED, Law, lame_parameters
from zoobench.sim.model.scene import Effect, Scene
from zoobench.sim.model.state import LaunchPlan, Matter, Parameters

LARGEST_GRID = 2**28

_TRANSFERS: dict[Transfer, int] = {"apic": APIC, "pic": PIC, "aflip": AFLIP}


class Launcher:
    """Owns the grid and launches the substep, its reverse and the survey.

    Args:
        parallel: all worlds at once with atomic adds (CUDA); else in turn on one thread.

    Attributes:
        shape: grid nodes in x, y, z.
        constants, flags: the scalars and the compile-time switches of the kernels, in their order.
        terrain: `[nx, nz, 4]` height [cells] above the grid's first node and normal; empty for a plane.
        launches: counts of kernel launches by direction, of surveys, and of world-substeps by direction and effect,
            the decomposition of strain into principal values among them; an effect that the scene does not call for
            has no entry.
    """

    def __init__(
        self, scene: Scene, fidelity: Fidelity, worlds: int, real: torch.dtype, device: str, parallel: bool
    ) -> None:
        self._scene, self._fidelity = scene, fidelity
        self._worlds, self._real, self._device, self._parallel = worlds, real, device, parallel
        self.shape = _grid_shape(scene, fidelity.grid_spacing)
        self.launches: Counter[str] = Counter()
        launch_clock.watch(self)
        self.constants = self._list_constants()
        law = int(scene.medium.material.law) if scene.medium else 0
        self._work = [str(effect) for effect in sorted(scene.effects)]
        if law in DECOMPOSED:
            self._work.append("decomposition")
        transfer = _TRANSFERS[fidelity.transfer]
        self.flags = (
            Effect.MUSCLE in scene.effects,
            Effect.DAMPING in scene.effects,
            law,
            self._ground_kind(),
            fidelity.spline.width,
            transfer,
        )
        self.terrain = self._sample_terrain()
        self._grid = self._new_grid()
        self._before = self._new_grid(transfer == AFLIP)
        self._ratios = self._new_grid(law == Law.WATER, 2)
        self._grids = (self._grid, self._before, self._ratios)
        self._reverse_grids: tuple[Tensor, ...] = ()

    def advance(self, matter: Matter, parameters: Parameters, plan: LaunchPlan, stride: int) -> None:
        """The planned substeps of every world, every result `stride` slots further (0: in place)."""
        arrays = (*matter.tensors(), *parameters.tensors(), plan.slots, plan.dt, self.terrain, *self._grids)
        self._note("forward", plan)
        if self._parallel:
            for n in range(int(plan.slots[:, 1].max())):
                parallel.advance_parallel(*arrays, n, stride, *self.constants, *self.flags)
        else:
            serial.advance(*arrays, stride, *self.constants, *self.flags)

    def reverse(
        self,
        matter: Matter,
        parameters: Parameters,
        plan: LaunchPlan,
        matter_adjoint: Matter,
        parameter_adjoint: Parameters,
    ) -> None:
        """The adjoint of the planned substeps, last to first; the adjoints are updated in place."""
        if not self._reverse_grids:
            self._reverse_grids = (self._new_grid(), *(self._new_grid(g.numel() > 0, g.shape[-1]) for g in self._grids))
        arrays = (
            *matter.tensors(), *parameters.tensors(), plan.slots, plan.dt, self.terrain, *self._grids,
            *self._reverse_grids, *matter_adjoint.tensors()[:-1], *parameter_adjoint.tensors(),
        )  # fmt: skip
        self._note("reverse", plan)
        if self._parallel:
            for n in range(int(plan.slots[:, 1].max()) - 1, -1, -1):
                parallel.reverse_parallel(*arrays, n, *self.constants, *self.flags)
        else:
            serial.reverse(*arrays, *self.constants, *self.flags)

    def survey(self, matter: Matter, parameters: Parameters, alive: Tensor, report: Tensor, culprit: Tensor) -> None:
        """Report the condition of every world at slot 0 (see `survey.survey`)."""
        h, *moduli = self.constants[:9]
        high = (h * (n - 1 - WALL_NODES) for n in self.shape)
        self.launches["survey"] += 1
        survey.survey(
            matter.x, matter.v, matter.C, matter.F, matter.history,
            parameters.mass, parameters.volume, parameters.stiffness, parameters.tension, alive, report, culprit,
            WALL_NODES * h, *high, h, *moduli, self.flags[2],
        )  # fmt: skip

    def momenta(self, matter: Matter, parameters: Parameters, dt: float) -> Tensor:
        """Momentum [kg m/s] and mass [kg] of the first world's nodes after the internal forces of a substep of `dt` [s]
        from slot 0, before gravity and contact: `[nx, ny, nz, 4]`, a copy of the window."""
        h, *moduli = self.constants[:9]
        muscle, damping, law, _, width, transfer = self.flags
        half_step.scatter_all(
            *matter.tensors(), *parameters.tensors(), *self._grids, dt, h, *moduli,
            muscle, damping, law, width, transfer,
        )  # fmt: skip
        return self.nodes(matter.window[0, 0])

    def nodes(self, window: Tensor) -> Tensor:
        """A copy of the nodes of a window `[6]` of the first slab: velocity [m/s] and mass [kg] after a substep."""
        x0, y0, z0, x1, y1, z1 = window.tolist()
        return self._grid[0, x0:x1, y0:y1, z0:z1].clone()

    def _note(self, direction: str, plan: LaunchPlan) -> None:
        self.launches[f"{direction} launches"] += 1
        for work in self._work:
            self.launches[f"{direction} {work}"] += plan.world_substeps

    def _list_constants(self) -> tuple[float, ...]:
        """The scalars that the substep and its reverse share, in the kernels' order."""
        scene = self._scene
        mu, lam = lame_parameters(scene.robot.material.youngs_modulus, scene.robot.material.poissons_ratio)
        medium = scene.medium.material.constants if scene.medium else (0.0,) * 5
        friction = scene.ground.friction if scene.ground else 0.0
        viscosity = scene.robot.material.viscosity
        return (self._fidelity.grid_spacing, mu, lam, viscosity, *medium, *scene.gravity, friction)

    def _ground_kind(self) -> int:
        """The kernels' ground; a plane without friction is one of the arena's walls."""
        if self._scene.ground is not None and self._scene.ground.terrain is not None:
            return TERRAIN
        return PLANE if Effect.FRICTION in self._scene.effects else NONE

    def _sample_terrain(self) -> Tensor:
        """Height [cells] above the grid's first node and normal of the ground in every node column; empty without."""
        ground, h = self._scene.ground, self._fidelity.grid_spacing
        if ground is None or ground.terrain is None:
            return torch.zeros((0, 0, 4), dtype=self._real, device=self._device)
        # the wall planes, and with them the arena's lower corner, run through node WALL_NODES
        x, z = (np.arange(self.shape[d], dtype=np.float64) * h - WALL_NODES * h for d in (0, 2))
        height = ground.terrain.heights_at(x, z) / h + WALL_NODES
        columns = np.concatenate([height[..., None], ground.terrain.normals_at(x, z)], axis=-1)
        return torch.as_tensor(np.ascontiguousarray(columns), dtype=self._real, device=self._device)

    def _new_grid(self, needed: bool = True, components: int = 4) -> Tensor:
        """A zeroed grid `[slabs, nx, ny, nz, components]`, empty if not needed; only the window in use is touched.

        NumPy's zeros take no memory before they are touched, torch's do: a wide arena takes memory only where the robot
        has been.
        """
        shape = (self._worlds if self._parallel else 1, *self.shape, components) if needed else (0, 0, 0, 0, components)
        if self._device == "cpu":
            return torch.from_numpy(np.zeros(shape, runtime.host_real(self._real)))
        return torch.zeros(shape, dtype=self._real, device=self._device)


def _grid_shape(scene: Scene, grid_spacing: float) -> tuple[int, int, int]:
    # an arena of a whole number of cells must not gain one by rounding
    cells = (math.ceil((b - a) / grid_spacing - 1e-6) for a, b in zip(scene.lower, scene.upper, strict=True))
    x, y, z = (c + 2 * WALL_NODES + 1 for c in cells)
    if x * y * z > LARGEST_GRID:
        raise SceneError(f"The arena takes {x} x {y} x {z} grid nodes, too many to hold. Use a coarser fidelity.")
    return x, y, z
