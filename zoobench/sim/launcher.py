"""Everything that is launched: which kernels a scene's effects compile, with which constants, and how often."""

import math
from collections import Counter

import numpy as np
import torch
from torch import Tensor

from zoobench.errors import SceneError
from zoobench.sim import kernels, kernels_parallel, runtime
from zoobench.sim.boundary import WALL_NODES
from zoobench.sim.fidelity import Fidelity
from zoobench.sim.matter import lame_parameters
from zoobench.sim.scene import Effect, Scene
from zoobench.sim.state import Matter, Parameters

LARGEST_GRID = 2**28


class Launcher:
    """Owns the grid and launches the substep, its reverse and the survey.

    Args:
        parallel: all worlds at once with atomic adds (CUDA); else in turn on one thread.

    Attributes:
        shape: grid nodes in x, y, z.
        launches: substeps (and surveys) done so far by stage and effect: the record that an effect was never paid for.
    """

    def __init__(
        self,
        scene: Scene,
        fidelity: Fidelity,
        dt: float,
        worlds: int,
        real: torch.dtype,
        device: str,
        parallel: bool,
    ) -> None:
        self._scene, self._fidelity, self._dt = scene, fidelity, dt
        self._worlds, self._real, self._device, self._parallel = worlds, real, device, parallel
        self.shape = _grid_shape(scene, fidelity.grid_spacing)
        self.launches: Counter[str] = Counter()
        self._constants = self._list_constants()
        law = int(scene.medium.material.law) if scene.medium else 0
        self._flags = (Effect.MUSCLE in scene.effects, law, Effect.FRICTION in scene.effects)
        self._grid = self._new_grid()
        self._reverse_grids: tuple[Tensor, ...] = ()

    def advance(
        self, matter: Matter, parameters: Parameters, alive: Tensor, slot: int, stride: int, count: int
    ) -> None:
        """`count` substeps from `slot` on, every result `stride` slots further (0: in place)."""
        arrays = (*matter.tensors(), *parameters.tensors(), alive, self._grid)
        self._note("forward", count)
        if self._parallel:
            for n in range(count):
                s = slot + n * stride
                kernels_parallel.advance_parallel(*arrays, s, s + stride, *self._constants, *self._flags)
        else:
            kernels.advance(*arrays, slot, stride, count, *self._constants, *self._flags)

    def reverse(
        self,
        matter: Matter,
        parameters: Parameters,
        alive: Tensor,
        matter_adjoint: Matter,
        parameter_adjoint: Parameters,
        slot: int,
        count: int,
    ) -> None:
        """The adjoint of `count` substeps, from slot + count back to `slot`; the adjoints are updated in place."""
        if not self._reverse_grids:
            self._reverse_grids = (self._new_grid(), self._new_grid())
        arrays = (
            *matter.tensors(), *parameters.tensors(), alive, self._grid, *self._reverse_grids,
            *matter_adjoint.tensors()[:-1], *parameter_adjoint.tensors(),
        )  # fmt: skip
        self._note("reverse", count)
        if self._parallel:
            for s in range(slot + count - 1, slot - 1, -1):
                kernels_parallel.reverse_parallel(*arrays, s, *self._constants, *self._flags)
        else:
            kernels.reverse(*arrays, slot, count, *self._constants, *self._flags)

    def survey(self, matter: Matter, parameters: Parameters, alive: Tensor, report: Tensor, culprit: Tensor) -> None:
        """The worst values of every world at slot 0 (see `kernels.survey`)."""
        h = self._fidelity.grid_spacing
        high = (h * (n - 1 - WALL_NODES) for n in self.shape)
        self.launches["survey"] += 1
        kernels.survey(
            matter.x, matter.v, matter.C, matter.F, parameters.mass, alive, report, culprit,
            0, h, self._dt, WALL_NODES * h, *high,
        )  # fmt: skip

    def _note(self, direction: str, count: int) -> None:
        for effect in self._scene.effects:
            self.launches[f"{direction} {effect}"] += count

    def _list_constants(self) -> tuple[float, ...]:
        """The scalars that the substep and its reverse share, in the kernels' order."""
        scene = self._scene
        mu, lam = lame_parameters(scene.robot.material.youngs_modulus, scene.robot.material.poissons_ratio)
        medium = scene.medium.material.constants if scene.medium else (0.0,) * 5
        push = (self._dt * g for g in scene.gravity)
        friction = scene.ground.friction if scene.ground else 0.0
        return (self._fidelity.grid_spacing, self._dt, mu, lam, *medium, *push, friction)

    def _new_grid(self) -> Tensor:
        """A zeroed grid `[slabs, nx, ny, nz, 4]`; only the window in use is ever touched.

        NumPy's zeros take no memory before they are touched, torch's do: a wide arena costs what the robot visits.
        """
        shape = (self._worlds if self._parallel else 1, *self.shape, 4)
        if self._device == "cpu":
            return torch.from_numpy(np.zeros(shape, runtime.host_real(self._real)))
        return torch.zeros(shape, dtype=self._real, device=self._device)


def _grid_shape(scene: Scene, grid_spacing: float) -> tuple[int, int, int]:
    cells = (math.ceil((b - a) / grid_spacing - 1e-6) for a, b in zip(scene.lower, scene.upper, strict=True))
    x, y, z = (c + 2 * WALL_NODES + 1 for c in cells)
    if x * y * z > LARGEST_GRID:
        raise SceneError(f"The arena takes {x} x {y} x {z} grid nodes, too many to hold. Use a coarser fidelity.")
    return x, y, z
