"""A user's own body: a closed mesh from a file, with muscles and fibres derived from its shape."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body, Shape
from zoobench.designs.grouping import Grouping, k_means, slices
from zoobench.designs.solid_mesh import Mesh, load
from zoobench.errors import SceneError, UsageError
from zoobench.inputs import InputFile
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

Direction = Literal["x", "y", "z", "-x", "-y", "-z"]

_SMALLEST, _LARGEST = 0.01, 1.0  # [m] range of the body's length
_GROUPING_POINTS = 4000  # about, from which the muscle groups are computed
_END = 0.25  # of the length: head and tail
_NEAR = 1.75  # [particle edges] distance of neighbours, diagonals of a square included
_SHEET = 9  # a particle in a sheet of one layer has fewer neighbours


@register(Kind.DESIGN, "mesh", tags=("file",))
@dataclass(frozen=True, kw_only=True)
class MeshDesign:
    """A body from a closed mesh in a file (STL, OBJ, PLY or GLB), with muscles derived from its shape.

    The mesh is rotated by `ahead` and `up`, scaled, and placed on the ground. Its volume is divided into muscle groups.
    The fibres of a group run along its longest direction, or along the body if it has none, and change smoothly between
    groups. The groups do not depend on the resolution.

    * `path`: of the file; its content becomes part of the run's key.
    * `length`: of the body along `ahead` [m]; 0 if the file is in metres.
    * `muscles`: number of groups.
    * `grouping`: `k-means` for compact groups, `axis` for slices of equal length along the longest axis.
    * `ahead`, `up`: directions in the file; most CAD tools have z up.
    """

    path: InputFile
    length: float = 0.10
    muscles: int = 4
    grouping: Literal["k-means", "axis"] = "k-means"
    ahead: Direction = "x"
    up: Direction = "z"

    def __post_init__(self) -> None:
        if not 0.0 <= self.length < np.inf or not 1 <= self.muscles <= 32:
            raise UsageError(
                f"A mesh of length {self.length:g} m with {self.muscles} muscles cannot be. Give a length of 0 (as "
                "in the file) or more, and 1 to 32 muscles."
            )
        if self.ahead[-1] == self.up[-1]:
            raise UsageError(f"ahead={self.ahead} and up={self.up} lie on one line. Give two axes of the file.")
        _ = self.mesh  # checks the file

    @cached_property
    def mesh(self) -> Mesh:
        """The surface in place: x ahead, y up, the lowest point at y = 0, the middle at x = z = 0 [m]."""
        raw = load(self.path)
        ahead, up = _axis(self.ahead), _axis(self.up)
        vertices = raw.vertices @ np.stack([ahead, up, np.cross(ahead, up)], axis=1)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        vertices = vertices - ((low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2)
        scale = self.length / (high[0] - low[0]) if self.length else 1.0
        size = (high - low) * scale
        if not _SMALLEST <= size.max() <= _LARGEST:
            raise SceneError(
                f"The body of {self.path!r} is {size.max():g} m long; {_SMALLEST:g} to {_LARGEST:g} m was expected. "
                "The file's unit may not be the metre: give the intended length, such as length=0.1."
            )
        return Mesh(vertices * scale, raw.faces)

    @cached_property
    def _volume(self) -> float:
        return self.mesh.volume()

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        low, high = self.mesh.vertices.min(axis=0), self.mesh.vertices.max(axis=0)
        return Shape(self.mesh.inside, (low[0], low[1], low[2]), (high[0], high[1], high[2]))

    @cached_property
    def groups(self) -> Grouping:
        """The muscle groups, computed once on a lattice of their own, so that they do not depend on the fidelity."""
        spacing = (self._volume / _GROUPING_POINTS) ** (1 / 3)
        points, _ = self.shape.sample(Fidelity(spacing, particles_per_cell=1))
        return (k_means if self.grouping == "k-means" else slices)(points, self.muscles)

    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution.

        Raises:
            SceneError: the body is too thin for the grid: a single layer of particles, or not connected.
        """
        positions, _ = self.shape.sample(fidelity)
        self._check_thickness(positions, fidelity)
        volumes = np.full(len(positions), self._volume / len(positions))
        along, membership = positions[:, 0], self.groups.membership(positions)
        end = (1.0 - 2.0 * _END) * float(np.abs(along).max())
        body = Body.uniform((positions, volumes), membership, self.groups.names, head=along > end, tail=along < -end)
        return replace(body, fibres=self.groups.fibres(positions))

    def _check_thickness(self, positions: Array, fidelity: Fidelity) -> None:
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import KDTree

        edge = fidelity.particle_edge
        tree = KDTree(positions)
        neighbours = tree.query_ball_point(positions, _NEAR * edge, return_length=True) - 1
        pieces = connected_components(tree.sparse_distance_matrix(tree, _NEAR * edge))[0]
        if (neighbours >= _SHEET).mean() < 0.5 or pieces > self.mesh.pieces():
            raise SceneError(
                f"The body of {self.path!r} is too thin for a grid spacing of {fidelity.grid_spacing:.4g} m: "
                f"{len(positions)} particles in {pieces} pieces, most of them in a single layer. It needs walls of "
                f"{2 * edge:.4g} m or more: use a finer fidelity, or a larger length."
            )


def _axis(name: str) -> Array:
    """The unit vector `[3]` of a direction."""
    axis = np.zeros(3)
    axis["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return axis
