"""A smooth surface around a robot that moves with its particles."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.feasibility import SOLID
from zoobench.sim.model.elastic_bodies import BodyParticles, SceneObject

_NEIGHBOURS = 24
_THIN = 1e-3  # share of a neighbourhood's widest spread below which it counts as flat there


@dataclass(frozen=True)
class Skin:
    """A closed surface; every vertex follows the particles around it.

    Attributes:
        faces: `[face_count, 3]` vertices of each triangle, counter-clockwise from outside.
        places: sparse weights `[vertex_count, particle_count]`, by which particles' positions give the vertices'.
        shares: the same for other values of the particles; none is below 0, and they sum to 1.
    """

    faces: NDArray[np.int64]
    places: Any
    shares: Any


def skin(body: Body) -> Skin:
    """The surface around the particles that exist.

    A vertex moves as an affine map, fitted by least squares to the motion of its neighbours, takes it from its place at
    rest: moving least squares (Levin 1998), which carry translation, rotation and uniform strain exactly.

    Args:
        body: the robot at rest.

    Raises:
        UsageError: scikit-image is not installed.
    """
    from scipy.sparse import csr_array
    from scipy.spatial import KDTree

    from zoobench.designs.export import surface

    solid = body.occupancy > SOLID
    own = np.flatnonzero(solid)
    vertices, faces = surface(replace(body, occupancy=solid.astype(float)))
    rest = body.positions[own]
    distance, nearest = KDTree(rest).query(vertices, k=min(_NEIGHBOURS, len(own)))
    distance, nearest = distance.reshape(len(vertices), -1), nearest.reshape(len(vertices), -1)
    weight = np.exp(-((distance / body.edge) ** 2))
    weight /= weight.sum(axis=1, keepdims=True)
    offset = rest[nearest]
    middle = np.einsum("vk,vki->vi", weight, offset)
    offset -= middle[:, None]
    spread = np.einsum("vk,vki,vkj->vij", weight, offset, offset)
    inverse = np.linalg.pinv(spread, rcond=_THIN, hermitian=True)
    linear = np.einsum("vij,vj->vi", inverse, vertices - middle)
    coefficients = weight * (1.0 + np.einsum("vi,vki->vk", linear, offset))
    rows = np.repeat(np.arange(len(vertices)), nearest.shape[1])
    shape = (len(vertices), body.particle_count)

    def sparse(values: Array) -> Any:
        return csr_array((values.ravel(), (rows, own[nearest].ravel())), shape=shape)

    sharper = weight**3
    return Skin(faces, sparse(coefficients), sparse(sharper / sharper.sum(axis=1, keepdims=True)))


def object_skin(thing: SceneObject, edge: float) -> Skin:
    """The surface of an object, whose particles stand for cubes of this edge [m] where it has none of its own."""
    body, count = thing.body, thing.body.particle_count
    arrays = {item.name: getattr(body, item.name) for item in fields(BodyParticles)}
    nowhere = np.zeros(count, bool)
    return skin(Body(**arrays, head=nowhere, tail=nowhere, muscles=(), sites=body.sites, edge=body.edge or edge))


def normals(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Unit normals of a surface at its vertices `[vertex_count, 3]`, those of its faces weighted by area."""
    corners = vertices[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(found, faces[:, corner], flat)
    unit: Array = found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-30)
    return unit
