"""A user's own body: a point cloud from a file, with muscles and fibres."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body, sampled_once
from zoobench.designs.cloud_file import Points, load_points
from zoobench.designs.grouping import Grouping, Scheme, check_count, check_used, group
from zoobench.designs.pose import Direction, check_directions, directions, mirror_symmetry, pose_notes, turned
from zoobench.designs.sampling import Shape
from zoobench.designs.thin_parts import whole_sample
from zoobench.errors import SceneError, UsageError
from zoobench.inputs import InputFile
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_LARGEST = 1.0  # [m]
_END = 0.25  # of the length: head and tail


@register(Kind.DESIGN, "cloud", version=3, tags=("file",))
@dataclass(frozen=True, kw_only=True)
class CloudDesign:
    """A body from a point cloud in a file (PLY, PCD or NPZ), with the muscles and fibres given there.

    A PLY file has the vertex properties, and a PCD file the fields, x, y, z, muscle (a number from 0, or -1 for none),
    fx, fy, fz, and optionally stiffness, density_ratio and fill; an NPZ file has the arrays `positions` [n, 3],
    `muscle` [n] and `fibres` [n, 3], and optionally the other three. `zoobench design export` writes such PLY and PCD
    files.

    Instead of muscles and fibres, a PLY or PCD file may have colours, as the published benchmark's annotated bodies:
    every colour is a muscle, whose fibres run along its longest direction, and black is passive.

    Each point represents a cube as wide as the distance of neighbouring points, or twice that if they are scattered at
    random, of which the share `fill`, or all, is solid with the properties of the point.

    * `path`: of the file; its content becomes part of the run's key.
    * `length`: of the body along `ahead` [m]; 0 if the file is in metres.
    * `grouping`: `file` for the muscles or colours of the file, or `paired` if it has none; otherwise as for a mesh.
    * `muscles`: number of groups, if they are not the file's.
    * `ahead`, `up`: as for a mesh, see `zoobench show mesh`.
    """

    path: InputFile
    length: float = 0.0
    grouping: Literal["file", "paired", "k-means", "axis"] = "file"
    muscles: int = 12
    ahead: Direction = "x"
    up: Direction = "y"

    def __post_init__(self) -> None:
        if not 0.0 <= self.length < np.inf:
            raise UsageError(
                f"A cloud of length {self.length:g} m cannot be. Give a length of 0 (as in the file) or more."
            )
        check_count(self._scheme, self.muscles)
        check_directions(self.ahead, self.up)
        _ = self._points  # checks the file

    @property
    def _scheme(self) -> Scheme:
        """The scheme of the groups, if they are not the file's."""
        return "paired" if self.grouping == "file" else self.grouping

    @cached_property
    def _raw(self) -> Points:
        return load_points(self.path)

    @cached_property
    def _directions(self) -> tuple[str, str]:
        """The directions ahead and up in the file."""
        from scipy.spatial import KDTree

        points = self._raw.positions
        tree, near = KDTree(points), self._raw.edge

        def inside(places: Array) -> Mask:
            return np.asarray(tree.query(places)[0] <= near)

        size = np.ptp(points, axis=0)
        return directions(self.ahead, self.up, size, lambda axis: mirror_symmetry(points, inside, axis))

    @cached_property
    def _points(self) -> Points:
        """The points in place: x ahead, y up [m]."""
        raw = self._raw
        positions = turned(raw.positions, *self._directions) * self._scale
        size = np.ptp(positions, axis=0)
        if not 0.0 < size.max() <= _LARGEST:
            raise SceneError(
                f"The points of {self.path!r} span {size.max():g} m; up to {_LARGEST:g} m was expected. The file's "
                "unit may not be the metre: give metres, or the intended length, such as length=0.1."
            )
        return replace(raw, positions=positions, fibres=turned(raw.fibres, *self._directions))

    @property
    def _scale(self) -> float:
        """Metres per unit of the file."""
        if not self.length:
            return 1.0
        along = np.ptp(turned(self._raw.positions, *self._directions)[:, 0])
        return float(self.length / (along + self._raw.edge))

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import KDTree

        return KDTree(self._points.positions)

    @cached_property
    def _edge(self) -> float:
        """Edge of the cube that a point represents [m]."""
        return self._raw.edge * self._scale

    @cached_property
    def _foot(self) -> Array:
        """The point on the ground below the middle `[3]` [m]."""
        low, high = self._points.positions.min(axis=0), self._points.positions.max(axis=0)
        return np.array([(low[0] + high[0]) / 2, low[1] - self._edge / 2, (low[2] + high[2]) / 2])

    def _nearest(self, points: Array) -> tuple[NDArray[np.int64], Mask]:
        """Index of the nearest point of the cloud in the maximum norm, and whether the point is in its cube."""
        gap, index = self._tree.query(points + self._foot, p=np.inf)
        return index, gap <= self._edge / 2 * (1.0 + 1e-6)

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        size = np.ptp(self._points.positions, axis=0) + self._edge
        return Shape.standing(self._solid, *size)

    def _solid(self, points: Array) -> Array:
        """The share of space that is solid at points `[n, 3]` [m]."""
        own, inside = self._nearest(points)
        return np.where(inside, self._points.fill[own], 0.0)

    @cached_property
    def groups(self) -> Grouping:
        """The muscle groups, if they are not the file's; they do not depend on the fidelity."""
        return group(self._scheme, self.shape, self.shape.volume(), self.muscles)

    @sampled_once
    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution.

        Raises:
            SceneError: an end of the body is lost, or a muscle has no particle.
        """
        sample = whole_sample(self.path, self.shape, fidelity)
        own, _ = self._nearest(sample.points)
        points = self._points
        notes = (*pose_notes(self.up, self._directions), *sample.notes)
        if self.grouping == "file" and points.muscle is not None:
            count = int(points.muscle.max()) + 1
            shares = np.eye(count + 1)[points.muscle[own], :count]  # -1 selects the last row, which is zero
            names = tuple(f"muscle-{number + 1}" for number in range(count))
            fibres, notes = points.fibres[own], (*points.notes, *notes)
        else:
            shares, names = self.groups.membership(sample.points), self.groups.names
            fibres = self.groups.fibres(sample.points)
            if self.grouping == "file":
                notes = (f"The file has no muscles: {len(names)} in rows of four were made (grouping=paired).", *notes)
        membership = sample.mean(shares)
        check_used(membership, names, fidelity, self.path)
        return Body.of(
            sample,
            membership,
            names,
            **sample.ends((1.0 - 2.0 * _END) * self.shape.upper[0]),
            stiffness=sample.mean(points.stiffness[own]),
            density_ratio=sample.mean(points.density_ratio[own]),
            fibres=sample.direction(fibres, shares.sum(axis=1)),
            notes=notes,
        )
