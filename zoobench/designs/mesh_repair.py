"""Repair of meshes: holes are closed, parts turned outwards, and surfaces that stay open are filled with voxels."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from zoobench.designs.shells import Indices, edges_of, is_closed, percent, shells_of, turned_outwards, without_crumbs
from zoobench.designs.solid_mesh import Mesh
from zoobench.designs.voxel_fill import filled
from zoobench.errors import UsageError, extra

_NO_VOLUME = 1e-6  # of the box around the body
_MOST_CLOSED = 0.7  # of its own area that may be added to a surface
_MOST_INVERTED = 0.01  # of the volume that parts inside out may enclose
_SAID = 0.001  # share of a volume from which it is said that parts share it


def repaired(mesh: Any, name: str) -> tuple[Mesh, tuple[str, ...], bool]:
    """A mesh of trimesh as a closed surface with normals outwards, the repairs as sentences, and if it was closed.

    Equal corners are merged. A surface that is not closed is closed by fans of triangles, or else filled with voxels.
    The first of the three is taken that encloses a volume and is not inside out anywhere.

    Raises:
        UsageError: it encloses no volume, or none of its triangles has an area.
    """
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    if not len(mesh.faces):
        raise UsageError(
            f"The corners of {name!r} lie on each other, or too far away to be told apart. Export it in another unit, "
            "near the origin."
        )
    for closed, words in _attempts(mesh):
        found, cavities = turned_outwards(closed)
        found, crumbs = without_crumbs(found)
        if _is_solid(found):
            return found, (*words, *_said(found, cavities, crumbs)), not words
    solid, word = filled(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64), name)
    return solid, (word,), False


def _attempts(mesh: Any) -> Iterator[tuple[Mesh, tuple[str, ...]]]:
    """The surface as it is, if it is closed, and with its holes closed."""
    faces = np.array(mesh.faces, np.int64)
    if is_closed(faces):
        yield Mesh(np.array(mesh.vertices, np.float64), faces), ()
    mesh.update_faces(mesh.unique_faces())
    holed = Mesh(np.array(mesh.vertices, np.float64), _wound(mesh))
    if (closed := _closed(holed)) is not None:
        yield closed


def _wound(mesh: Any) -> Indices:
    """The faces, turned so that neighbours agree, as most of each part were in the file."""
    trimesh = trimesh_or_advice()
    before = np.array(mesh.faces, np.int64)
    wound = mesh.copy()
    trimesh.repair.fix_winding(wound)
    after = np.array(wound.faces, np.int64)
    shells = shells_of(after)
    same = (after == before).all(axis=1)
    turned = np.bincount(shells, np.where(same, -1.0, 1.0)) > 0.0
    return np.where(turned[shells][:, None], after[:, ::-1], after)


def _closed(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]] | None:
    """The surface with a fan of triangles from the middle of every hole's rim, and a word; None if it is hardly one.

    The rim is where an edge is passed more often in one direction than in the other. With the fans it no longer is,
    whatever the rim looks like.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    number, sense = edges_of(mesh.faces)
    excess = np.bincount(number.ravel(), sense.ravel())
    if not excess.any():
        return mesh, ()
    ends = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, first = np.unique(number.ravel(), return_index=True)
    rim, times = ends[first][excess != 0.0], excess[excess != 0.0].astype(int)
    count = len(mesh.vertices)
    graph = coo_array((np.ones(len(rim)), (rim[:, 0], rim[:, 1])), shape=(count, count))
    hole = np.unique(connected_components(graph, directed=False)[1][rim[:, 0]], return_inverse=True)[1]
    ways = np.bincount(hole)
    middles = np.stack([np.bincount(hole, mesh.vertices[rim, axis].mean(axis=1)) / ways for axis in range(3)], axis=1)
    turned = np.where((times > 0)[:, None], rim[:, ::-1], rim)
    fans = np.repeat(np.column_stack([turned, count + hole]), np.abs(times), axis=0)
    vertices = np.concatenate([mesh.vertices, middles])
    if _area(vertices, fans) > _MOST_CLOSED * _area(vertices, mesh.faces):
        return None
    reach = np.max([np.ptp(mesh.vertices[rim[hole == n]].reshape(-1, 3), axis=0).max() for n in range(len(ways))])
    share = 100.0 * float(reach) / float(np.ptp(mesh.vertices, axis=0).max())
    holes = f"{len(ways)} holes" if len(ways) > 1 else "a hole"
    said = f"The mesh was open: {holes} with {len(rim)} edges, up to {share:.0f} % of its length wide, closed flat."
    return Mesh(vertices, np.concatenate([mesh.faces, fans])), (said,)


def _area(vertices: Any, faces: Indices) -> float:
    a, b, c = (vertices[faces[:, n]] for n in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)


def _is_solid(mesh: Mesh) -> bool:
    extents = np.ptp(mesh.vertices, axis=0)
    least = _NO_VOLUME * float(np.prod(np.maximum(extents, 1e-3 * extents.max())))
    volume = mesh.volume()
    return volume > least and mesh.inverted <= _MOST_INVERTED * volume


def _said(mesh: Mesh, cavities: int, crumbs: str) -> Iterator[str]:
    """How overlapping and inner parts were handled, as sentences."""
    if crumbs:
        yield crumbs
    if cavities:
        yield (
            f"{cavities} parts lie within others and are turned inwards: cavities."
            if cavities > 1
            else "A part lies within another and is turned inwards: a cavity."
        )
    volume = mesh.volume()
    for share, words in (
        (mesh.repeated / volume, "is enclosed by several parts at once: it counts once"),
        (mesh.inverted / volume, "is enclosed by parts inside out: it does not count"),
    ):
        if share > _SAID:
            yield f"{percent(share)} of the volume {words}."


def trimesh_or_advice() -> Any:
    """The module of trimesh.

    Raises:
        UsageError: it is not installed.
    """
    with extra("meshes", "Meshes need"):
        import trimesh
    return trimesh
