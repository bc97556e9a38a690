"""A user's own body: a point cloud from a file, with muscles and fibres."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body, sampled_once
from zoobench.designs.cloud_file import ENDINGS, load_points
from zoobench.designs.cloud_points import Points
from zoobench.designs.grouping import Grouping, Scheme, check_count, check_used, group
from zoobench.designs.point_matter import Lattice
from zoobench.designs.pose import (
    Direction,
    check_directions,
    directions,
    mirror_symmetry,
    pose_note,
    turned,
    turned_back,
)
from zoobench.designs.sampling import Shape
from zoobench.designs.scale import METRES, Unit, check_scale, checked_size, scale_note
from zoobench.designs.thin_parts import Thickness, lattice_within, pieces_note, whole_sample
from zoobench.errors import SceneError
from zoobench.inputs import InputFile
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_END = 0.25  # of the length: head and tail
_LEAST_SCATTERED = 500  # points
_THICK = 3.0  # spacings of scattered points: thinner parts have none within
_FILLED = 0.5  # share of a body that has to be so thick


class CloudPath(InputFile):
    """Annotation of a parameter that names a point cloud."""

    __slots__ = ()
    endings: ClassVar[tuple[str, ...]] = ENDINGS


@register(Kind.DESIGN, "cloud", version=5, tags=("file",))
@dataclass(frozen=True, kw_only=True)
class CloudDesign:
    """A body from a point cloud in a file (PLY, PCD or NPZ), with the muscles and fibres given there.

    A PLY file has the vertex properties, and a PCD file the fields, x, y, z, muscle (a number from 0, or -1 for none),
    fx, fy, fz, and optionally stiffness, density_ratio and fill; an NPZ file has the arrays `positions` [n, 3],
    `muscle` [n] and `fibres` [n, 3], and optionally the other three. What `zoobench design export` writes in one of
    the three is read as the same body.

    Instead of muscles and fibres, a PLY or PCD file may have colours, as the published benchmark's annotated bodies:
    every colour is a muscle, whose fibres run along its longest direction, and black is passive.

    On a lattice along the axes each point represents its cell, of which the share `fill`, or all, is solid with the
    properties of the point. The space between scattered points is solid. Points without a place and few that
    lie far from all others are left out. `zoobench show` and `run` report omissions and assumptions.

    * `path`: of the file; its content becomes part of the run's key.
    * `length`: of the body along `ahead` [m]; 0 for the length that follows from `unit`.
    * `unit`: of the file; with `auto` and no length, the file is in metres.
    * `grouping`: `file` for the muscles or colours of the file, or `paired` if it has none; otherwise as for a mesh.
    * `muscles`: number of groups, if they are not the file's.
    * `ahead`, `up`: as for a mesh, see `zoobench show mesh`; `up=format` is y, as in exported files.

    A body that is too thin for the grid in more than half of its volume is refused, as points on a surface are.
    """

    path: CloudPath
    length: float = 0.0
    unit: Unit = "auto"
    grouping: Literal["file", "paired", "k-means", "axis"] = "file"
    muscles: int = 12
    ahead: Literal["format", "auto", "x", "y", "z", "-x", "-y", "-z"] = "format"
    up: Literal["format", "auto", "x", "y", "z", "-x", "-y", "-z"] = "format"

    def __post_init__(self) -> None:
        check_scale(self.length, self.unit)
        check_count(self._scheme, self.muscles)
        check_directions(*self._asked)
        checked_size(self.path, self._size * self._scale)

    @property
    def _asked(self) -> tuple[Direction, Direction]:
        """The directions ahead and up, or `auto`."""
        return "x" if self.ahead == "format" else self.ahead, "y" if self.up == "format" else self.up

    @property
    def _scheme(self) -> Scheme:
        """The scheme of the groups, if they are not the file's."""
        return "paired" if self.grouping == "file" else self.grouping

    @cached_property
    def _points(self) -> Points:
        """The points in the file's directions and unit."""
        return load_points(self.path)

    @cached_property
    def _directions(self) -> tuple[str, str]:
        """The directions ahead and up in the file."""
        points, matter = self._points.positions, self._points.matter
        size = np.ptp(points, axis=0)
        return directions(
            *self._asked, size, lambda axis: mirror_symmetry(points, lambda at: matter.solid(at)[1], axis)
        )

    @cached_property
    def _box(self) -> tuple[Array, Array]:
        """Lower and upper corner `[3]` of the body, turned, in the file's unit."""
        positions, reach = self._points.positions, self._points.matter.reach
        corners = np.stack([positions.min(axis=0) - reach, positions.max(axis=0) + reach])
        ends = turned(corners, *self._directions)
        return ends.min(axis=0), ends.max(axis=0)

    @property
    def _size(self) -> Array:
        """Length, height and width in the file's unit `[3]`."""
        return self._box[1] - self._box[0]

    @property
    def _scale(self) -> float:
        """Metres per unit of the file."""
        if self.length:
            return self.length / float(self._size[0])
        return METRES["m" if self.unit == "auto" else self.unit]

    def _nearest(self, points: Array) -> tuple[NDArray[np.int64], Mask]:
        """The point of the cloud at each of the points `[n, 3]` [m], and whether there is one."""
        low, high = self._box
        foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
        places = points / self._scale + foot
        return self._points.matter.solid(turned_back(places, *self._directions))

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        return Shape.standing(self._solid, *self._size * self._scale)

    def _solid(self, points: Array) -> Array:
        """The share of space that is solid at points `[n, 3]` [m]."""
        own, inside = self._nearest(points)
        return np.where(inside, self._points.fill[own], 0.0)

    @cached_property
    def _volume(self) -> float:
        """Volume of the solid [m^3]: that of the cells, or as measured."""
        matter = self._points.matter
        if isinstance(matter, Lattice):
            return float(self._points.fill.sum()) * matter.cell * self._scale**3
        return self.shape.volume()

    @cached_property
    def _thickness(self) -> Thickness:
        return Thickness.of(*lattice_within(self.shape, self._volume))

    def _check_inside(self) -> None:
        """Check that scattered points fill a volume.

        Raises:
            SceneError: there are few, or they lie on surfaces or lines.
        """
        matter, count = self._points.matter, len(self._points.positions)
        if isinstance(matter, Lattice):
            return
        if count < _LEAST_SCATTERED:
            raise SceneError(
                f"{self.path!r} has {count} points on no lattice, too few to know what lies between them. Give "
                f"{_LEAST_SCATTERED} or more, or points on a lattice along the axes."
            )
        thick = _THICK * matter.spacing * self._scale
        if self.shape.upper[1] < thick or self._thickness.share(thick) < _FILLED:
            raise SceneError(
                f"The points of {self.path!r} lie on surfaces or lines: hardly any lies within. Give points that fill "
                "the body, or its surface as a mesh, as in mesh[path=body.stl]."
            )

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """How the file was interpreted, as sentences."""
        points = self._points
        lattice = isinstance(points.matter, Lattice)
        made = self.grouping == "file" and points.shares is None
        return (
            scale_note(self._size, self._scale, self.length, self.unit, "its unit was taken for the metre"),
            *pose_note(self.ahead, self.up, self._directions, "as in exported files"),
            *points.notes,
            *(() if lattice else ("The points lie on no lattice: the volume between them is known to some 5 %.",)),
            *(
                (f"The file has no muscles: {self.muscles} in rows of four were made (grouping=paired).",)
                if made
                else ()
            ),
            *pieces_note(self.shape, self._volume),
        )

    @cached_property
    def groups(self) -> Grouping:
        """The muscle groups, if they are not the file's; they do not depend on the fidelity."""
        return group(self._scheme, self.shape, self._volume, self.muscles)

    @sampled_once
    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution.

        Raises:
            SceneError: the body is too thin for the grid, an end of it is lost, or a muscle has no particle.
        """
        self._check_inside()
        self._thickness.check(fidelity, self.path)
        sample = whole_sample(self.path, self.shape, fidelity).of_volume(self._volume)
        own, _ = self._nearest(sample.points)
        points = self._points
        if self.grouping == "file" and points.shares is not None:
            shares, names = points.shares[own], points.muscles
            fibres = turned(points.fibres[own], *self._directions)
        else:
            shares, names = self.groups.membership(sample.points), self.groups.names
            fibres = self.groups.fibres(sample.points)
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
            notes=(*self.notes, *sample.notes),
        )
