"""The parts of a body in its rest frame, and which of them can meet.

Each cell belongs to one part: what of the body lies in a block of its cells, and hangs together there. Two parts are
apart if they have no node in common, so that no matter keeps their particles from each other, and are at rest not
within reach of each other.
"""

from dataclasses import dataclass
from itertools import count

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rest_cells import LANES, Ints, RestCells

MOST_BLOCKS = 64
"""In how many blocks a body is divided at most."""

MOST_PARTS = 256
"""Above so many, what lies in a block is one part, connected or not: pairs of parts are looked at again and again."""

REACH = 1.5
"""Distance within which particles of parts that meet repel each other [cube's edges]."""


@dataclass(frozen=True)
class BodyParts:
    """The parts of a body.

    Attributes:
        members: `[cells]` the cells, part after part.
        first: `[parts + 1]` where in `members` a part begins, and the last ends.
        apart: `[pairs, 2]` parts that have no node in common, and are not beside each other at rest.
        share: `[cells, 8]` of a push that each particle takes: the square of the mass that it moves when it is pushed
            alone, over that of one on a flat face, at most 1; 0 where there is none.
    """

    members: Ints
    first: Ints
    apart: Ints
    share: Array

    @classmethod
    def of(cls, cells: RestCells, body: ElasticBody, fidelity: Fidelity) -> "BodyParts":
        """The parts of a body that has these cells."""
        own = _incidence(np.arange(len(cells.nodes), dtype=np.int32), cells)
        block = _blocks(cells, fidelity.grid_spacing)
        part = _connected_in_blocks(own, block)
        if part.max() >= MOST_PARTS:
            part = block
        nodes = _incidence(part, cells)
        joined = (nodes @ nodes.T).toarray() > 0
        by_particle = np.zeros(body.particle_count, np.int32)
        cell, lane = (cells.particles >= 0).nonzero()
        by_particle[cells.particles[cell, lane]] = part[cell]
        near = cKDTree(body.positions).query_pairs(REACH * (body.edge or fidelity.particle_edge), output_type="ndarray")
        one, other = by_particle[near].T
        joined[one, other] = joined[other, one] = True
        return cls(
            members=np.argsort(part, kind="stable").astype(np.int32),
            first=np.concatenate([[0], np.cumsum(np.bincount(part))]).astype(np.int32),
            apart=np.column_stack(np.triu(~joined, 1).nonzero()).astype(np.int32),
            share=_share(cells, round(fidelity.particles_per_cell ** (1 / 3))),
        )


def _share(cells: RestCells, count: int) -> Array:
    """See `BodyParts.share`, of full particles, `count` along the edge of a cell, each as heavy as 1.

    A push moves a particle by the sum of w^2 / m over its nodes.
    """
    near = 0.5 / count  # from the face, and of particles that move most from the next node, in cells
    on_a_face = (2 * (1 - near) ** 2 + near**2) / count**3 * ((1 - near) ** 2 + near**2) ** 2
    masses = cells.on_nodes(np.ones(cells.particles.max() + 1))
    inverse = np.divide(1.0, masses, out=np.zeros_like(masses), where=masses > 0.0)
    mobility = np.einsum("cil,ci->cl", cells.weights**2, inverse[cells.nodes])
    found: Array = np.where(cells.particles >= 0, on_a_face / np.maximum(mobility, on_a_face), 0.0)
    return found**2


def _incidence(part: Ints, cells: RestCells) -> csr_array:
    """Whether a node is of a part `[parts, nodes]`, as counts of cells."""
    at = part.repeat(LANES), cells.nodes.ravel()
    return coo_array((np.ones(len(at[0])), at), shape=(part.max() + 1, len(cells.places))).tocsr()


def _blocks(cells: RestCells, grid_spacing: float) -> Ints:
    """The block of every cell `[cells]`; of two cells an edge, or as many as make their number small."""
    corner = cells.places[cells.nodes].min(axis=1)
    # from the middle, so that what is symmetric stays so
    off = np.round(2 * corner / grid_spacing - (corner.min(axis=0) + corner.max(axis=0)) / grid_spacing)
    for edge in count(2):
        index = (np.sign(off) * np.ceil(np.abs(off) / (2 * edge) - 0.5)).astype(int)
        blocks, block = np.unique(index, axis=0, return_inverse=True)
        if len(blocks) <= MOST_BLOCKS:
            break
    return np.asarray(block.ravel(), np.int32)


def _connected_in_blocks(own: csr_array, block: Ints) -> Ints:
    """The part of every cell `[cells]`: connected by nodes to others of its block."""
    one, other = (own @ own.T).nonzero()
    same = block[one] == block[other]
    edges = coo_array((np.ones(same.sum(), np.int8), (one[same], other[same])), shape=(len(block), len(block)))
    return np.asarray(connected_components(edges, directed=False)[1], np.int32)
