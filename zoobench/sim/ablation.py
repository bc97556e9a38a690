"""The parts of a substep, each repeated alone on one state, to measure the time that each takes.

The parts are those of `serial.advance` and call the same functions. Each reads slot 0 and writes slot 1 (or a second
grid), so that every repetition does the same work. Arrays are those of `kernels.serial`.
"""

from enum import IntEnum

import taichi as ti
import torch

from zoobench.sim.kernels.array_types import Matrices, Nodes, Scalars, Symmetric, Vectors
from zoobench.sim.kernels.flip import FLIP_SHARE, divide_node, gather_velocity
from zoobench.sim.kernels.linalg import identity, matmul, pack, unpack
from zoobench.sim.kernels.media import deform_medium
from zoobench.sim.kernels.serial import clear_window
from zoobench.sim.kernels.splines import base_node
from zoobench.sim.kernels.substep import particle_stress, update_node
from zoobench.sim.kernels.symmetric import eigen_symmetric
from zoobench.sim.kernels.transfer import AFLIP, gather, scatter
from zoobench.sim.model.matter import DECOMPOSED
from zoobench.sim.model.state import empty_matter
from zoobench.sim.simulation import Simulation


class SubstepPart(IntEnum):
    """The parts of a substep.

    DECOMPOSITION is contained in DEFORM: the trial strain and its principal values, without the return to the yield
    surface.
    """

    CLEAR = 0
    STRESS = 1
    SCATTER = 2
    NODES = 3
    GATHER = 4
    DEFORM = 5
    DECOMPOSITION = 6
    WINDOW = 7


CLEAR, STRESS, SCATTER, NODES, GATHER, DEFORM, DECOMPOSITION, WINDOW = (int(part) for part in SubstepPart)


@ti.func
def particle_part(
    x: ti.template(), v: ti.template(), C: ti.template(), F: ti.template(),
    b: ti.template(), history: ti.template(), tau: ti.template(), window: ti.template(),
    mass: ti.template(), volume: ti.template(), stiffness: ti.template(), tension: ti.template(), fibre: ti.template(),
    grid: ti.template(), before: ti.template(), w, p, inverse_spacing, dt, mu, lam, eta, constants,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), width: ti.template(), transfer: ti.template(),
    part: ti.template(),
):  # fmt: skip
    """One particle's share of one part."""
    if ti.static(part == STRESS):
        C[1, w, p] = particle_stress(
            C, F, history, tau, stiffness, tension, fibre, 0, w, p, mu, lam, eta, constants, muscle, damping, law
        )
    if ti.static(part == SCATTER):
        m = mass[w, p]
        scatter(grid, 0, x[0, w, p], m * v[0, w, p], m * C[0, w, p], m, inverse_spacing, width, transfer)
        if ti.static(transfer == AFLIP):
            scatter(before, 0, x[0, w, p], m * v[0, w, p], m * C[0, w, p], m, inverse_spacing, width, transfer)
    if ti.static(part == GATHER):
        velocity, affine = gather(grid, 0, x[0, w, p], inverse_spacing, width, transfer)
        x[1, w, p] = x[0, w, p] + dt * velocity
        if ti.static(transfer == AFLIP):
            velocity += FLIP_SHARE * (v[0, w, p] - gather_velocity(before, 0, x[0, w, p], inverse_spacing, width))
        v[1, w, p] = velocity
        C[1, w, p] = affine
    if ti.static(part == DEFORM):
        step = identity() + dt * C[0, w, p]
        if p < F.shape[2]:
            F[1, w, p] = matmul(step, F[0, w, p])
        elif ti.static(law):
            deform_medium(b, history, tau, 0, 1, w, p - F.shape[2], step, 1.0, 1.0, inverse_spacing, dt, constants, law)
    if ti.static(part == DECOMPOSITION):
        if p >= F.shape[2]:
            step = identity() + dt * C[0, w, p]
            trial = matmul(step, matmul(unpack(b[0, w, p - F.shape[2]]), step.transpose()))
            squares, frame = eigen_symmetric(pack(trial))
            v[1, w, p] = squares
            C[1, w, p] = frame
    if ti.static(part == WINDOW):
        base = base_node(x[0, w, p], inverse_spacing, grid, width)
        for d in ti.static(range(3)):
            window[1, w, d] = ti.min(window[1, w, d], base[d])
            window[1, w, 3 + d] = ti.max(window[1, w, 3 + d], base[d] + width)


@ti.kernel
def repeat_part(
    x: Vectors, v: Vectors, C: Matrices, F: Matrices, b: Symmetric, history: Scalars, tau: Symmetric, window: Scalars,
    mass: Scalars, volume: Scalars, stiffness: Scalars, tension: Scalars, fibre: Vectors,
    terrain: Nodes, grid: Nodes, other: Nodes, before: Nodes, other_before: Nodes,
    count: int, dt: float, h: float,
    mu: float, lam: float, eta: float, m0: float, m1: float, m2: float, m3: float, m4: float,
    g_x: float, g_y: float, g_z: float, mu_ground: float,
    muscle: ti.template(), damping: ti.template(), law: ti.template(), ground: ti.template(),
    width: ti.template(), transfer: ti.template(), part: ti.template(),
):  # fmt: skip
    """`count` repetitions of one part in every world, from slot 0."""
    ti.loop_config(serialize=True)
    for w in range(x.shape[1]):
        dt_g = dt * ti.Vector([g_x, g_y, g_z])
        constants = ti.Vector([m0, m1, m2, m3, m4])
        for _ in range(count):
            if ti.static(part == CLEAR):
                clear_window(other, window, 0, w)
                if ti.static(transfer == AFLIP):
                    clear_window(other_before, window, 0, w)
            elif ti.static(part == NODES):
                for i in range(window[0, w, 0], window[0, w, 3]):
                    for j in range(window[0, w, 1], window[0, w, 4]):
                        for k in range(window[0, w, 2], window[0, w, 5]):
                            update_node(grid, other, 0, i, j, k, dt_g, mu_ground, terrain, ground, law)
                            if ti.static(transfer == AFLIP):
                                divide_node(before, other_before, 0, i, j, k)
            else:
                for p in range(x.shape[2]):
                    particle_part(
                        x, v, C, F, b, history, tau, window, mass, volume, stiffness, tension, fibre, grid,
                        before, w, p, 1.0 / h, dt, mu, lam, eta, constants,
                        muscle, damping, law, width, transfer, part,
                    )  # fmt: skip


class Ablation:
    """A copy of a simulation's present state, on which the parts of a substep are repeated."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = sim = simulation
        worlds, like = sim.worlds, sim.matter.x
        self._matter = empty_matter(sim.scene, 2, worlds, like.dtype, str(like.device))
        self._matter.load_slot(0, sim.matter)
        shape = (1, *sim.launcher.shape, 4)
        flips = sim.fidelity.transfer == "aflip"

        def slabs() -> tuple[torch.Tensor, torch.Tensor]:
            """The nodes' motion, and that before forces (AFLIP)."""
            grid = torch.zeros(shape, dtype=like.dtype, device=like.device)
            return grid, torch.zeros_like(grid if flips else grid[:0])

        self._momenta, self._velocities = slabs(), slabs()
        for part in (SubstepPart.SCATTER, SubstepPart.NODES):
            self.repeat(part, 1, sim.limit.dt)

    @property
    def parts(self) -> list[SubstepPart]:
        """The parts that the scene calls for."""
        law = self._sim.launcher.flags[2]
        return [part for part in SubstepPart if part is not SubstepPart.DECOMPOSITION or law in DECOMPOSED]

    def repeat(self, part: SubstepPart, count: int, dt: float) -> None:
        """Repeat one part `count` times, with a step of `dt` [s]."""
        launcher = self._sim.launcher
        # particles gather velocities, which the nodes' part makes from momenta
        source = self._velocities if part is SubstepPart.GATHER else self._momenta
        repeat_part(
            *self._matter.tensors(), *self._sim.parameters.tensors(), launcher.terrain,
            source[0], self._velocities[0], source[1], self._velocities[1],
            count, dt, *launcher.constants, *launcher.flags, int(part),
        )  # fmt: skip
