"""Contact with ground and walls: the node's law by hand, and blocks on inclines against closed forms."""
# ruff: noqa: ANN202  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import pytest
import taichi as ti
import torch

from tests.sim import scenes
from tests.sim.kernels.lanes import variant
from zoobench.sim import runtime
from zoobench.sim.kernels.array_types import Rows
from zoobench.sim.kernels.boundary import (
    PLANE,
    TERRAIN,
    WALL_NODES,
    contact,
    contact_adjoint,
    wall_pressure,
    wall_pressure_adjoint,
)
from zoobench.sim.kernels.context import Context
from zoobench.sim.model.ground_skin import SKIN
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.standing import standing
from zoobench.sim.solver import Solver

Vectors = ti.types.ndarray(dtype=ti.types.vector(3, float))

NODE_COUNT = 20
INSIDE, FLOOR = 10, WALL_NODES


@ti.kernel
def _contact(
    v: Vectors, adjoint: Vectors, after: Vectors, back: Vectors, terrain: Rows, i: int, j: int, k: int, mu: float,
    variant: ti.template(), tight: ti.template(),
):  # fmt: skip
    for p in range(v.shape[0]):
        scene = ti.Struct(nodes_x=NODE_COUNT, nodes_y=NODE_COUNT, nodes_z=NODE_COUNT)
        c = Context(variant, scene=scene, terrain=terrain)
        after[p] = contact(c, v[p], (i, j, k), mu, tight, 0)
        back[p] = contact_adjoint(c, v[p], adjoint[p], (i, j, k), mu, tight, 0)


def _apply(
    v: np.ndarray,
    index: tuple[int, int, int],
    mu: float,
    adjoint: np.ndarray | None = None,
    column: tuple[float, float, float, float] | None = None,
    tight: bool = False,
) -> list[np.ndarray]:
    """Velocity after contact and the adjoint of it; on a terrain whose columns are all alike if one is given."""
    runtime.start(64)
    tensors = [torch.as_tensor(np.atleast_2d(a)) for a in (v, v if adjoint is None else adjoint, 0 * v, 0 * v)]
    terrain = torch.zeros((0, 0, 4), dtype=torch.float64)
    if column is not None:
        terrain = torch.tensor(column, dtype=torch.float64).repeat(NODE_COUNT, NODE_COUNT, 1)
    _contact(*tensors, terrain, *index, mu, variant(ground=PLANE if column is None else TERRAIN), tight)
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
    v, adjoint, step = rng.normal(size=(500, 3)), rng.normal(size=(500, 3)), rng.normal(size=(500, 3))
    behind = WALL_NODES - 1
    for index in ((INSIDE, FLOOR, INSIDE), (WALL_NODES, FLOOR, INSIDE), (behind, FLOOR - 1, NODE_COUNT - 1 - behind)):
        for tight in (False, True):
            _, back = _apply(v, index, 0.6, adjoint, tight=tight)
            e = 1e-6
            high, low = (_apply(v + sign * e * step, index, 0.6, tight=tight)[0] for sign in (1, -1))
            difference = np.abs(((high - low) / (2 * e) * adjoint).sum(1) - (back * step).sum(1))
            assert (difference > 1e-6).sum() == 0


def test_tight_walls_leave_the_velocity_behind_them_to_press() -> None:
    """Along the normal of each wall, with the friction that it causes; elsewhere they are the walls that they were."""
    v = np.array([[-0.5, -1.0, 0.75]])
    corner = (WALL_NODES - 1, FLOOR - 1, INSIDE)
    assert np.array_equal(_apply(v, corner, 0.0, tight=True)[0], v)
    assert np.allclose(_apply(v, corner, 0.6, tight=True)[0][0, 1:], [-1.0, 0.75 * (1 - 0.6 / np.hypot(0.5, 0.75))])
    for index in ((WALL_NODES, FLOOR, INSIDE), (WALL_NODES - 2, INSIDE, INSIDE), (INSIDE, INSIDE, INSIDE)):
        assert np.array_equal(_apply(v, index, 0.6, tight=True)[0], _apply(v, index, 0.6)[0])


@ti.kernel
def _press(given: Rows, adjoint: Rows, after: Rows, back: Rows):
    for p in range(given.shape[0]):
        q, up = given[p], adjoint[p]
        behind, before = wall_pressure(q[0], q[1], q[2], q[3])
        after[p] = ti.Vector([behind, before, 0.0, 0.0])
        back[p] = wall_pressure_adjoint(q[0], behind, before, q[2], q[3], up[0], up[1])


def _pressed(given: np.ndarray, adjoint: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocities `[n, 2]` behind and before a wall after its pressure, and the adjoints `[n, 4]`."""
    runtime.start(64)
    tensors = [torch.as_tensor(a) for a in (given, np.hstack([adjoint, 0 * adjoint]), 0 * given, 0 * given)]
    _press(*tensors)
    return tensors[2].numpy()[:, :2], tensors[3].numpy()


def _pairs(count: int) -> np.ndarray:
    """Velocities and masses behind and before a wall."""
    rng = np.random.default_rng(6)
    return np.hstack([rng.normal(size=(count, 2)), rng.uniform(0.1, 1.0, (count, 2))])


def test_a_wall_presses_with_the_least_impulse() -> None:
    """Nothing moves into its plane, both nodes get the same impulse, away from it; a separating pair gets none."""
    given = _pairs(500)
    after, _ = _pressed(given, np.zeros((500, 2)))
    parts = given[:, :2].sum(1) >= 0.0
    assert 100 < parts.sum() < 400
    assert np.array_equal(after[parts], given[parts, :2])
    assert np.abs(after[~parts].sum(1)).max() <= 1e-15
    impulse = (given[:, 2:] * (after - given[:, :2]))[~parts]
    assert np.allclose(impulse[:, 0], impulse[:, 1], atol=1e-15)
    assert (impulse > 0.0).all()


def test_a_wall_stops_matter_that_is_all_behind_it() -> None:
    """Without matter before it, the node behind stops."""
    after, _ = _pressed(np.array([[-1.0, 0.0, 0.5, 0.0], [1.0, 0.0, 0.5, 0.0]]), np.zeros((2, 2)))
    assert np.array_equal(after, [[0.0, 0.0], [1.0, 0.0]])


def test_adjoint_of_press_matches_differences() -> None:
    """By both velocities and both masses."""
    given, rng, e = _pairs(500), np.random.default_rng(7), 1e-6
    adjoint, step = rng.normal(size=(500, 2)), rng.normal(size=(500, 4))
    _, back = _pressed(given, adjoint)
    high, low = (_pressed(given + sign * e * step, adjoint)[0] for sign in (1, -1))
    assert np.abs(((high - low) / (2 * e) * adjoint).sum(1) - (back * step).sum(1)).max() <= 1e-7


def test_contact_with_a_slope_is_that_of_the_plane_turned() -> None:
    """Friction and its adjoint act in the frame of the terrain's normal; a node above its column's height is free."""
    rng = np.random.default_rng(5)
    v, adjoint = rng.normal(size=(200, 3)), rng.normal(size=(200, 3))
    angle = 0.4
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    normal = turn @ [0.0, 1.0, 0.0]
    flat = _apply(v, (INSIDE, FLOOR, INSIDE), 0.6, adjoint)
    column = (7.3, *normal.tolist())
    for height, touches in ((7, True), (8, False)):
        tilted = _apply(v @ turn.T, (INSIDE, height, INSIDE), 0.6, adjoint @ turn.T, column)
        for found, expected, free in zip(tilted, flat, (v, adjoint), strict=True):
            assert np.allclose(found, (expected if touches else free) @ turn.T, atol=1e-14)


def _incline(degrees: float, friction: float, frames: int) -> tuple[Solver, Rollout, np.ndarray]:
    """A flat stiff block on a plane tilted about z: solver, trajectory and that of its centre."""
    angle = np.radians(degrees)
    body = scenes.passive_block((0.2, 0.0, 0.3), (6, 3, 3), np.zeros(3))
    gravity = (9.81 * float(np.sin(angle)), -9.81 * float(np.cos(angle)), 0.0)
    scene = Scene(body, (0, 0, 0), (3.0, 0.4, 0.75), ground=Ground(friction), gravity=gravity)
    solver = Solver(standing(scene, scenes.EDGE), scenes.fidelity())
    rollout = solver.run(np.zeros((frames, 1, 0)))
    assert not rollout.divergences
    return solver, rollout, rollout.positions[:, 0].mean(1)


@pytest.mark.slow
def test_block_sticks_on_a_gentle_incline() -> None:
    """With tan(angle) below the friction coefficient the equilibrated block creeps by less than 1/50 cell."""
    _, _, centre = _incline(15.0, 0.4, 100)
    assert abs(centre[-1, 0] - centre[40, 0]) < 0.02 * scenes.SPACING


@pytest.mark.parametrize(("degrees", "friction"), [(20.0, 0.1), (20.0, 0.2), (30.0, 0.4), (15.0, 0.0)])
def test_block_slides_the_analytic_distance(degrees: float, friction: float) -> None:
    """After equilibration it accelerates with g (sin - mu cos), to 2 % of the distance."""
    _, rollout, centre = _incline(degrees, friction, 100)
    first = 30
    angle = np.radians(degrees)
    seconds = 0.008 * (100 - first)
    acceleration = 9.81 * (np.sin(angle) - friction * np.cos(angle))
    expected = rollout.velocities[first, 0, :, 0].mean() * seconds + acceleration * seconds**2 / 2
    assert centre[-1, 0] - centre[first, 0] == pytest.approx(expected, rel=0.02)


def test_separating_body_leaves_the_ground_freely() -> None:
    """A block launched from the skin's surface follows the ballistic path exactly: contact only pushes."""
    start = np.array([0.4, 1.2, 0.0])
    body = scenes.passive_block((0.2, SKIN.thickness, 0.3), (3, 3, 3), start)
    scene = Scene(body, (0, 0, 0), scenes.ARENA, ground=Ground(0.9))
    solver = Solver(scene, scenes.steady(scene))
    frames = 14
    rollout = solver.run(np.zeros((frames, 1, 0)))
    moved = (rollout.positions - body.positions)[:, 0]
    assert np.abs(moved - scenes.thrown(solver, start, frames)[:, None]).max() <= 1e-10


def test_arena_walls_hold_a_body_and_let_it_go() -> None:
    """A block thrown against a wall stays inside the arena and comes back."""
    body = scenes.passive_block((0.55, 0.3, 0.3), (3, 3, 3), np.array([2.0, 0.0, 0.0]))
    solver = Solver(scenes.weightless(body), scenes.fidelity())
    rollout = solver.run(np.zeros((25, 1, 0)))
    assert not rollout.divergences
    assert rollout.positions[..., 0].max() < 0.75 + scenes.SPACING
    assert rollout.velocities[-1, 0, :, 0].mean() < -1.0
