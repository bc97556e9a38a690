"""Filling of surfaces that cannot be closed: inside and outside are told apart on a lattice of voxels."""

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask
from zoobench.designs.solid_mesh import Mesh
from zoobench.designs.triangles import points_on
from zoobench.errors import UsageError, extra

_VOXELS = 100  # along the longest edge
_RIM = 8  # voxels around the body
_GAPS = {0.75: 2, 1.5: 5, 3.0: 10}  # [voxels] half the width of gaps that are taken for closed, in turn: error [%]
_NEAR = 4.0  # [voxels] to the surface, up to which distances are known
_LEAST_CORE = 0.05  # share of the body that is farther from its surface than that
_MOST_BARE = 0.3  # share of the surface that is outside on both sides
_BESIDE = 2.0  # [voxels] from the surface, where its sides are


def filled(vertices: Array, faces: NDArray[np.int64], name: str) -> tuple[Mesh, str]:
    """A closed surface around the volume that the triangles enclose up to small gaps, and a note about it.

    Outside is what can be reached from afar at some distance from the surface, and what lies on the same side of it.
    The surface is where the distance is zero, between the voxels (Lorensen and Cline 1987: marching cubes).

    Args:
        vertices: `[vertex_count, 3]`.
        faces: indices of corners `[face_count, 3]`.
        name: of the file in messages.

    Raises:
        UsageError: hardly anything lies within, or scikit-image is not installed.
    """
    from scipy.ndimage import distance_transform_edt
    from scipy.spatial import KDTree

    low, size = vertices.min(axis=0), np.ptp(vertices, axis=0)
    pitch = float(size.max()) / _VOXELS
    start = low - _RIM * pitch
    cells = np.ceil(size / pitch).astype(int) + 2 * _RIM + 1
    places = start + pitch * np.indices(tuple(cells)).reshape(3, -1).T
    surface = points_on(vertices, faces, pitch / 3)
    free = np.ones(tuple(cells), bool)
    free[tuple(np.round((surface - start) / pitch).astype(int).T)] = False
    near = np.flatnonzero(distance_transform_edt(free) < _NEAR + 1.0)
    gaps, nearest = np.full(len(places), _NEAR * pitch), np.full(len(places), len(surface))
    gaps[near], nearest[near] = KDTree(surface).query(places[near])
    for width in _GAPS:
        outside = _outside((gaps > width * pitch).reshape(cells), places, surface, gaps, nearest)
        core = ~outside & (gaps > width * pitch)
        bare = _bare(vertices[faces], outside.reshape(cells), start, pitch)
        if core.sum() >= _LEAST_CORE * (~outside).sum() > 0 and bare <= _MOST_BARE:
            break
    else:
        raise UsageError(
            f"{name!r} encloses no volume: it is open, or flat. Give it walls of some thickness and close its holes in "
            "a modeller, then export it again."
        )
    with extra("meshes", "Open meshes need"):
        from skimage import measure
    signed = np.where(outside, gaps, -gaps).reshape(cells)
    corners, triangles, *_ = measure.marching_cubes(signed, 0.0, spacing=(pitch,) * 3)  # type: ignore[no-untyped-call]
    found = Mesh(start + corners.astype(np.float64), triangles.astype(np.int64))
    if found.signed_volume() < 0.0:
        found = Mesh(found.vertices, found.faces[:, ::-1])
    return found, (
        f"The mesh could not be closed, so it was filled with voxels of 1/{_VOXELS} of its length: details finer than "
        f"that are gone, and its volume is known to some {_GAPS[width]} %."
    )


def _outside(far: Mask, places: Array, surface: Array, gaps: Array, nearest: NDArray[np.int64]) -> Mask:
    """Which of the places `[n, 3]` lie outside `[n]`.

    Args:
        far: which are not near the surface, on the lattice `[i, j, k]`.
        places: centres of the voxels.
        surface: points on it `[m, 3]`.
        gaps: distances to it `[n]`.
        nearest: the index of the nearest of these points `[n]`, m if it is far away.
    """
    from scipy.ndimage import distance_transform_edt, label

    labels, _ = label(far)
    reached = labels == labels[0, 0, 0]
    _, (i, j, k) = distance_transform_edt(~reached, return_indices=True)
    seen = np.ravel_multi_index((i.ravel(), j.ravel(), k.ravel()), far.shape)
    found: Mask = reached.ravel().copy()
    band = np.flatnonzero(~far.ravel() & (nearest < len(surface)))
    foot = surface[nearest[band]]
    # the side of the surface on which the nearest place outside is
    found[band] = ((places[band] - foot) * (places[seen[band]] - foot)).sum(axis=1) > 0.0
    return found


def _bare(corners: Array, outside: Mask, start: Array, pitch: float) -> float:
    """The share of the area of triangles `[m, 3, 3]` that has outside on both sides.

    Args:
        outside: which voxels are outside `[i, j, k]`.
        start: the middle of the first voxel.
        pitch: edge of a voxel.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    step = _BESIDE * pitch * normals / np.maximum(doubled, 1e-300)[:, None]
    sides = (corners.mean(axis=1) + step, corners.mean(axis=1) - step)
    bare = [outside[tuple(np.round((side - start) / pitch).astype(int).T)] for side in sides]
    return float(doubled[bare[0] & bare[1]].sum() / doubled.sum())
