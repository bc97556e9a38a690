"""The ground under mud: the traction that it bears, and the adjoint of its law."""
# ruff: noqa: ANN202  (the arguments of kernels are typed by the kernel compiler)

from dataclasses import replace

import numpy as np
import pytest
import taichi as ti
import torch

from tests.sim import scenes
from tests.sim.kernels.lanes import variant
from zoobench.arrays import Array
from zoobench.sim import runtime
from zoobench.sim.kernels.array_types import Rows
from zoobench.sim.kernels.boundary import PLANE, TERRAIN, WALL_NODES, contact, contact_adjoint
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.mud_wall import most_friction, most_friction_adjoint
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.scene import Ground, MediumBed, Scene
from zoobench.sim.solver import Solver

Vectors = ti.types.ndarray(dtype=ti.types.vector(3, float))

MUD = MudMaterial(1e5, 0.3, 1400.0, yield_stress=50.0, viscosity=1.0)
STRENGTH = 50.0 / np.sqrt(2.0)
CELLS, DEPTH = 8, 4
NODES = 20


def _sliding(friction: float) -> Scene:
    """A patch of mud that slides on the ground at 0.3 m/s, with a robot out of reach."""
    patch = scenes.medium_bed("mud", depth=DEPTH, cells=CELLS)
    load = MUD.density * 9.81 * (DEPTH * scenes.SPACING - patch.positions[:, 1])
    bed = MediumBed.at_rest(MUD, patch.positions, patch.volumes, MUD.rest_strains(load))
    bed = replace(bed, velocities=np.tile([0.3, 0.0, 0.0], (len(load), 1)), friction=0.5)
    block = scenes.passive_block((0.3, 0.5, 0.3), (2, 2, 2), np.zeros(3))
    return Scene(
        scenes.with_idle_muscle(block), (0, 0, 0), scenes.ARENA,
        ground=Ground(friction), medium=bed, gravity=(0.0, -9.81, 0.0),
    )  # fmt: skip


def _traction(friction: float) -> float:
    """What slows the patch in its first substeps, over its area [Pa]."""
    solver = Solver(_sliding(friction), scenes.fidelity())
    mud = slice(solver.robot_count, None)
    mass = solver.parameters.mass[0, mud].numpy()
    count, dt = 4, 1e-4
    solver.substeps(count, dt)
    lost = float(mass @ (0.3 - solver.matter.v[0, 0, mud, 0].numpy()))
    return lost / (count * dt) / (CELLS * scenes.SPACING) ** 2


@pytest.mark.slow
def test_rough_ground_bears_the_shear_strength_of_the_mud() -> None:
    """However rough it is: the friction times the weight would be forty times as much."""
    assert _traction(5.0) == pytest.approx(STRENGTH, rel=0.05)
    assert _traction(50.0) == pytest.approx(_traction(5.0), rel=1e-6)


@pytest.mark.slow  # the adjoint of its law is checked below
def test_smooth_ground_bears_friction_times_the_weight() -> None:
    """Coulomb's law where it asks for less than the strength; the patch's sides, which are free, press less."""
    weight = MUD.density * 9.81 * DEPTH * scenes.SPACING
    smooth, twice = _traction(0.005), _traction(0.01)
    assert 0.85 * 0.01 * weight < twice < 0.01 * weight < 0.5 * STRENGTH
    assert twice == pytest.approx(2 * smooth, rel=1e-3)


@ti.kernel
def _ground(
    v: Vectors, adjoint: Vectors, after: Vectors, back: Vectors, terrain: Rows, j: int, dt: float,
    variant: ti.template(),
):  # fmt: skip
    for p in range(v.shape[0]):
        medium = ti.Struct(yield_stress=50.0)
        scene = ti.Struct(
            friction=0.5, spacing=0.03, medium=medium, medium_full=1400.0 * 0.03**3,
            nodes_x=NODES, nodes_y=NODES, nodes_z=NODES,
        )  # fmt: skip
        c, at = Context(variant, scene=scene, terrain=terrain, dt=dt), (10, j, WALL_NODES)
        friction, limited = most_friction(c, v[p], at)
        after[p] = contact(c, v[p], at, friction, False, 0)
        back[p] = contact_adjoint(c, v[p], adjoint[p], at, friction, False, 0)
        back[p] += most_friction_adjoint(c, v[p], adjoint[p], friction, limited, at)


def _apply(v: Array, adjoint: Array, j: int, normal: Array | None) -> tuple[Array, Array]:
    """Velocities after a node `j` of the ground or of a terrain's columns of this normal, and the adjoints before."""
    runtime.start(64)
    tensors = [torch.as_tensor(array) for array in (v, adjoint, 0 * v, 0 * v)]
    terrain = torch.zeros((0, 0, 4), dtype=torch.float64)
    if normal is not None:
        terrain = torch.tensor([WALL_NODES + 0.3, *normal], dtype=torch.float64).repeat(NODES, NODES, 1)
    _ground(*tensors, terrain, j, 1e-2, variant(ground=PLANE if normal is None else TERRAIN))
    return tensors[2].numpy(), tensors[3].numpy()


@pytest.mark.parametrize("normal", [None, np.array([0.6, 0.8, 0.0])])
@pytest.mark.parametrize("j", [WALL_NODES, WALL_NODES - 1])
def test_the_adjoint_is_that_of_differences(j: int, normal: Array | None) -> None:
    """Of nodes that slide by the strength, by the friction, that stick, that leave, and that meet a side wall."""
    random = np.random.default_rng(3)
    v = random.normal(size=(200, 3)) * np.array([0.05, 0.2, 0.05])
    v[:40, [0, 2]] *= 1e-3
    adjoint = random.normal(size=v.shape)
    _, back = _apply(v, adjoint, j, normal)
    step, found = 1e-7, np.zeros_like(v)
    for d in range(3):
        change = step * np.eye(3)[d]
        above, below = _apply(v + change, adjoint, j, normal)[0], _apply(v - change, adjoint, j, normal)[0]
        found[:, d] = ((above - below) * adjoint).sum(1) / (2 * step)
    kinks = np.abs(found - back).max(1) > 1e-5
    assert kinks.sum() <= 1  # where a step crosses from one regime to the next
