"""Launches of kernels: compiled for a scene's effects, with its constants, and counted."""

import math
from collections import Counter

import numpy as np
import torch
from torch import Tensor

from zoobench.errors import SceneError
from zoobench.sim import launch_clock
from zoobench.sim.kernels import half_step, parallel, serial, survey
from zoobench.sim.kernels.boundary import NONE, PLANE, TERRAIN, WALL_NODES
from zoobench.sim.kernels.layout import BEFORE, MOMENTUM, RATIO, VELOCITY, Variant
from zoobench.sim.kernels.transfer import AFLIP, APIC, PIC
from zoobench.sim.launch import Launch
from zoobench.sim.model.fidelity import Fidelity, Transfer
from zoobench.sim.model.matter import DECOMPOSED, Law, lame_parameters
from zoobench.sim.model.scene import Effect, Scene
from zoobench.sim.model.state import LARGEST_ARRAY, LaunchPlan, Matter, Parameters, lazy_zeros

LARGEST_GRID = 2**28

_TRANSFERS: dict[Transfer, int] = {"apic": APIC, "pic": PIC, "aflip": AFLIP}


class Launcher:
    """Owns the grid and launches the substep, its reverse and the survey.

    Args:
        parallel: all worlds at once with atomic adds (CUDA); else in turn on one thread.

    Attributes:
        shape: grid nodes in x, y, z.
        fields: number of fields of every node, see `layout`.
        constants: `[17]` the kernels' scalars, see `layout.CONSTANTS`.
        variant: what the kernels are compiled for.
        terrain: `[nx, nz, 4]` height [cells] above the grid's first node and normal; empty for a plane.
        launches: counts of kernel launches by direction, of surveys, and of world-substeps by direction and effect,
            "decomposition" for a law that needs principal values far from rest; an effect that the scene does not call
            for has no entry.
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
        self.variant = Variant(
            muscle=Effect.MUSCLE in scene.effects,
            damping=Effect.DAMPING in scene.effects,
            law=law,
            ground=self._ground_kind(),
            width=fidelity.spline.width,
            transfer=_TRANSFERS[fidelity.transfer],
        )
        self.terrain = self._sample_terrain()
        self.fields = RATIO + 1 if law == Law.WATER else BEFORE + (self.variant.transfer == AFLIP)
        self._grid = self._new_grid()
        self._grid_adjoint: Tensor | None = None
        self._kept = 0
        # Taichi's own optimisation gains a twentieth on a robot alone; beside a medium it only triples compiling
        self._advance, self._reverse, self._survey = (
            Launch(kernel, optimised=law == 0) for kernel in (serial.advance, serial.reverse, survey.survey)
        )

    def keep(self, nodes: int) -> None:
        """Have room for so many nodes of every world, whose momenta `advance` keeps for `reverse`; 0 for none."""
        slab = math.prod(self.shape)
        room = (LARGEST_ARRAY // (4 * self.fields) - slab) // self._worlds
        nodes = 0 if self._parallel else max(min(nodes, room), 0)
        if nodes != self._kept:
            self._kept = nodes
            self._grid.data = self._grid.new_empty(0)  # see `Tape.__del__`
            self._grid = self._new_grid(self._worlds * nodes)

    def first_kept(self) -> Tensor:
        """The first node that is kept of every world `[worlds]`, for the window of a tape's first slot."""
        return math.prod(self.shape) + self._kept * torch.arange(self._worlds, dtype=torch.int32, device=self._device)

    def advance(self, matter: Matter, parameters: Parameters, plan: LaunchPlan, stride: int) -> None:
        """The planned substeps of every world, every result `stride` slots further (0: in place).

        Momenta are kept as far as there is room where every slot is (`stride` 1).
        """
        arrays = (*matter.tensors(), parameters.body, plan.slots, plan.dt, self.constants, self.terrain, self._grid)
        self._note("forward", plan)
        if self._parallel:
            for n in range(int(plan.slots[:, 1].max())):
                parallel.advance_parallel(*arrays, n, stride, self.variant)
        else:
            self._advance(*arrays, stride, self._kept if stride else 0, self.variant)

    def reverse(
        self,
        matter: Matter,
        parameters: Parameters,
        plan: LaunchPlan,
        matter_adjoint: Matter,
        parameter_adjoint: Parameters,
    ) -> None:
        """The adjoint of the planned substeps, last to first; the adjoints are updated in place."""
        if self._grid_adjoint is None:
            self._grid_adjoint = self._new_grid()
        arrays = (
            *matter.tensors(), parameters.body, plan.slots, plan.dt, self.constants, self.terrain, self._grid,
            self._grid_adjoint, matter_adjoint.state, parameter_adjoint.body,
        )  # fmt: skip
        self._note("reverse", plan)
        if self._parallel:
            for n in range(int(plan.slots[:, 1].max()) - 1, -1, -1):
                parallel.reverse_parallel(*arrays, n, self.variant)
        else:
            self._reverse(*arrays, self.variant)

    def survey(self, matter: Matter, parameters: Parameters, alive: Tensor, report: Tensor, culprit: Tensor) -> None:
        """Report the condition of every world at slot 0 (see `survey.survey`)."""
        self.launches["survey"] += 1
        self._survey(matter.state, parameters.body, self.constants, alive, report, culprit, self.variant)

    def momenta(self, matter: Matter, parameters: Parameters, dt: float) -> Tensor:
        """Momentum [kg m/s] and mass [kg] of the first world's nodes after the internal forces of a substep of `dt` [s]
        from slot 0, before gravity and contact: `[nx, ny, nz, 4]`, a copy of the window."""
        Launch(half_step.scatter_first)(
            *matter.tensors(), parameters.body, self.constants, self._grid, dt, self.variant
        )
        return self._field(MOMENTUM, matter.window[0, 0])

    def nodes(self, window: Tensor) -> Tensor:
        """A copy of the nodes of a window `[8]` of the first world: velocity [m/s] and mass [kg] after a substep."""
        return self._field(VELOCITY, window)

    def _field(self, field: int, window: Tensor) -> Tensor:
        x0, y0, z0, x1, y1, z1 = window[:6].tolist()
        shape = (x1 - x0, y1 - y0, z1 - z0)
        return self._grid[field, : math.prod(shape)].reshape(*shape, 4).clone()

    def _note(self, direction: str, plan: LaunchPlan) -> None:
        self.launches[f"{direction} launches"] += 1
        substeps = plan.world_substeps
        for work in self._work:
            self.launches[f"{direction} {work}"] += substeps

    def _list_constants(self) -> Tensor:
        """The scalars that the kernels share, in the order of `layout.CONSTANTS`."""
        scene = self._scene
        mu, lam = lame_parameters(scene.robot.material.youngs_modulus, scene.robot.material.poissons_ratio)
        medium = scene.medium.material.constants if scene.medium else (0.0,) * 5
        friction = scene.ground.friction if scene.ground else 0.0
        listed = (
            self._fidelity.grid_spacing, mu, lam, scene.robot.material.viscosity, *medium, *scene.gravity, friction,
            *self.shape, scene.robot.particle_count,
        )  # fmt: skip
        return torch.tensor(listed, dtype=self._real, device=self._device)

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

    def _new_grid(self, kept: int = 0) -> Tensor:
        """A zeroed grid `[fields, nodes, 4]`, a slab for every world that is simulated at the same time, and `kept`
        more nodes; a wide arena takes memory only where the robot has been."""
        slabs = self._worlds if self._parallel else 1
        return lazy_zeros((self.fields, slabs * math.prod(self.shape) + kept, 4), self._real, self._device)


def kept_fields(scene: Scene, fidelity: Fidelity) -> int:
    """Fields of the grid that are kept for the reverse."""
    water = scene.medium is not None and scene.medium.material.law == Law.WATER
    return 1 + (fidelity.transfer == "aflip") + water


def _grid_shape(scene: Scene, grid_spacing: float) -> tuple[int, int, int]:
    # an arena of a whole number of cells must not gain one by rounding
    cells = (math.ceil((b - a) / grid_spacing - 1e-6) for a, b in zip(scene.lower, scene.upper, strict=True))
    x, y, z = (c + 2 * WALL_NODES + 1 for c in cells)
    if x * y * z > LARGEST_GRID:
        raise SceneError(f"The arena takes {x} x {y} x {z} grid nodes, too many to hold. Use a coarser fidelity.")
    return x, y, z
