"""The cells of a body in its rest frame: trilinear elements of a grid that the body carries with it.

Particles are the quadrature points of the cells. A particle lies in the cell that holds its cube of the lattice, and
has that cell's eight nodes. A node has a copy for every connected part of the matter around it, so that limbs across a
gap are not welded together. Cells that a body fills in part have the points that it has there (de Vaucorbeil, Nguyen
and Hutchinson 2020; with eight points a cell it is a finite element method on cut cells).

Fewer particles than a layer of the cell do not hold its nodes, which would swing about them without resistance. They
join the cell beside them (aggregated unfitted finite elements; Badia, Verdugo and Martin 2018): they move with it, and
are stretched as it is between its middle and the near face. Where no cell beside them has enough, as in spikes, weak
points without mass at the empty sites hold its nodes (the fictitious material of the finite cell method; Parvizian,
Duester and Rank 2007).

A particle has its mass at the site of its cube, so that no node is without, and its strain where its cell resists
bending as the matter in it does (`_bending_places`).
"""

from dataclasses import dataclass
from itertools import permutations
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import lame_parameters

LANES = 8
"""Nodes of a cell, and particles that are computed together."""

WEAKEST = -2
"""Number of particles from which on down a place is a weak point's."""

_CORNERS = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
_HALF_THE_NEIGHBOURS = [step for step in np.ndindex(3, 3, 3) if step > (1, 1, 1)] - np.ones(3, np.int64)
_OFF_SITE = 1e-3
"""How far from a lattice a site may lie [cubes]."""

_ROUNDED = 2.0**-30
"""To which places of strain are rounded, without an error of rounding in the mirror image [cells]."""

_SMALL = 1e-12
"""Against division by zero where a cell has one layer of particles [cells^2]."""

Ints = NDArray[np.int32]


@dataclass(frozen=True)
class RestCells:
    """Cells, nodes and constant weights of a body.

    Attributes:
        places: `[nodes, 3]` of the nodes at rest [m].
        nodes: `[cells, 8]` nodes of each cell.
        particles: `[cells, 8]` particles of each cell, -1 for none, and -2 - p for a weak point of the matter of
            particle p; those of one cell of the grid that are more than eight are cells of their own with the same
            nodes.
        shape: `[cells]` which of the shapes a cell has.
        slopes: `[shapes, 8, 3, 8]` gradient of each node's weight where each particle's strain is taken [1/m].
        masses: `[shapes, 8, 8]` share of each particle's mass that each node has: the weights at its site.
        weights: `[cells, 8, 8]` weight of each node at each particle's place, which may be beyond the cell.
    """

    places: Array
    nodes: Ints
    particles: Ints
    shape: Ints
    slopes: Array
    masses: Array
    weights: Array

    @classmethod
    def of(cls, body: ElasticBody, fidelity: Fidelity) -> "RestCells":
        """The cells of a body of cubes on a lattice.

        Raises:
            UsageError: its particles lie on no cubic lattice.
        """
        sites = body.sites
        edge = body.edge or fidelity.particle_edge
        h, low = fidelity.grid_spacing, sites.min(axis=0) - 0.5 * edge
        cubes = np.round((sites - low) / edge - 0.5)
        if np.abs((sites - low) / edge - 0.5 - cubes).max() > _OFF_SITE or abs(h / edge - round(h / edge)) > _OFF_SITE:
            raise UsageError(
                "A robot in its rest frame must consist of cubes on a lattice, a whole number of which fill a cell. "
                "Give 8 or 27 particles per cell, or robot=mpm."
            )
        count, index = round(h / edge), cubes.astype(np.int64)  # cubes along the edge of a cell
        cells = index // count
        ids, keys = _split_nodes(index, cells)
        ids, keys, cells = _joined(ids, keys, cells, count**2)
        order, particles, few = _grouped(ids, count**2)
        known = np.where(particles < 0, order[:, None], particles)  # lanes without a particle repeat the first
        at = (body.positions - low) / h - cells
        in_cell = ((index - cells * count + 0.5)[known] / count).clip(0.0, 1.0)
        strained = _bending_places(body, at.clip(0.0, 1.0), ids, 1.0 / count)[known]
        for cell in np.flatnonzero(few):
            own = int((particles[cell] >= 0).sum())
            in_cell[cell, own:] = _empty_sites(in_cell[cell, :own])
            strained[cell] = in_cell[cell]
            particles[cell, own:] = WEAKEST - order[cell]
        both = np.concatenate([in_cell, strained], axis=1).reshape(len(in_cell), -1)
        _, one, shape = np.unique(both, axis=0, return_index=True, return_inverse=True)
        return cls(
            places=low + keys * h,
            nodes=ids[order].astype(np.int32),
            particles=particles.astype(np.int32),
            shape=shape.ravel().astype(np.int32),
            slopes=gradients(strained[one], h),
            masses=trilinear(in_cell[one]),
            weights=trilinear(at[known]),
        )

    def on_nodes(self, values: Array) -> Array:
        """Sums `[nodes]` of values of the particles `[particles]`, by the share of each's mass that a node has."""
        own = values[self.particles.clip(0)] * (self.particles >= 0)
        found = np.zeros(len(self.places))
        np.add.at(found, self.nodes, np.einsum("cil,cl->ci", self.masses[self.shape], own))
        return found

    def deformation_map(self) -> csr_array:
        """The gradients of the weights, by node and particle `[nodes, 3 * particles]` [1/m].

        Column 3 p + k, times the places of the nodes, is column k of F of particle p.
        """
        cell, lane = (self.particles >= 0).nonzero()
        values = self.slopes[self.shape[cell], :, :, lane]  # by particle, node and axis
        columns = 3 * self.particles[cell, lane][:, None, None] + np.arange(3)
        nodes, columns = np.broadcast_arrays(self.nodes[cell][:, :, None], columns)
        size = len(self.places), 3 * len(cell)
        return coo_array((values.ravel(), (nodes.ravel(), columns.ravel())), shape=size).tocsr()


def _split_nodes(cubes: NDArray[np.int64], cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The nodes of every particle `[particles, 8]`, and the place of every node in the grid `[nodes, 3]`.

    A particle's share in a corner is one with that of a neighbour in the same corner; cubes that touch at an edge or a
    corner are neighbours, too.
    """
    keys = cells[:, None] + _CORNERS
    span = keys.reshape(-1, 3).max(axis=0) + 1
    corner = (keys[..., 0] * span[1] + keys[..., 1]) * span[2] + keys[..., 2]
    one, other = [], []
    where = {tuple(cube): number for number, cube in enumerate(cubes.tolist())}
    for direction in _HALF_THE_NEIGHBOURS:
        neighbour = np.array([where.get(tuple(cube), -1) for cube in (cubes + direction).tolist()])
        has = np.flatnonzero(neighbour >= 0)
        shared = corner[has][:, :, None] == corner[neighbour[has]][:, None, :]
        pair, mine, its = np.nonzero(shared)
        one.append(8 * has[pair] + mine)
        other.append(8 * neighbour[has][pair] + its)
    edges = np.concatenate(one), np.concatenate(other)
    size = 8 * len(cubes)
    graph = coo_array((np.ones(len(edges[0]), np.int8), edges), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    _, first, ids = np.unique(label, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))  # in the order of the particles
    places = keys.reshape(-1, 3)[np.sort(first)]
    return cast("NDArray[np.int64]", rank[ids].reshape(-1, 8)), places


def _joined(
    ids: NDArray[np.int64], keys: NDArray[np.int64], cells: NDArray[np.int64], enough: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Nodes `[particles, 8]`, their places and the cells of all particles, where those that are too few in their cell
    have joined that neighbour, of enough, with which they share most nodes; of two, that nearer to the middle, so that
    what is symmetric stays so. Those by which neighbours hang together stay where they are."""
    groups, first, group, size = np.unique(ids, axis=0, return_index=True, return_inverse=True, return_counts=True)
    group, number = group.ravel(), np.arange(len(groups))
    has = coo_array((np.ones(groups.size), (number.repeat(8), groups.ravel())), shape=(len(groups), len(keys)))
    common = (has @ has.T).toarray()
    shared = common * (size >= enough)
    off = np.abs(2 * cells[first] - cells.min(axis=0) - cells.max(axis=0)) @ (1.0, 1.1, 1.2)
    shared -= np.where(shared > 0, off / (2 * off.max() + 1), 0.0)
    host = np.where((size < enough) & (shared.max(axis=1) > 0), shared.argmax(axis=1), number)
    while (linking := _linking(common, host)).any():
        host[linking] = number[linking]
    used, ids = np.unique(ids[first[host[group]]], return_inverse=True)
    return ids.reshape(-1, 8), keys[used], cells[first[host[group]]]


def _linking(common: Array, host: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Cells without which others beside them hang together no more, or at nodes or edges alone, where faces held them.

    Args:
        common: number of nodes that two cells share `[cells, cells]`.
        host: the cell that each has joined, itself for none `[cells]`.
    """
    number = np.arange(len(host))
    found, kept = np.zeros(len(host), np.bool_), np.flatnonzero(host == number)
    for least in (1, 4):
        _, label = connected_components(csr_array(common[np.ix_(kept, kept)] >= least), directed=False)
        part = np.zeros(len(host), np.int64)
        part[kept] = label
        one, other = np.nonzero(common >= least)
        apart = part[host[one]] != part[host[other]]
        found[one[apart]] = found[other[apart]] = True
    return cast("NDArray[np.bool_]", found & (host != number))


def _grouped(ids: NDArray[np.int64], enough: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Particles with the same nodes, up to eight together: one of each group, all of them, -1 for none, and whether too
    few particles share these nodes to hold them."""
    _, first, group, size = np.unique(ids, axis=0, return_index=True, return_inverse=True, return_counts=True)
    rank = np.argsort(np.argsort(first))[group.ravel()]
    rows: list[list[int]] = []
    for members in np.split(np.argsort(rank, kind="stable"), np.cumsum(np.bincount(rank))[:-1]):
        lanes = LANES if len(members) >= enough else LANES - 1  # with room for a weak point
        rows.extend(members[k : k + lanes].tolist() for k in range(0, len(members), lanes))
    particles = np.array([row + [-1] * (LANES - len(row)) for row in rows])
    order = particles[:, 0]
    return order, particles, size[group.ravel()][order] < enough


def _bending_places(body: ElasticBody, at: Array, ids: NDArray[np.int64], edge: float) -> Array:
    """Where the strain of each particle is taken, in its cell `[particles, 3]` [cells].

    A cell bends as u_a = a b, along a across b from its matter's middle. Its strain is b along a, and a shear of a,
    which matter that bends has not. It gives way along the third axis, c, by as much of u_c = c b as costs least. Let
    <a^2> be the mean square over the particles, e the edge of a cube, and P the modulus of uniaxial strain. In place of
    Young's modulus times <b^2> + e^2 / 12, that of whole cubes, the cell resists by

        P <b^2> - (lambda <b^2>)^2 / (P <b^2> + mu <c^2>) + mu <a^2>

    Particles that are drawn to the middle by s resist by s^2 of it: s is such that no cell is stiffer in bending than
    its matter. Twist is resisted by s^2, too.

    Args:
        body: whose volumes and Poisson's ratio count.
        at: places of the particles in their cells `[particles, 3]` [cells].
        ids: the nodes of every particle `[particles, 8]`.
        edge: of a cube, filled or not: by what is in it alone, nodes beyond a thin layer would hardly be held [cells].
    """
    mu, lam = lame_parameters(1.0, body.material.poissons_ratio)
    _, group = np.unique(ids, axis=0, return_inverse=True)
    group, volume = group.ravel(), body.volumes[:, None]
    total = np.zeros((group.max() + 1, 7))
    np.add.at(total, group, volume * np.column_stack([np.ones(len(at)), at, at**2]))
    middle = total[:, 1:4] / total[:, :1]
    square = total[:, 4:] / total[:, :1] - middle**2
    drawn = np.ones(len(square))
    for along, across, aside in permutations(range(3)):
        stretched, sheared = (lam + 2.0 * mu) * square[:, across], mu * square
        gives_way = (lam * square[:, across]) ** 2 / (stretched + sheared[:, aside] + _SMALL)
        resists = stretched - gives_way + sheared[:, along]
        drawn = np.minimum(drawn, np.sqrt((square[:, across] + edge**2 / 12) / (resists + _SMALL)))
    # rounded, so that what is symmetric stays so
    found: Array = np.round((middle[group] + drawn[group, None] * (at - middle[group])) / _ROUNDED) * _ROUNDED
    return found


def _empty_sites(taken: Array) -> Array:
    """Those of the eight sites of a cell that are farthest from where its few particles are `[8 - n, 3]` [cells]."""
    sites = 0.25 + 0.5 * _CORNERS
    nearest = np.linalg.norm(sites[:, None] - taken, axis=-1).min(axis=1)
    return sites[np.argsort(-nearest, kind="stable")][: LANES - len(taken)]


def trilinear(at: Array) -> Array:
    """Trilinear weights `[..., 8, lanes]` of the nodes at places `[..., lanes, 3]` in the cell [cells]."""
    each = np.where(_CORNERS[:, None, :] == 1, at[..., None, :, :], 1.0 - at[..., None, :, :])
    return cast("Array", each.prod(axis=-1))


def gradients(at: Array, h: float) -> Array:
    """Gradients `[..., 8, 3, lanes]` of `trilinear` [1/m]."""
    each = np.where(_CORNERS[:, None, :] == 1, at[..., None, :, :], 1.0 - at[..., None, :, :])
    sign = np.where(_CORNERS == 1, 1.0, -1.0) / h
    found = [sign[:, None, d] * np.delete(each, d, axis=-1).prod(axis=-1) for d in range(3)]
    return np.stack(found, axis=-2)
