"""Repair of meshes: holes are closed, normals turned outwards, and what stays open is filled with voxels."""

from typing import Any

import numpy as np

from zoobench.designs.triangles import points_on
from zoobench.errors import UsageError, extra

_VOXELS = 100  # along the longest edge of a body that is filled
_LEAST_INSIDE = 0.05  # of the filled voxels that are not its surface
_NO_VOLUME = 1e-6  # of the box around the body


def repaired(mesh: Any, name: str) -> tuple[Any, tuple[str, ...]]:
    """A mesh of trimesh as a closed surface with normals outwards, and what was done, as sentences.

    Equal corners are merged and inward normals turned without a word. Holes are closed by fans of triangles. If some
    edge then still has more faces on one side than on the other, the surface is filled with voxels.

    Raises:
        UsageError: it encloses no volume, or none of its triangles has an area.
    """
    trimesh = trimesh_or_advice()
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    if not len(mesh.faces):
        raise UsageError(
            f"The corners of {name!r} lie on each other, or too far away to be told apart. Export it in another unit, "
            "near the origin."
        )
    notes: list[str] = []
    if is_closed(mesh):
        trimesh.repair.fix_normals(mesh)
    else:
        trimesh.repair.fix_winding(mesh)
        notes += _close_holes(mesh, trimesh)
    if not is_closed(mesh):
        mesh, words = _filled(mesh, name, trimesh)
        notes = [words]
    if abs(mesh.volume) <= _NO_VOLUME * np.prod(np.maximum(mesh.extents, 1e-3 * mesh.extents.max())):
        raise UsageError(_nothing_inside(name))
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh, tuple(notes)


def is_closed(mesh: Any) -> bool:
    """Whether every edge is passed as often in one direction as in the other, so that all points have a winding number.

    Edges with four faces, as where two solids touch, are closed as well.
    """
    if not len(mesh.faces):
        return False
    _, owner = np.unique(mesh.edges_sorted, axis=0, return_inverse=True)
    sense = np.where(mesh.edges[:, 0] < mesh.edges[:, 1], 1.0, -1.0)
    return not np.bincount(owner.ravel(), weights=sense).any()


def _close_holes(mesh: Any, trimesh: Any) -> list[str]:
    """Close the holes as far as possible, and say how large they were."""
    _, owner, counts = np.unique(mesh.edges_sorted, axis=0, return_inverse=True, return_counts=True)
    is_open = counts[owner.ravel()] == 1
    if not is_open.any():
        return []
    rim = mesh.edges_sorted[is_open]
    holes = trimesh.graph.connected_components(rim)
    widest = max(float(np.ptp(mesh.vertices[hole], axis=0).max()) for hole in holes)
    trimesh.repair.fill_holes(mesh, use_fan=True)
    trimesh.repair.fix_normals(mesh)
    number = f"{len(holes)} holes" if len(holes) > 1 else "a hole"
    share = 100.0 * widest / float(mesh.extents.max())
    return [f"The mesh was open: {number} with {len(rim)} edges, up to {share:.0f} % of its length wide, closed flat."]


def _filled(mesh: Any, name: str, trimesh: Any) -> tuple[Any, str]:
    """The surface of the voxels on and within a mesh.

    Raises:
        UsageError: hardly any lie within.
    """
    from scipy.ndimage import binary_closing, binary_fill_holes

    pitch = float(mesh.extents.max()) / _VOXELS
    corner = np.array(mesh.bounds[0]) - 3.5 * pitch
    skin = np.zeros(np.ceil(mesh.extents / pitch).astype(int) + 8, bool)
    places = points_on(np.array(mesh.vertices), np.array(mesh.faces), pitch / 2)
    skin[tuple(((places - corner) / pitch).astype(int).T)] = True
    for width in (0, 1, 2):
        tight = binary_closing(skin, iterations=width) if width else skin
        solid = binary_fill_holes(tight)
        if solid.sum() - tight.sum() >= _LEAST_INSIDE * solid.sum():
            break
    else:
        raise UsageError(_nothing_inside(name))
    with extra("meshes", "Open meshes need"):
        filled = trimesh.voxel.ops.matrix_to_marching_cubes(solid, pitch=pitch)
    filled.apply_translation(corner + pitch / 2)  # the middle of the first voxel
    return filled, (
        f"The mesh could not be closed, so it was filled with voxels of 1/{_VOXELS} of its length: details finer than "
        "that are gone."
    )


def _nothing_inside(name: str) -> str:
    return (
        f"{name!r} encloses no volume: it is open, or flat. Give it walls of some thickness and close its holes in a "
        "modeller, then export it again."
    )


def trimesh_or_advice() -> Any:
    """The module of trimesh.

    Raises:
        UsageError: it is not installed.
    """
    with extra("meshes", "Meshes need"):
        import trimesh
    return trimesh
