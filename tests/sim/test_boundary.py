"""Contact with ground and walls: the node's law by hand, and blocks on inclines against closed forms."""
# ruff: noqa: ANN202  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import pytest
import taichi as ti
import torch

from tests.sim import scenes
from zoobench.sim import runtime
from zoobench.sim.array_types import Nodes, Vectors
from zoobench.sim.boundary import PLANE, TERRAIN, WALL_NODES, contact, contact_adjoint
from zoobench.sim.rollout import Rollout
from zoobench.sim.scene import Ground, Scene
from zoobench.sim.solver import Solver

NODE_COUNT = 20
INSIDE, FLOOR = 10, WALL_NODES


@ti.kernel
def _contact(
    v: Vectors, pull: Vectors, after: Vectors, back: Vectors, terrain: Nodes, i: int, j: int, k: int, mu: float,
    ground: ti.template(),
):  # fmt: skip
    for p in range(v.shape[0]):
        index, shape = ti.Vector([i, j, k]), ti.Vector([NODE_COUNT, NODE_COUNT, NODE_COUNT])
        after[p] = contact(v[p], index, shape, mu, terrain, ground)
        back[p] = contact_adjoint(v[p], pull[p], index, shape, mu, terrain, ground)


def _apply(
    v: np.ndarray,
    index: tuple[int, int, int],
    mu: float,
    pull: np.ndarray | None = None,
    column: tuple[float, float, float, float] | None = None,
) -> list[np.ndarray]:
    """Velocity after contact and the adjoint of it; on a terrain whose columns are all alike if one is given."""
    runtime.start(64)
    tensors = [torch.as_tensor(np.atleast_2d(a)) for a in (v, v if pull is None else pull, 0 * v, 0 * v)]
    terrain = torch.zeros((0, 0, 4), dtype=torch.float64)
    if column is not None:
        terrain = torch.tensor(column, dtype=torch.float64).repeat(NODE_COUNT, NODE_COUNT, 1)
    _contact(*tensors, terrain, *index, mu, PLANE if column is None else TERRAIN)
    return [tensors[2].numpy(), tensors[3].numpy()]


def test_coulomb_law_of_a_node() -> None:
    """A pressed node sticks inside the friction cone and slides outside it; a separating node is free."""
    v = np.array([[0.3, -1.0, 0.4], [3.0, -1.0, 4.0], [3.0, 1.0, 4.0], [3.0, 0.0, 4.0]])
    after, _ = _apply(v, (INSIDE, FLOOR, INSIDE), 0.6)
    assert np.allclose(after, [[0, 0, 0], [3 * 0.88, 0, 4 * 0.88], [3, 1, 4], [3, 0, 4]], atol=1e-15)
    above, _ = _apply(v, (INSIDE, FLOOR + 1, INSIDE), 0.6)
    assert np.array_equal(above, v)


def test_walls_stop_only_what_moves_into_them() -> None:
    """Each wall takes the velocity into it and leaves the rest, the ceiling included."""
    v = np.array([[-1.0, 0.5, -1.0], [1.0, 0.5, 1.0]])
    low, _ = _apply(v, (WALL_NODES, INSIDE, WALL_NODES), 0.6)
    high, _ = _apply(v, (NODE_COUNT - 1 - WALL_NODES, NODE_COUNT - 1 - WALL_NODES, INSIDE), 0.6)
    assert np.array_equal(low, [[0, 0.5, 0], [1, 0.5, 1]])
    assert np.array_equal(high, [[-1, 0, -1], [0, 0, 1]])


def test_adjoint_of_contact_matches_differences() -> None:
    """The adjoint is the transposed derivative on the floor and in the corner of floor and wall."""
    rng = np.random.default_rng(4)
    v, pull, step = rng.normal(size=(500, 3)), rng.normal(size=(500, 3)), rng.normal(size=(500, 3))
    for index in ((INSIDE, FLOOR, INSIDE), (WALL_NODES, FLOOR, INSIDE)):
        _, back = _apply(v, index, 0.6, pull)
        e = 1e-6
        slope = (_apply(v + e * step, index, 0.6)[0] - _apply(v - e * step, index, 0.6)[0]) / (2 * e)
        difference = np.abs((slope * pull).sum(1) - (back * step).sum(1))
        assert (difference > 1e-6).sum() == 0


def test_contact_with_a_slope_is_that_of_the_plane_turned() -> None:
    """Friction and its adjoint act in the frame of the terrain's normal; a node above its column's height is free."""
    rng = np.random.default_rng(5)
    v, pull = rng.normal(size=(200, 3)), rng.normal(size=(200, 3))
    angle = 0.4
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    normal = turn @ [0.0, 1.0, 0.0]
    flat = _apply(v, (INSIDE, FLOOR, INSIDE), 0.6, pull)
    column = (7.3, *normal.tolist())
    for height, touches in ((7, True), (8, False)):
        tilted = _apply(v @ turn.T, (INSIDE, height, INSIDE), 0.6, pull @ turn.T, column)
        for found, expected, free in zip(tilted, flat, (v, pull), strict=True):
            assert np.allclose(found, (expected if touches else free) @ turn.T, atol=1e-14)


def _incline(degrees: float, friction: float, frames: int) -> tuple[Solver, Rollout, np.ndarray]:
    """A flat stiff block on a plane tilted about z: solver, path and the path of its centre."""
    angle = np.radians(degrees)
    body = scenes.passive_block((0.2, 0.0, 0.3), (6, 3, 3), np.zeros(3))
    gravity = (9.81 * float(np.sin(angle)), -9.81 * float(np.cos(angle)), 0.0)
    scene = Scene(body, (0, 0, 0), (3.0, 0.4, 0.75), ground=Ground(friction), gravity=gravity)
    solver = Solver(scene, scenes.fidelity())
    rollout = solver.run(np.zeros((frames, 1, 0)))
    assert not rollout.divergences
    return solver, rollout, rollout.positions[:, 0].mean(1)


def test_block_sticks_on_a_gentle_incline() -> None:
    """With tan(angle) below the friction coefficient the settled block creeps by less than 1/50 cell."""
    _, _, centre = _incline(15.0, 0.4, 100)
    assert abs(centre[-1, 0] - centre[40, 0]) < 0.02 * scenes.SPACING


@pytest.mark.parametrize(("degrees", "friction"), [(20.0, 0.1), (20.0, 0.2), (30.0, 0.4), (15.0, 0.0)])
def test_block_slides_the_analytic_distance(degrees: float, friction: float) -> None:
    """After settling it accelerates with g (sin - mu cos), to 2 % of the distance."""
    _, rollout, centre = _incline(degrees, friction, 100)
    first = 30
    angle = np.radians(degrees)
    seconds = 0.008 * (100 - first)
    acceleration = 9.81 * (np.sin(angle) - friction * np.cos(angle))
    expected = rollout.velocities[first, 0, :, 0].mean() * seconds + acceleration * seconds**2 / 2
    assert centre[-1, 0] - centre[first, 0] == pytest.approx(expected, rel=0.02)


def test_separating_body_leaves_the_ground_freely() -> None:
    """A block launched from the ground follows the ballistic path exactly: contact only pushes."""
    start = np.array([0.4, 1.2, 0.0])
    body = scenes.passive_block((0.2, 0.0, 0.3), (3, 3, 3), start)
    scene = Scene(body, (0, 0, 0), scenes.ARENA, ground=Ground(0.9))
    solver = Solver(scene, scenes.steady(scene))
    frames = 14
    rollout = solver.run(np.zeros((frames, 1, 0)))
    steps = np.arange(frames + 1) * solver.substeps_per_frame
    exact = start * (steps * solver.dt)[:, None]
    exact[:, 1] -= 9.81 * solver.dt**2 * steps * (steps + 1) / 2
    moved = (rollout.positions - body.positions)[:, 0]
    assert np.abs(moved - exact[:, None]).max() <= 1e-10


def test_arena_walls_hold_a_body_and_let_it_go() -> None:
    """A block thrown against a wall stays inside the arena and comes back."""
    body = scenes.passive_block((0.55, 0.3, 0.3), (3, 3, 3), np.array([2.0, 0.0, 0.0]))
    solver = Solver(Scene(body, (0, 0, 0), scenes.ARENA, gravity=scenes.NO_GRAVITY), scenes.fidelity())
    rollout = solver.run(np.zeros((25, 1, 0)))
    assert not rollout.divergences
    assert rollout.positions[..., 0].max() < 0.75 + scenes.SPACING
    assert rollout.velocities[-1, 0, :, 0].mean() < -1.0
