"""The parts of a substep, each repeated alone on one state, to measure the time that each takes.

The parts are those of `serial.advance` and call the same functions. Each reads slot 0 and writes slot 1 (or a spare
half of the grid), so that every repetition does the same work. Arrays are those of `kernels.layout`.
"""

from enum import IntEnum

import taichi as ti

from zoobench.sim import runtime
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.columns import add, diagonal, from_symmetric, lanes, matmul, scale, to_symmetric
from zoobench.sim.kernels.context import Around, Context
from zoobench.sim.kernels.flip import divide_node
from zoobench.sim.kernels.laws.media import deform_medium, elastic_trial
from zoobench.sim.kernels.layout import (
    BEFORE,
    MASS,
    STRAIN,
    VELOCITY,
    C,
    F,
    V,
    X,
    box,
    columns,
    constants_of,
    layer,
    layers,
    put_columns,
    symmetric,
)
from zoobench.sim.kernels.serial import clear, update_nodes
from zoobench.sim.kernels.splines import stencil, weights
from zoobench.sim.kernels.substep import is_robot, linear_motion, particle_stress, to_grid
from zoobench.sim.kernels.symmetric import eigen_symmetric
from zoobench.sim.kernels.transfer import AFLIP, gather_affine
from zoobench.sim.model.state import empty_matter
from zoobench.sim.model.tensors import lazy_zeros
from zoobench.sim.simulation import Simulation


class SubstepPart(IntEnum):
    """The parts of a substep.

    DECOMPOSITION is contained in DEFORM where a medium is far from rest: the trial strain and its principal values,
    without the return to the yield surface. It is measured as if every particle were.
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
def particle_part(c: ti.template(), p, spare, part: ti.template()):
    """One particle's share of one part."""
    at = stencil(c.state[0, c.w, p, X], c.scene, layer(c, p), c.variant.width)
    if ti.static(part == STRESS):
        put_columns(c.state, 1, c.w, p, C, particle_stress(c, p))
    if ti.static(part == SCATTER):
        origin, slope = linear_motion(c, p, c.body[c.w, p, 0][MASS], at)
        given = ti.Struct(node=at.node, offset=at.offset, origin=origin, slope=slope)
        to_grid(c, p, given, None)
    if ti.static(part == GATHER):
        share = weights(at.offset, c.variant.width)
        near = Around(at, share)
        velocity, rate = gather_affine(c.field(VELOCITY), near, c.scene.inverse)
        c.state[1, c.w, p, X] = c.state[0, c.w, p, X] + c.dt * velocity
        if ti.static(c.variant.uses(AFLIP)):
            before, affine = gather_affine(c.field(BEFORE, spare), near, c.scene.inverse)
            velocity += before
            rate = add(rate, affine)
        c.state[1, c.w, p, V] = velocity
        put_columns(c.state, 1, c.w, p, C, rate)
    if ti.static(part in (DEFORM, DECOMPOSITION)):
        change = scale(c.dt, columns(c.state, 0, c.w, p, C))
        step = add(diagonal(1.0 + 0.0 * c.dt), change)
        if is_robot(c, p):
            if ti.static(part == DEFORM):
                deformation = columns(c.state, 0, c.w, p, F)
                put_columns(c.state, 1, c.w, p, F, add(deformation, matmul(change, deformation)))
        elif ti.static(part == DEFORM and c.variant.has_medium):
            deform_medium(c, p, step, 1.0 + 0.0 * c.dt, 1.0 + 0.0 * c.dt)
        elif ti.static(part == DECOMPOSITION):
            trial = elastic_trial(step, from_symmetric(symmetric(c.state, 0, c.w, p, STRAIN)))
            squares, frame = eigen_symmetric(to_symmetric(trial))
            c.state[1, c.w, p, V] = lanes(squares[0], squares[1], squares[2], 0.0)
            for d in ti.static(range(3)):
                c.state[1, c.w, p, C + d] = lanes(frame[0, d], frame[1, d], frame[2, d], 0.0)
    if ti.static(part == WINDOW):
        first = (at.x, at.y, at.z)
        for d in ti.static(range(3)):
            c.window[1, c.w, d] = ti.min(c.window[1, c.w, d], first[d])
            c.window[1, c.w, 3 + d] = ti.max(c.window[1, c.w, 3 + d], first[d] + c.variant.width)


@ti.kernel
def repeat_part(
    state: Rows, window: Scalars, body: Rows, constants: Scalars, terrain: Rows, grid: Rows,
    count: int, dt: float, variant: ti.template(), part: ti.template(),
):  # fmt: skip
    """`count` repetitions of one part in every world, from slot 0."""
    ti.loop_config(serialize=True)
    for w in range(state.shape[1]):
        scene = constants_of(constants, variant)
        nodes, spare = box(window, 0, w), grid.shape[1] // 2
        c = Context(
            variant, state=state, window=window, window_slot=0, body=body, grid=grid, terrain=terrain, scene=scene,
            nodes=nodes, dt=dt, w=w, s=0, t=1, start=0,
        )  # fmt: skip
        size = layers(variant) * nodes.size
        for _ in range(count):
            if ti.static(part == CLEAR):
                clear(grid, spare, size, variant)
            elif ti.static(part == NODES):
                update_nodes(c)
                if ti.static(variant.uses(AFLIP)):
                    for m in range(size):
                        grid[BEFORE, spare + m] = grid[BEFORE, m]
                        divide_node(grid, spare + m)
            else:
                for p in range(state.shape[2]):
                    particle_part(c, p, spare, part)


class Ablation:
    """A copy of a simulation's present state, on which the parts of a substep are repeated."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = sim = simulation
        real, device = sim.matter.state.dtype, str(sim.matter.state.device)
        self._matter = empty_matter(sim.scene, 2, sim.worlds, real, device)
        self._matter.load_slot(0, sim.matter)
        self._grid = lazy_zeros((sim.launcher.fields, 2 * sim.launcher.nodes_of_a_world, 4), real, device)
        for part in (SubstepPart.SCATTER, SubstepPart.NODES):
            self.repeat(part, 1, sim.limit.dt)

    @property
    def parts(self) -> list[SubstepPart]:
        """The parts that the scene calls for."""
        decomposed = self._sim.launcher.variant.decomposed
        return [part for part in SubstepPart if part is not SubstepPart.DECOMPOSITION or decomposed]

    def repeat(self, part: SubstepPart, count: int, dt: float) -> None:
        """Repeat one part `count` times, with a step of `dt` [s]."""
        launcher = self._sim.launcher
        with runtime.vector_lanes():
            repeat_part(
                *self._matter.particles, self._sim.parameters.body, launcher.constants, launcher.terrain, self._grid,
                count, dt, launcher.variant, int(part),
            )  # fmt: skip
