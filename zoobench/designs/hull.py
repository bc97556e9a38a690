"""The surface of a body in water, with its added mass: that of its solid, the same at every resolution, or, where only
its particles are known, where half of space is theirs."""

import math
from typing import cast

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body, Drawing
from zoobench.sim.model.potential_flow import areas
from zoobench.sim.model.surface_water import Hull

TRIANGLES = 1500
"""About so many. The fish has them where cubes of 5 mm find its surface, whose fins are three of them thick. The time
that the added mass takes grows as the square of the number and more: a second here."""

_MOST = 2
"""Times as many at most of particles, whose cubes are what they are."""

_COARSE = 1 / 24
"""Edge of the cubes by which triangles are counted first [of the length]."""

_SLIVER = 1e-4
"""Area of the least triangles [of a cube's face]."""

_CLOSED = 0.6
"""Share of a cube that a part counts for which is thinner than half a cube, so that it has a surface."""

_PLATE = 4
"""Cubes across a plate at most."""


def hull_of(body: Body) -> Hull:
    """The surface of a body, which is kept with it."""
    kept = vars(body)
    if "_hull" not in kept:
        triangles, edge = _of_particles(body) if body.drawing is None else _of_solid(body.drawing)
        kept["_hull"] = Hull(triangles, edge)
    return cast("Hull", kept["_hull"])


def _of_solid(drawing: Drawing) -> tuple[Array, float]:
    """The surface of a solid in triangles `[n, 3, 3]` [m], and the edge of the cubes that it was found with [m]."""
    low, high = drawing.lower, drawing.upper

    def found(edge: float) -> Array:
        cubes = np.ceil((high - low) / edge).astype(int)
        counts = cubes + 4
        if cubes.min() > _PLATE:  # one plane of points across a plate would make a wedge of its edges
            counts += 1 - counts % 2  # points on the middle planes, so that a symmetric body has a symmetric surface
        axes = [
            middle + edge * (np.arange(n) - (n - 1) / 2) for middle, n in zip((low + high) / 2, counts, strict=True)
        ]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        triangles = _surface(-drawing.distance(points.reshape(-1, 3)).reshape(points.shape[:3]), 0.0, edge)
        return cast("Array", triangles + points[0, 0, 0])

    coarse = _COARSE * float((high - low).max())
    edge = coarse * math.sqrt(len(found(coarse)) / TRIANGLES)
    return found(edge), edge


def _of_particles(body: Body) -> tuple[Array, float]:
    """The same where half of space is particles', in blocks of their cubes where triangles would be too many."""
    from scipy.ndimage import generate_binary_structure, maximum_filter

    cross = generate_binary_structure(3, 1)  # a cube and those that share a face with it
    index = np.round((body.sites - body.sites.min(axis=0)) / body.edge).astype(int)
    low, block = body.sites.min(axis=0), 1
    while True:
        shape = tuple((index.max(axis=0) // block + 3).tolist())
        fill = np.zeros(shape)
        np.add.at(fill, tuple((index // block + 1).T), body.occupancy * body.volumes / (block * body.edge) ** 3)
        whole = min(1.0, float(fill.max()))  # of a relaxed body, which may be thin matter everywhere
        thin = (fill > 0.0) & (maximum_filter(fill, footprint=cross) < _CLOSED * whole)
        triangles = _surface(np.where(thin, _CLOSED * whole, fill), 0.5 * whole, block * body.edge)
        if len(triangles) <= _MOST * TRIANGLES:
            return triangles + low - (0.5 * block + 0.5) * body.edge, block * body.edge
        block += 1


def _surface(field: Array, level: float, edge: float) -> Array:
    """The outer surface at which a field on cubes of this edge [m] falls to a level, in triangles `[n, 3, 3]` [m] whose
    corners are anticlockwise as seen from where it is lower. In a closed cavity no water flows.

    Where the field is the same above and below, or left and right, half of the surface is found, and mirrored: the
    diagonals of marching cubes are not symmetric, and a fin with a twist makes a robot roll.
    """
    from scipy.ndimage import binary_fill_holes
    from scipy.spatial import cKDTree
    from skimage import measure

    inside = field >= level
    field = np.where(binary_fill_holes(inside) & ~inside, field.max(), field)
    middles = [(axis, field.shape[axis] // 2) for axis in (1, 2) if _is_symmetric(field, axis)]
    for axis, middle in middles:
        field = np.take(field, range(middle, field.shape[axis]), axis)
    corners, faces, *_ = measure.marching_cubes(  # type: ignore[no-untyped-call]
        field, level, spacing=(edge,) * 3, gradient_direction="ascent"
    )
    found = corners[faces]
    for axis, middle in middles:
        mirrored = found[:, ::-1].copy()
        mirrored[..., axis] *= -1.0
        found = np.concatenate([found, mirrored])
        found[..., axis] += middle * edge
    found = found[np.linalg.norm(areas(found), axis=1) > _SLIVER * edge**2]
    # both halves of a mirrored body may end by one triangle: front and back of what has no thickness
    twins = cKDTree(found.mean(axis=1)).query_pairs(_SLIVER * edge, output_type="ndarray")
    return cast("Array", np.delete(found, twins.ravel(), axis=0))


def _is_symmetric(field: Array, axis: int) -> bool:
    """Whether a field on an odd number of points along an axis is its own mirror image there."""
    span = float(np.ptp(field))
    return field.shape[axis] % 2 == 1 and bool(np.allclose(field, np.flip(field, axis), rtol=0.0, atol=1e-9 * span))
