"""The skin of firm ground in kernels: the force by its NumPy twin, friction by hand, derivatives by differences."""
# ruff: noqa: ANN202  (the arguments of kernels are typed by the kernel compiler)

import numpy as np
import taichi as ti
import torch

from tests.sim import scenes
from tests.sim.kernels.lanes import variant
from zoobench.sim import runtime
from zoobench.sim.kernels.array_types import Rows, Scalars
from zoobench.sim.kernels.boundary import PLANE, TERRAIN, WALL_NODES
from zoobench.sim.kernels.context import Context
from zoobench.sim.kernels.layout import CONSTANTS, scene_constants
from zoobench.sim.kernels.skin_contact import coulomb_friction, coulomb_friction_adjoint, ground_below, layer_force
from zoobench.sim.model.ground_skin import SKIN

H = scenes.SPACING
NODES = 12
GIVEN = {
    "spacing": H, "nodes_x": NODES, "nodes_y": NODES, "nodes_z": NODES,
    "skin_thickness": SKIN.thickness, "skin_rate": SKIN.rate, "edge": scenes.EDGE,
}  # fmt: skip


@ti.kernel
def _push_all(constants: Scalars, terrain: Rows, places: Rows, found: Rows, variant: ti.template()):
    """Of every place: (gap, force, its derivative, 0), the gap's gradient, the normal, its derivatives by x and z."""
    ti.loop_config(serialize=True)
    for p in range(places.shape[0]):
        scene = scene_constants(constants)
        below = ground_below(Context(variant, scene=scene, terrain=terrain), places[p])
        force, rate = layer_force(below.gap, scene.edge, scene)
        found[p, 0] = ti.Vector([below.gap, force, rate, 0.0])
        found[p, 1] = below.slope
        found[p, 2] = below.normal
        found[p, 3] = below.by_x
        found[p, 4] = below.by_z


def _pushed(places: np.ndarray, columns: np.ndarray | None = None) -> np.ndarray:
    """What `_push_all` finds `[n, 5, 4]` at places `[n, 3]` above a plane, or node columns `[nx, nz, 4]`."""
    runtime.start(64)
    rows = torch.as_tensor(np.hstack([places, np.zeros((len(places), 1))]))
    found = torch.zeros((len(places), 5, 4), dtype=torch.float64)
    terrain = torch.zeros((0, 0, 4), dtype=torch.float64) if columns is None else torch.as_tensor(columns)
    constants = torch.tensor([float(GIVEN.get(name, 0.0)) for name in CONSTANTS], dtype=torch.float64)
    _push_all(constants, terrain, rows, found, variant(ground=PLANE if columns is None else TERRAIN))
    return found.numpy()


def test_force_is_that_of_the_numpy_twin() -> None:
    """At heights deep in the layer, partly in it, and out of its reach; its derivative is that of differences."""
    height = np.linspace(-0.02, 0.02, 401)
    places = np.stack([0.2 + 0 * height, height + WALL_NODES * H, 0.2 + 0 * height], axis=1)
    found, e = _pushed(places), 1e-7
    assert np.allclose(found[:, 0, 0], height, atol=1e-15)
    assert np.allclose(found[:, 0, 1], SKIN.force(height, scenes.EDGE), rtol=1e-12, atol=1e-6)
    rate = (SKIN.force(height + e, scenes.EDGE) - SKIN.force(height - e, scenes.EDGE)) / (2 * e)
    assert np.abs(found[:, 0, 2] - rate).max() <= 1e-5 * np.abs(rate).max()
    assert (found[:, 2] == [0.0, 1.0, 0.0, 0.0]).all()


def test_derivatives_on_a_terrain_match_differences() -> None:
    """Of the distance and of the normal, in every direction; both are continuous from column to column."""
    rng = np.random.default_rng(3)
    normals = np.concatenate([np.zeros((NODES, NODES, 1)), np.ones((NODES, NODES, 1)), np.zeros((NODES, NODES, 1))], -1)
    normals += 0.2 * rng.normal(size=normals.shape)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    columns = np.concatenate([5.0 + rng.normal(size=(NODES, NODES, 1)), normals], axis=-1)
    places, e = H * rng.uniform(3.0, 8.0, size=(300, 3)), 1e-8 * H
    found = _pushed(places, columns)
    for d, derivative in ((0, 3), (1, None), (2, 4)):
        high, low = (_pushed(places + sign * e * np.eye(3)[d], columns) for sign in (1, -1))
        change = (high - low) / (2 * e)
        assert np.abs(change[:, 0, 0] - found[:, 1, d]).max() <= 1e-6
        due = 0.0 if derivative is None else found[:, derivative]
        assert np.abs(change[:, 2] - due).max() <= 1e-5
    border = H * np.array([[5.0, 5.5, 6.3], [5.4, 5.5, 6.0]])
    near, far = (_pushed(border + sign * 1e-9 * H, columns) for sign in (1, -1))
    assert np.abs(near[:, [0, 2]] - far[:, [0, 2]])[..., :1].max() <= 1e-7


@ti.kernel
def _rub_all(v: Rows, a: Rows, up: Rows, after: Rows, by_v: Rows, by_a: Rows, friction: float):
    for p in range(v.shape[0]):
        speed, push, adjoint = (
            ti.Vector([v[p][0], v[p][1], v[p][2]]),
            ti.Vector([a[p][0], a[p][1], a[p][2]]),
            ti.Vector([up[p][0], up[p][1], up[p][2]]),
        )
        u = coulomb_friction(speed, push, friction)
        first, second = coulomb_friction_adjoint(speed, push, adjoint, friction)
        after[p] = ti.Vector([u[0], u[1], u[2], 0.0])
        by_v[p] = ti.Vector([first[0], first[1], first[2], 0.0])
        by_a[p] = ti.Vector([second[0], second[1], second[2], 0.0])


def _rubbed(v: np.ndarray, a: np.ndarray, up: np.ndarray | None = None, friction: float = 0.6) -> list[np.ndarray]:
    """Velocities `[n, 3]` after friction, and the adjoints by velocity and push."""
    runtime.start(64)
    zero = np.zeros((len(v), 1))
    given = [torch.as_tensor(np.hstack([q, zero])) for q in (v, a, v if up is None else up)]
    made = [torch.zeros((len(v), 4), dtype=torch.float64) for _ in range(3)]
    _rub_all(*given, *made, friction)
    return [tensor.numpy()[:, :3] for tensor in made]


def test_friction_stays_inside_the_cone() -> None:
    """A node sticks where friction times the push is enough, slides on by the rest, and is free without a push."""
    v = np.array([[0.3, -1.0, 0.4], [3.0, 1.0, 4.0], [3.0, -1.0, 4.0]])
    a = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    after, _, _ = _rubbed(v, a)
    assert np.allclose(after, [[0, -1, 0], [3 * 0.88, 1, 4 * 0.88], [3, -1, 4]], atol=1e-15)
    rng = np.random.default_rng(1)
    v, a = rng.normal(size=(2, 500, 3))
    lost = v - _rubbed(v, a)[0]
    size = np.linalg.norm(a, axis=1)
    assert np.abs((lost * a).sum(1)).max() <= 1e-14
    assert (np.linalg.norm(lost, axis=1) <= 0.6 * size * (1 + 1e-12)).all()
    assert ((lost * v).sum(1) >= 0.0).all()


def test_adjoint_of_friction_matches_differences() -> None:
    """By the velocity and by the push, of sticking and of sliding nodes."""
    rng, e = np.random.default_rng(2), 1e-7
    v, a, up, dv, da = rng.normal(size=(5, 500, 3))
    _, by_v, by_a = _rubbed(v, a, up)
    high, low = (_rubbed(v + sign * e * dv, a + sign * e * da)[0] for sign in (1, -1))
    difference = ((high - low) / (2 * e) * up).sum(1)
    error = np.abs(difference - (by_v * dv + by_a * da).sum(1)) / (1.0 + np.abs(difference))
    assert (error > 1e-6).sum() == 0
