"""Tetrahedra that fit the surface of an animal, from the function by which its design fills space.

A body-centred cubic lattice of tetrahedra above the ground is cut off at the skin, after nodes near the skin have been
moved onto it (isosurface stuffing, Labelle and Shewchuk 2007). The lattice has faces on the ground, so that a sole is
flat and has a sharp rim, and is symmetric, as the animals are.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs import caterpillar
from zoobench.designs.anatomy import Animal
from zoobench.designs.caterpillar import Caterpillar
from zoobench.designs.shapes import smooth_union

Distance = Callable[[Array], Array]
Indices = NDArray[np.int64]

_NEAR = 0.45
"""Share of an edge within which an end is moved onto the skin."""

_LEAST = 0.02
"""Share of a lattice's tetrahedron below which a piece is left out."""

_LEAST_JACOBIAN = 0.3
"""Share of a straight tetrahedron's volume that a curved one has everywhere, else its edges are straight."""

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""Ends of a tetrahedron's edges, in the order of a quadratic element's middle nodes."""


@dataclass(frozen=True)
class Mesh:
    """Tetrahedra with four nodes, or ten: corners, then the middles of `EDGES`.

    Attributes:
        points: `[node_count, 3]` [m].
        cells: `[cell_count, 4 or 10]`.
    """

    points: Array
    cells: Indices


def volumes(points: Array, cells: Indices) -> Array:
    """Volumes of tetrahedra by their first four nodes `[cell_count]` [m^3]; negative where they are inverted."""
    a, b, c, d = (points[cells[:, n]] for n in range(4))
    found: Array = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
    return found


def distance_of(design: Any) -> Distance:
    """A function of points `[n, 3]` [m], negative inside the design's skin, without the cut at y = 0.

    Raises:
        TypeError: the design is none of those that are described by such a function.
    """
    if isinstance(design, Animal):
        parts, scale, blend = [part.solid for part in design.parts], design.scale, design.blend
        return lambda points: scale * smooth_union([part(points / scale) for part in parts], blend)
    if isinstance(design, Caterpillar):
        return _segments(design)
    raise TypeError(f"{design!r} has no signed distance. Give an animal.")


def _segments(design: Caterpillar) -> Distance:
    size = np.array((design.length, design.height, design.width))
    radii, centres = size * caterpillar._SEGMENT_RADII, design.length * caterpillar._centres()
    height = design.height * caterpillar._AXIS_HEIGHT

    def distance(points: Array) -> Array:
        along = np.abs(points[:, 0][:, None] - centres).min(axis=1)
        scaled = np.stack([along, points[:, 1] - height, points[:, 2]], axis=1) / radii
        length, slope = np.linalg.norm(scaled, axis=1), np.linalg.norm(scaled / radii, axis=1)
        found: Array = np.where(slope > 0.0, length * (length - 1.0) / np.maximum(slope, 1e-12), -radii.min())
        return found

    return distance


def tetrahedra(distance: Distance, lower: Array, upper: Array, cell: float) -> Mesh:
    """Tetrahedra of a lattice with cubes of this edge [m], cut off at the skin, within a box over y = 0."""
    points, cells = _lattice(np.asarray(lower), np.asarray(upper), cell)
    points, value, cut = _warped(points, cells, distance)
    mixed = (value[cells] > 0.0).any(axis=1) & (value[cells] < 0.0).any(axis=1)
    whole = cells[(value[cells] <= 0.0).all(axis=1) & (value[cells] < 0.0).any(axis=1)]
    places, pieces = list(points), [list(row) for row in whole]
    number: dict[tuple[int, int], int] = {}
    for row in cells[mixed].tolist():
        pieces += _clipped(row, value, cut, number, places)
    points, cells = np.array(places), np.array(pieces, np.int64)
    size = volumes(points, cells)
    cells[size < 0.0] = cells[size < 0.0][:, [0, 2, 1, 3]]
    cells = cells[np.abs(size) > _LEAST * cell**3 / 12.0]
    used, cells = np.unique(cells, return_inverse=True)
    return Mesh(points[used], cells.reshape(-1, 4))


def _lattice(lower: Array, upper: Array, cell: float) -> tuple[Array, Indices]:
    """Nodes and tetrahedra that cover the box: two centres of neighbouring cubes and an edge of the face between."""
    half = np.ceil((upper - lower) / 2.0 / cell).astype(int) + 1
    low, high = np.array([-half[0], 0, -half[2]]), np.array([half[0], 2 * half[1], half[2]])
    middle = (lower + upper) / 2.0 * (1.0, 0.0, 1.0)
    number: dict[tuple[int, int, int], int] = {}  # of nodes, by twice their place
    cells = []

    def node(place: Any) -> int:
        return number.setdefault((int(place[0]), int(place[1]), int(place[2])), len(number))

    for base in np.ndindex(*(high - low + 1)):
        corner = 2 * (low + base)
        for axis in range(3):
            one, two = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
            across = np.eye(3, dtype=int)[axis]
            face = [corner, corner + 2 * one, corner + 2 * one + 2 * two, corner + 2 * two]
            centre = corner + one + two
            ends = [centre - across, centre + across]
            if axis == 1 and corner[1] == 0:
                ends[0] = centre  # the half above the ground
            if min(place[1] for place in (*face, *ends)) < 0:
                continue
            a, b = node(ends[0]), node(ends[1])
            rim = [node(place) for place in face]
            cells += [[a, b, rim[n], rim[(n + 1) % 4]] for n in range(4)]
    points = middle + 0.5 * cell * np.array(list(number), float)
    return points, np.array(cells, np.int64)


def _warped(points: Array, cells: Indices, distance: Distance) -> tuple[Array, Array, dict[tuple[int, int], Array]]:
    """Nodes with those near the skin moved onto it, the distance's sign at them, and where other edges are cut."""
    value = np.sign(distance(points))
    ends = np.unique(np.sort(np.concatenate([cells[:, list(pair)] for pair in EDGES]), axis=1), axis=0)
    ends = ends[value[ends[:, 0]] * value[ends[:, 1]] < 0.0]
    inside = np.where(value[ends[:, 0]] < 0.0, ends[:, 0], ends[:, 1])
    other = ends.sum(axis=1) - inside
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    for _ in range(30):
        middle = 0.5 * (low + high)
        found = distance(points[inside] + middle[:, None] * (points[other] - points[inside])) > 0.0
        low, high = np.where(found, low, middle), np.where(found, middle, high)
    share = 0.5 * (low + high)
    place = points[inside] + share[:, None] * (points[other] - points[inside])
    moved, value = points.copy(), value.copy()
    flat = (points[inside, 1] == 0.0) & (points[other, 1] == 0.0)
    best = np.full(len(points), _NEAR)
    for near, node in ((share, inside), (1.0 - share, other)):
        allowed = (near < _NEAR) & (flat | (points[node, 1] > 0.0))
        for n in np.flatnonzero(allowed):
            if near[n] < best[node[n]]:
                best[node[n]], moved[node[n]], value[node[n]] = near[n], place[n], 0.0
    return moved, value, {(min(a, b), max(a, b)): at for a, b, at in zip(inside.tolist(), other.tolist(), place)}  # noqa: B905


def _clipped(
    row: list[int],
    value: Array,
    cut: dict[tuple[int, int], Array],
    number: dict[tuple[int, int], int],
    places: list[Any],
) -> list[list[int]]:
    """The tetrahedra of what is inside of one of the lattice's, by pulling: neighbours divide a common face alike."""

    def on(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in number:
            number[key] = len(places)
            places.append(cut[key])
        return number[key]

    faces: list[list[int]] = []
    rim: dict[int, list[int]] = {}
    for skipped in range(4):
        corners = [node for n, node in enumerate(row) if n != skipped]
        polygon: list[int] = []
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            if value[a] <= 0.0:
                polygon.append(a)
            if value[a] * value[b] < 0.0:
                polygon.append(on(a, b))
        if len(polygon) > 2:
            faces.append(polygon)
        edge = [node for node in polygon if node >= len(value) or value[node] == 0.0]
        if len(edge) == 2 and any(value[node] > 0.0 for node in corners):
            rim.setdefault(edge[0], []).append(edge[1])
            rim.setdefault(edge[1], []).append(edge[0])
    lid = [next(iter(rim))] if rim else []
    while lid and (further := [node for node in rim[lid[-1]] if node not in lid]):
        lid.append(further[0])
    if len(lid) > 2:
        faces.append(lid)
    apex = min(node for face in faces for node in face)
    return [[apex, *triangle] for face in faces if apex not in face for triangle in _pulled(face)]


def _pulled(face: list[int]) -> list[list[int]]:
    start = face.index(min(face))
    turned = face[start:] + face[:start]
    return [[turned[0], turned[n], turned[n + 1]] for n in range(1, len(turned) - 1)]


def outside(cells: Indices) -> Indices:
    """Triangles that belong to one tetrahedron only, by their corners in ascending order `[face_count, 3]`."""
    sides = ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
    faces = np.sort(np.concatenate([cells[:, list(side)] for side in sides]), axis=1)
    found, counts = np.unique(faces, axis=0, return_counts=True)
    outer: Indices = found[counts == 1]
    return outer


def onto(points: Array, distance: Distance) -> Array:
    """Points near the skin moved onto it by Newton's method; those with y = 0 stay there."""
    step, found = 1e-6, points.copy()
    for _ in range(3):
        here = distance(found)
        slope = np.stack([(distance(found + step * axis) - here) / step for axis in np.eye(3)], axis=1)
        slope[points[:, 1] == 0.0, 1] = 0.0
        found -= (here / np.maximum((slope**2).sum(axis=1), 0.1))[:, None] * slope
    return found


def quadratic(mesh: Mesh, distance: Distance | None = None) -> Mesh:
    """With a node in the middle of every edge; those of the outside on the skin, if it is given."""
    ends = np.sort(np.concatenate([mesh.cells[:, list(pair)] for pair in EDGES]), axis=1)
    edges, which = np.unique(ends, axis=0, return_inverse=True)
    middles = mesh.points[edges].mean(axis=1)
    if distance is not None:
        faces = outside(mesh.cells)
        on_sole = (mesh.points[faces, 1] == 0.0).all(axis=1)
        skin = {
            pair
            for face in faces[~on_sole].tolist()
            for pair in ((face[0], face[1]), (face[1], face[2]), (face[0], face[2]))
        }
        outer = np.array([n for n, edge in enumerate(edges.tolist()) if tuple(edge) in skin])
        moved = onto(middles[outer], distance)
        length = np.linalg.norm(mesh.points[edges[outer, 0]] - mesh.points[edges[outer, 1]], axis=1)
        near = np.linalg.norm(moved - middles[outer], axis=1) < 0.12 * length
        middles[outer[near]] = moved[near]
    cells = np.hstack([mesh.cells, len(mesh.points) + which.reshape(6, -1).T])
    straight = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1)])
    points, full = np.concatenate([mesh.points, middles]), 6.0 * volumes(mesh.points, mesh.cells)
    while (bad := _least_jacobian(points, cells) < _LEAST_JACOBIAN * full).any():
        points[cells[bad]] = straight[cells[bad]]
    return Mesh(points, cells)


def _least_jacobian(points: Array, cells: Indices) -> Array:
    """The least determinant of the reference element's map, at corners and between `[cell]` [m^3]."""
    from skfem import ElementTetP2

    places = np.hstack([np.vstack([np.zeros(3), np.eye(3)]).T, np.full((3, 4), 0.138) + 0.448 * np.eye(3, 4)])
    slopes = np.stack([ElementTetP2().lbasis(places, n)[1] for n in range(10)])  # [node, 3, place]
    found: Array = np.linalg.det(np.einsum("eai,acp->epic", points[cells], slopes)).min(axis=1)
    return found
