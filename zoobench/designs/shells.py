"""The shells of a closed surface: the connected parts, each turned outwards or, as a cavity, inwards; and crumbs."""

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs.solid_mesh import Mesh

Indices = NDArray[np.int64]

_CORNERS = 16  # of a shell that are examined to tell whether it lies within another
CRUMB = 0.01
"""Share of a body below which pieces that do not touch it are left out, as a scanner's noise."""


def edges_of(faces: Indices) -> tuple[Indices, Array]:
    """The number of every face's edges `[face_count, 3]`, and the sense in which the face passes them, 1 or -1."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    sense = np.where(edges[..., 0] < edges[..., 1], 1.0, -1.0)
    ends = np.sort(edges.reshape(-1, 2), axis=1)
    _, number = np.unique(ends[:, 0] * (faces.max() + 1) + ends[:, 1], return_inverse=True)
    return number.reshape(-1, 3), sense


def is_closed(faces: Indices) -> bool:
    """Whether every edge is passed as often in one direction as in the other, so that all points have a winding number.

    Edges with four faces, as where two solids touch, are closed as well.
    """
    if not len(faces):
        return False
    number, sense = edges_of(faces)
    return not np.bincount(number.ravel(), sense.ravel()).any()


def shells_of(faces: Indices) -> Indices:
    """The number of every face's shell `[face_count]`: faces that share an edge with no other, or close each other."""
    number, sense = edges_of(faces)
    simple = np.bincount(number.ravel())[number] == 2
    labels = _joined(len(faces), np.repeat(np.arange(len(faces)), 3)[simple.ravel()], number[simple])
    pairs, inverse = np.unique(np.stack([np.repeat(labels, 3), number.ravel()], axis=1), axis=0, return_inverse=True)
    is_open = np.bincount(inverse.ravel(), sense.ravel()) != 0.0
    found: Indices = _joined(int(labels.max()) + 1, pairs[is_open, 0], pairs[is_open, 1])[labels]
    return found


def _joined(count: int, items: Indices, groups: Indices) -> Indices:
    """The number of each item's component `[count]`, where items of one group are connected."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    size = count + (int(groups.max()) + 1 if len(groups) else 0)
    graph = coo_array((np.ones(len(items), bool), (items, count + groups)), shape=(size, size))
    labels: Indices = connected_components(graph, directed=False)[1][:count].astype(np.int64)
    return np.unique(labels, return_inverse=True)[1]


def turned_outwards(mesh: Mesh) -> tuple[Mesh, int]:
    """The closed surface with every shell turned, and the number of cavities.

    Outermost shells are turned outwards. Those within one keep their direction relative to it: inwards is a cavity,
    outwards a solid in a solid.
    """
    shells = shells_of(mesh.faces)
    volumes = np.bincount(shells, mesh.tetrahedra())
    if (volumes >= 0.0).all():
        return mesh, 0
    lower, upper = boxes(mesh, shells)
    turn = np.zeros(len(volumes), bool)
    roots: list[int] = []
    is_within = np.zeros(len(volumes), bool)
    for shell in np.argsort(-np.abs(volumes)):
        root = next((n for n in roots if _holds(mesh, shells, n, shell, lower, upper)), None)
        if root is None:
            roots.append(shell)
            turn[shell] = volumes[shell] < 0.0
        else:
            turn[shell], is_within[shell] = turn[root], True
    faces = np.where(turn[shells][:, None], mesh.faces[:, ::-1], mesh.faces)
    return Mesh(mesh.vertices, faces), int((is_within & ((volumes < 0.0) != turn)).sum())


def boxes(mesh: Mesh, shells: Indices) -> tuple[Array, Array]:
    """The lower and upper corner of every shell's box `[shell_count, 3]`."""
    corners = mesh.vertices[mesh.faces]
    lower, upper = np.full((shells.max() + 1, 3), np.inf), np.full((shells.max() + 1, 3), -np.inf)
    np.minimum.at(lower, shells, corners.min(axis=1))
    np.maximum.at(upper, shells, corners.max(axis=1))
    return lower, upper


def _holds(mesh: Mesh, shells: Indices, outer: int, inner: int, lower: Array, upper: Array) -> bool:
    """Whether most of a shell's corners lie within another's surface, whichever way that is turned."""
    if (lower[outer] > lower[inner]).any() or (upper[outer] < upper[inner]).any():
        return False
    corners = np.unique(mesh.faces[shells == inner])
    some = mesh.vertices[corners[np.linspace(0, len(corners) - 1, _CORNERS).astype(int)]]
    some = some + 1e-3 * (some.mean(axis=0) - some)  # off a surface that they touch
    faces = mesh.faces[shells == outer]
    within = Mesh(mesh.vertices, faces).inside(some) | Mesh(mesh.vertices, faces[:, ::-1]).inside(some)
    return bool(within.mean() > 0.5)


def without_crumbs(mesh: Mesh) -> tuple[Mesh, str]:
    """The surface without shells that touch no other and are hardly any of its volume, and a word about them.

    Shells touch if their boxes do.
    """
    shells = shells_of(mesh.faces)
    volumes = np.abs(np.bincount(shells, mesh.tetrahedra()))
    lower, upper = boxes(mesh, shells)
    groups = _touching(lower, upper)
    shares = np.bincount(groups, volumes) / volumes.sum()
    kept = (shares >= CRUMB)[groups]
    if kept.all() or not kept.any():
        return mesh, ""
    faces = mesh.faces[kept[shells]]
    used, indices = np.unique(faces, return_inverse=True)
    number = int((shares < CRUMB).sum())
    what = f"{number} pieces that touch nothing, together" if number > 1 else "A piece that touches nothing,"
    share = float(shares[shares < CRUMB].sum())
    return Mesh(mesh.vertices[used], indices.reshape(-1, 3)), (
        f"{what} {percent(share)} of the volume, {'were' if number > 1 else 'was'} left out."
    )


def percent(share: float) -> str:
    """A share of the volume as it is said, to two digits or to whole per cent: `0.33 %`, `100 %`."""
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"


def _touching(lower: Array, upper: Array) -> Indices:
    """The number of every box's group `[box_count]`, in which each touches another."""
    order = np.argsort(lower[:, 0])
    starts, first, second = lower[order, 0], [], []
    for place, box in enumerate(order):
        last = int(np.searchsorted(starts, upper[box, 0], side="right"))
        others = order[place + 1 : last]
        near = others[((lower[others] <= upper[box]) & (upper[others] >= lower[box])).all(axis=1)]
        first.append(np.full(len(near), box))
        second.append(near)
    one, other = np.concatenate(first), np.concatenate(second)
    links = np.arange(len(one))
    return _joined(len(lower), np.concatenate([one, other]), np.concatenate([links, links]))
