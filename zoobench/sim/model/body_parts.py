"""The parts of a body in its rest frame that can meet, and pairs of them that matter between them holds apart.

Each cell belongs to one part: what of the body lies in a block of its cells, and hangs together there. Two parts are
apart if they have no node in common, so that no matter keeps their particles from each other, and are at rest further
from each other than particles that meet.
"""

from dataclasses import dataclass
from itertools import count

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rest_cells import LANES, Ints, RestCells

MOST_BLOCKS = 64
"""In how many blocks a body is divided at most: pairs of parts are looked at in every frame."""

_REST = 1.5
"""Distance at rest within which particles are beside each other, more than `limb_contact.REACH` [cube's edges]. Where a
part is thinner than a cube, its particles lie closer than their cubes."""


@dataclass(frozen=True)
class BodyParts:
    """The parts of a body.

    Attributes:
        members: `[cells]` the cells, part after part.
        first: `[parts + 1]` where in `members` a part begins, and the last ends.
        apart: `[pairs, 2]` parts that have no node in common, and are not beside each other at rest.
    """

    members: Ints
    first: Ints
    apart: Ints

    @classmethod
    def of(cls, cells: RestCells, body: ElasticBody, fidelity: Fidelity) -> "BodyParts":
        """The parts of a body that has these cells."""
        own = _incidence(np.arange(len(cells.nodes), dtype=np.int32), cells)
        part = _connected_in_blocks(own, _blocks(cells, fidelity.grid_spacing))
        nodes = _incidence(part, cells)
        joined = (nodes @ nodes.T).toarray() > 0
        by_particle = np.zeros(body.particle_count, np.int32)
        cell, lane = (cells.particles >= 0).nonzero()
        by_particle[cells.particles[cell, lane]] = part[cell]
        near = cKDTree(body.positions).query_pairs(_REST * (body.edge or fidelity.particle_edge), output_type="ndarray")
        one, other = by_particle[near].T
        joined[one, other] = joined[other, one] = True
        return cls(
            members=np.argsort(part, kind="stable").astype(np.int32),
            first=np.concatenate([[0], np.cumsum(np.bincount(part))]).astype(np.int32),
            apart=np.column_stack(np.triu(~joined, 1).nonzero()).astype(np.int32),
        )


def _incidence(part: Ints, cells: RestCells) -> csr_array:
    """Whether a node is of a part `[parts, nodes]`, as counts of cells."""
    at = part.repeat(LANES), cells.nodes.ravel()
    return coo_array((np.ones(len(at[0])), at), shape=(part.max() + 1, len(cells.places))).tocsr()


def _blocks(cells: RestCells, grid_spacing: float) -> Ints:
    """The block of every cell `[cells]`; of two cells an edge, or as many as make their number small."""
    corner = cells.places[cells.nodes].min(axis=1)
    index = np.round((corner - corner.min(axis=0)) / grid_spacing).astype(int)
    for edge in count(2):
        blocks, block = np.unique(index // edge, axis=0, return_inverse=True)
        if len(blocks) <= MOST_BLOCKS:
            break
    return np.asarray(block.ravel(), np.int32)


def _connected_in_blocks(own: csr_array, block: Ints) -> Ints:
    """The part of every cell `[cells]`: connected by nodes to others of its block."""
    one, other = (own @ own.T).nonzero()
    same = block[one] == block[other]
    edges = coo_array((np.ones(same.sum(), np.int8), (one[same], other[same])), shape=(len(block), len(block)))
    return np.asarray(connected_components(edges, directed=False)[1], np.int32)
