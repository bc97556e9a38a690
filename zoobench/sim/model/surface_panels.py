"""Panels of a robot's surface, for the kernels of water by forces: triangles that face alike in a cube of its body.

A panel lies in the cell of the nearest particle, and moves as the cell's nodes have it. Eight panels of a cell are a
group, the lanes of a vector. On relaxed matter water acts by the third power of its occupancy, as its stiffness does.

Water would fling about nodes that have hardly any mass. So cells that weak points hold (`rest_cells`) have no panels,
and no part in second derivatives; a node with little of its cell's matter has little part in the motion of a panel, and
of the force on it; and second derivatives are those of the quadratic that fits the nodes by the matter that each has.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.potential_flow import areas
from zoobench.sim.model.rest_cells import LANES, WEAKEST, RestCells, trilinear
from zoobench.sim.model.surface_water import SurfaceWater

_STEADY = 1e-5
"""Share by which a second derivative is held that the nodes around do not tell, as across a thin fin."""

_LEAST = 1e-6
"""Matter of a node that has none, by that of the fullest."""

_LIGHT = 0.05
"""Matter of a node that counts half, by that of the fullest of its cell."""

_UNEQUAL = np.array([1.0, 1.0 - 1e-6, 1.0 - 2e-6])
"""Weights of the axes, by which triangles that face two sides alike are told apart by more than rounding."""

Ints = NDArray[np.int32]


@dataclass(frozen=True)
class SurfacePanels:
    """Panels in groups of eight.

    Attributes:
        cell: `[groups]` of the body's cells.
        weights: `[groups, 8, 8]` weight of each of the cell's nodes at each panel.
        given: `[groups, 8, 8]` properties of the panels, as `kernels.panel_forces` has them.
        around: `[groups, K]` nodes about the cell.
        bend: `[groups, K, 6]` their share in the second derivatives of place (xx yy zz yz xz xy) [1/m^2].
    """

    cell: Ints
    weights: Array
    given: Array
    around: Ints
    bend: Array

    @classmethod
    def of(cls, body: ElasticBody, water: SurfaceWater, cells: RestCells, grid_spacing: float) -> "SurfacePanels":
        """The panels of a body's hull in its cells."""
        assert water.hull is not None
        triangles = water.hull.triangles
        middles = triangles.mean(axis=1)
        cell, occupancy = _nearest_particles(body, cells, middles)
        vectors = areas(triangles) * occupancy[:, None] ** 3
        sizes = np.linalg.norm(vectors, axis=1)
        side = (np.abs(vectors) * _UNEQUAL).argmax(axis=1)
        facing = 2 * side + (vectors[np.arange(len(side)), side] > 0)
        low = cells.places[cells.nodes[:, 0]]
        at = ((middles - low[cell]) / grid_spacing).clip(0.0, 1.0)
        octant = (2 * at).astype(int).clip(0, 1) @ (4, 2, 1)
        _, panel = np.unique(np.stack([cell, octant, facing]), axis=1, return_inverse=True)
        panel = panel.ravel()
        columns = np.column_stack(
            [vectors, sizes, water.density * water.hull.phi * sizes, sizes * water.hull.growth,
             sizes[:, None] * at]
        )  # fmt: skip
        sums = np.zeros((panel.max() + 1, columns.shape[1]))
        np.add.at(sums, panel, columns)
        wetted = sums[:, 3]
        share = wetted / np.maximum(np.linalg.norm(sums[:, :3], axis=1), 1e-3 * wetted)
        ahead = sums[:, 0] * share / wetted
        rows = np.column_stack([sums[:, :3], share, wetted, sums[:, 4], sums[:, 5] / wetted, ahead])
        owner = np.zeros(len(rows), np.int64)
        owner[panel] = cell
        group, lanes = _in_groups(owner)
        places, given = np.zeros((len(group), LANES, 3)), np.zeros((len(group), LANES, rows.shape[1]))
        used = lanes >= 0
        places[used], given[used] = (sums[:, 6:] / wetted[:, None])[lanes[used]], rows[lanes[used]]
        matter = _matter(body, cells)
        own = matter[cells.nodes[group]]
        weights = trilinear(places) * (own / (own + _LIGHT * own.max(axis=1, keepdims=True)))[..., None]
        around, bend = _second_derivatives(matter, cells, group)
        return cls(
            cell=group.astype(np.int32),
            weights=weights / weights.sum(axis=1, keepdims=True) * used[:, None],
            given=given.transpose(0, 2, 1),
            around=around,
            bend=bend,
        )

    @classmethod
    def none(cls) -> "SurfacePanels":
        """Those of a robot out of such water."""
        whole, lanes = np.zeros((0, 0), np.int32), np.zeros((0, LANES, LANES))
        return cls(cell=whole.ravel(), weights=lanes, given=lanes, around=whole, bend=np.zeros((0, 0, 6)))


def _nearest_particles(body: ElasticBody, cells: RestCells, points: Array) -> tuple[NDArray[np.int64], Array]:
    """The cell of the particle of a held cell that is nearest to each point `[n]`, and its occupancy.

    Of a relaxed body it is a particle within the surface; matter that is thinner would be flung about.
    """
    from scipy.spatial import cKDTree

    within = body.occupancy >= 0.5 * body.occupancy.max()
    number, lane = np.nonzero((cells.particles >= 0) & within[cells.particles.clip(0)] & _held(cells)[:, None])
    particles = cells.particles[number, lane]
    nearest = cKDTree(body.sites[particles]).query(points)[1]
    return number[nearest], body.occupancy[particles[nearest]]


def _held(cells: RestCells) -> NDArray[np.bool_]:
    """Cells whose particles hold their nodes `[cells]`; all of a body that has none."""
    held: NDArray[np.bool_] = np.asarray((cells.particles > WEAKEST).all(axis=1))
    return held if held.any() else np.ones(len(held), np.bool_)


def _in_groups(owner: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cells of the groups `[groups]`, and their panels `[groups, 8]`, -1 for none, of panels in these cells."""
    groups: list[int] = []
    lanes: list[list[int]] = []
    for cell in np.unique(owner):
        members = np.flatnonzero(owner == cell).tolist()
        for first in range(0, len(members), LANES):
            some = members[first : first + LANES]
            groups.append(int(cell))
            lanes.append(some + [-1] * (LANES - len(some)))
    return np.array(groups), np.array(lanes)


def _matter(body: ElasticBody, cells: RestCells) -> Array:
    """Volume of matter that each node has, by that of the fullest `[nodes]`; little even where there is none."""
    found = cells.on_nodes(body.volumes * body.occupancy)
    return cast("Array", found / found.max() + _LEAST)


def _second_derivatives(matter: Array, cells: RestCells, group: NDArray[np.int64]) -> tuple[Ints, Array]:
    """Nodes of held cells about the cell of each group, and their shares in the second derivatives, by a quadratic that
    is fitted by the matter of each `[nodes]`."""
    held = cells.nodes[_held(cells)]
    of_node: dict[int, list[int]] = {}
    for number, nodes in enumerate(held.tolist()):
        for node in nodes:
            of_node.setdefault(node, []).append(number)
    kept: dict[int, tuple[NDArray[np.int64], Array]] = {}
    for cell in np.unique(group).tolist():
        near = sorted({number for node in cells.nodes[cell].tolist() for number in of_node[node]})
        nodes = np.unique(held[near])
        away = cells.places[nodes] - cells.places[cells.nodes[cell]].mean(axis=0)
        kept[cell] = nodes, _fitted(away, matter[nodes])
    most = max(len(nodes) for nodes, _ in kept.values())
    around, bend = np.zeros((len(group), most), np.int32), np.zeros((len(group), most, 6))
    for row, cell in enumerate(group.tolist()):
        nodes, shares = kept[cell]
        around[row, : len(nodes)], around[row, len(nodes) :] = nodes, nodes[0]
        bend[row, : len(nodes)] = shares
    return around, bend


def _fitted(away: Array, weights: Array) -> Array:
    """Shares `[n, 6]` [1/m^2] of values at places `[n, 3]` [m] in the second derivatives of the quadratic that fits
    them best by their weights `[n]`. What they do not tell is zero."""
    scale, by = np.abs(away).max(), weights[:, None]
    x, y, z = (away / scale).T
    quadratic = np.stack([0.5 * x * x, 0.5 * y * y, 0.5 * z * z, y * z, x * z, x * y], axis=1)
    linear = np.stack([np.ones(len(x)), x, y, z], axis=1)
    rest = quadratic - linear @ np.linalg.solve(linear.T @ (by * linear), (by * linear).T @ quadratic)
    held = rest.T @ (by * rest) + _STEADY * weights.sum() * np.eye(6)
    found: Array = by * rest @ np.linalg.inv(held) / scale**2
    return found
