"""Feasibility of forms: connected, not empty and thick enough to bend; and the constraint to one connected piece."""

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body
from zoobench.designs.space import Form

Indices = NDArray[np.int64]

SOLID = 0.5
"""Occupancy above which matter is solid."""

THINNEST = 2
"""Least number of particles across any place of a body: a sheet or thread of one has no bending stiffness and never
comes to rest. Thinner matter is not built."""

_REACH = 1.45  # [spacings] to neighbours: particles that share a face or an edge of the lattice are connected


@dataclass(frozen=True)
class Feasibility:
    """The feasibility of one form.

    Attributes:
        components: number of connected pieces of solid matter that is thick enough.
        mass_kept: the largest piece's share of the mass of solid matter, in [0, 1].
        thickness: edge of the largest block of the lattice within the largest piece [particles].
        fault: why it cannot be built, and the remedy; empty if it can.
    """

    components: int
    mass_kept: float
    thickness: int
    fault: str


def feasible(form: Form, body: Body, connected: bool) -> tuple[Form, list[Feasibility]]:
    """The form that can be built, and the feasibility of each world.

    Solid particles where the form is thinner than `THINNEST` become empty, and with `connected` those outside the
    largest piece, too; other particles, and the gradients through them, are unchanged. Of pieces of equal mass, that
    with the first particle counts as the largest.
    """
    import torch

    lattice = _lattice(body.sites.tobytes())
    keep, reports = [], []
    for occupancy in form.occupancy.detach().numpy():
        solid = occupancy > SOLID
        thick = lattice.opened(solid)
        masses = body.masses(1.0) * occupancy
        piece, components = _largest_piece(lattice, thick, masses)
        thickness = lattice.thickness(piece if components else solid)
        mass_kept = float(masses[piece].sum() / masses[thick].sum()) if components else 0.0
        reports.append(
            Feasibility(components, mass_kept, thickness, _fault(float(occupancy.max()), thickness, body.edge))
        )
        keep.append((piece if connected else thick) | ~solid)
    return replace(form, occupancy=form.occupancy * torch.as_tensor(np.array(keep))), reports


def _fault(fullest: float, thickness: int, edge: float) -> str:
    if not thickness:
        return (
            f"The design is empty: no particle is more than half occupied, the fullest is {fullest:.2g}. "
            "Start closer to the base, or take smaller steps."
        )
    if thickness < THINNEST:
        return (
            f"The design is too thin for the grid: it is {thickness} particle of {1e3 * edge:.2g} mm across at its "
            f"thickest, and {THINNEST} are needed. Use a finer fidelity or a larger base, or take smaller steps."
        )
    return ""


def _largest_piece(lattice: "_Lattice", solid: Mask, masses: Array) -> tuple[Mask, int]:
    """The particles of the piece with the largest mass, and the number of pieces."""
    if not solid.any():
        return solid, 0
    pieces = lattice.pieces(solid)
    weights = np.bincount(pieces, masses * solid)
    heaviest = weights[pieces] >= (1.0 - 1e-9) * weights.max()  # mirror images differ by their rounding
    first = np.flatnonzero(solid & heaviest)[0]
    return solid & (pieces == pieces[first]), len(np.unique(pieces[solid]))


@dataclass(frozen=True)
class _Lattice:
    """The neighbours on a lattice of particles.

    Attributes:
        pairs: of neighbours `[pair_count, 2]`.
        corners: the other corners of the lattice cell that begins at a particle `[particle_count, 7]`; the particle
            count for a missing one.
        leans: whether the cells have no right angles.
    """

    pairs: Indices
    corners: Indices
    leans: bool = False

    def pieces(self, solid: Mask) -> Indices:
        """The number of each solid particle's piece `[particle_count]`; undefined for the others."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        near = self.pairs[solid[self.pairs].all(axis=1)]
        graph = coo_array((np.ones(len(near), bool), (near[:, 0], near[:, 1])), shape=(len(solid), len(solid)))
        found: Indices = connected_components(graph, directed=False)[1]
        return found

    def opened(self, solid: Mask) -> Mask:
        """The solid particles that belong to a whole cell of the lattice: morphological opening (Serra 1982).

        All of them on a face-centred lattice, whose cells lean and would cut off one of two opposite edges.
        """
        if self.leans:
            return solid
        whole = np.append(solid, False)
        first = np.flatnonzero(whole[:-1] & whole[self.corners].all(axis=1))
        found = np.zeros(len(whole), bool)
        found[first] = found[self.corners[first].ravel()] = True
        return found[:-1]

    def thickness(self, piece: Mask) -> int:
        """Edge of the largest block within: the number of erosions by a lattice cell until nothing is left."""
        inside = np.append(piece, False)
        steps = 0
        while inside.any():
            inside[:-1] &= inside[self.corners].all(axis=1)
            steps += 1
        return steps


@lru_cache(maxsize=8)
def _lattice(content: bytes) -> _Lattice:
    """The neighbours on a cubic or face-centred lattice of sites `[particle_count, 3]`, given as bytes."""
    from scipy.spatial import KDTree

    positions = np.frombuffer(content).reshape(-1, 3)
    count = len(positions)
    corners = np.full((count, 7), count)
    if count < 2:
        return _Lattice(np.zeros((0, 2), np.int64), corners)
    tree = KDTree(positions)
    spacing = float(np.median(tree.query(positions, k=2)[0][:, 1]))
    cell = _cell(positions, tree.query_pairs(1.05 * spacing, output_type="ndarray"), spacing)
    if cell is not None:
        steps = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)][1:]) @ cell
        places = positions[:, None] + steps
        corners = tree.query(places, distance_upper_bound=0.1 * spacing)[1]
    leans = cell is not None and not np.allclose(cell @ cell.T, np.diag(np.diag(cell @ cell.T)), atol=0.1 * spacing**2)
    return _Lattice(tree.query_pairs(_REACH * spacing, output_type="ndarray"), corners, leans)


def _cell(positions: Array, nearest: Indices, spacing: float) -> Array | None:
    """Edges of the lattice cell `[3, 3]` [m]: three independent directions to neighbours; None in a flat lattice."""
    gaps = np.unique(np.round((positions[nearest[:, 1]] - positions[nearest[:, 0]]) / spacing, 3), axis=0)
    for trio in combinations(gaps * spacing, 3):
        if abs(np.linalg.det(np.array(trio))) > 0.1 * spacing**3:
            return np.array(trio)
    return None
