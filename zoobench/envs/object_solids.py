"""The solids of objects: a box, a ball and others by their proportions, or a mesh of the user's own."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.mesh_file import MeshPath, closed_mesh, upward
from zoobench.designs.pose import turned
from zoobench.designs.sampling import Shape
from zoobench.designs.solid_mesh import Mesh, shape_of
from zoobench.designs.thin_parts import Thickness, lattice_within
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity

ObjectKind = Literal["none", "box", "ball", "beam", "column", "sheet", "mesh"]

NO_MESH = MeshPath("")

PROPORTIONS: dict[str, tuple[float, float, float]] = {
    "box": (1.0, 1.0, 1.0),
    "ball": (1.0, 1.0, 1.0),
    "beam": (0.3, 0.3, 1.0),
    "column": (0.4, 1.0, 0.4),
    "sheet": (1.0, 0.2, 1.0),
}
"""Length, height and width of an object by its size."""

_FEWEST_CELLS = 2.0
"""Across the thinnest side: a thinner object is felt by nodes on both sides of it at once."""

_MOST_THIN = 0.5
"""Share of a mesh that may be thinner than a cell: less of the thinnest ball is."""


@dataclass(frozen=True)
class ObjectSolid:
    """The solid of an object.

    Attributes:
        kind: its name in messages.
        longest: its size as it was given [m].
        shape: standing on y = 0, its middle at x = z = 0.
        volume: of it [m^3].
    """

    kind: ObjectKind
    longest: float
    shape: Shape
    volume: float

    @property
    def size(self) -> Array:
        """Length, height and width `[3]` [m]."""
        return np.subtract(self.shape.upper, self.shape.lower)

    @cached_property
    def _thickness(self) -> Thickness:
        return Thickness.of(*lattice_within(self.shape, self.volume))

    def check(self, fidelity: Fidelity) -> None:
        """Check that it is thick enough for the grid.

        Raises:
            SceneError: it is not.
        """
        h, thinnest = fidelity.grid_spacing, float(self.size.min())
        if thinnest < (1.0 - 1e-9) * _FEWEST_CELLS * h:
            raise SceneError(
                f"A {self.kind} of {self.longest:g} m is {thinnest:.3g} m thin, {thinnest / h:.2g} cells of {h:.4g} m; "
                f"{_FEWEST_CELLS:g} are needed, and 4 felt well. Give an object_size of "
                f"{self.longest * _FEWEST_CELLS * h / thinnest:.3g} m or more, or a finer fidelity."
            )
        thin = 1.0 - self._thickness.share(h) if self.kind == "mesh" else 0.0
        if thin > _MOST_THIN:
            raise SceneError(
                f"A mesh of {self.longest:g} m has {100 * thin:.0f} % of its volume in parts that are thinner than a "
                f"cell of {h:.4g} m, and at most {100 * _MOST_THIN:.0f} % may be. Give a larger object_size, a mesh "
                "with thicker walls, or a finer fidelity."
            )


@lru_cache(maxsize=8)
def solid_of(kind: ObjectKind, longest: float, file: MeshPath) -> ObjectSolid:
    """The solid of an object whose longest side is so long [m]; kept, as to read a mesh takes long.

    Raises:
        UsageError: the file of a mesh cannot be read, or its surface is open or in pieces.
    """
    if kind == "mesh":
        mesh = _standing(closed_mesh(file), upward(file), longest)
        return ObjectSolid(kind, longest, shape_of(mesh), mesh.volume())
    length, height, width = size = longest * np.array(PROPORTIONS[kind])
    volume = float(length * height * width) * (math.pi / 6.0 if kind == "ball" else 1.0)
    inside = _in_ball(longest / 2) if kind == "ball" else _in_box(size)
    return ObjectSolid(kind, longest, Shape.standing(inside, length, height, width), volume)


def _standing(mesh: Mesh, up: Literal["y", "z"], longest: float) -> Mesh:
    """A mesh with x ahead, scaled to its longest side [m], its lowest point at y = 0, its middle at x = z = 0."""
    vertices = turned(mesh.vertices, "x", up)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    return Mesh((vertices - foot) * (longest / float((high - low).max())), mesh.faces)


def _in_box(size: Array) -> Callable[[Array], Mask | Array]:
    low, high = np.array([-0.5, 0.0, -0.5]) * size, np.array([0.5, 1.0, 0.5]) * size
    return lambda x: np.all((x >= low) & (x <= high), axis=-1)


def _in_ball(radius: float) -> Callable[[Array], Mask | Array]:
    centre = np.array([0.0, radius, 0.0])
    return lambda x: np.asarray(np.linalg.norm(x - centre, axis=-1) <= radius)
