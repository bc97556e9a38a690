"""A user's own body: a mesh from a file, with muscles and fibres derived from its shape."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body, sampled_once
from zoobench.designs.grouping import Grouping, Scheme, check_count, check_used, group
from zoobench.designs.mesh_file import FileMesh, MeshPath, load, upward
from zoobench.designs.pose import Direction, check_directions, directions, mirror_symmetry, pose_note, turned
from zoobench.designs.sampling import Shape
from zoobench.designs.scale import METRES, Unit, check_scale, checked_size, scale_note
from zoobench.designs.solid_mesh import Mesh, shape_of
from zoobench.designs.thin_parts import Thickness, lattice_within, pieces_note, whole_sample
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_ASSUMED = 0.10  # [m] length of a body of which neither length nor unit is given
_END = 0.25  # of the length: head and tail


@register(Kind.DESIGN, "mesh", version=4, tags=("file",))
@dataclass(frozen=True, kw_only=True)
class MeshDesign:
    """A body from a mesh in a file (STL, OBJ, PLY or GLB), with muscles derived from its shape.

    The mesh is rotated by `ahead` and `up`, scaled, and placed on the ground. Holes are closed; a surface that
    cannot be closed is filled with voxels. Parts may overlap: shared volume counts once. A part within another is a
    cavity if it is turned inwards. Pieces that touch nothing and hardly have a volume are left out. The body is divided
    into muscle groups, which do not depend on the resolution. `zoobench show` and `run` report repairs and assumptions.

    * `path`: of the file; its content becomes part of the run's key.
    * `length`: of the body along `ahead` [m]; 0 for the length that follows from `unit`.
    * `unit`: of the file; with `auto` and no length, the body is 0.10 m long.
    * `muscles`: number of groups; for `paired` a multiple of four.
    * `grouping`: `paired` for rows of equal volume from the tail to the head, each with a muscle left and right at the
      bottom and at the top, so that the body can bend to all sides, with fibres along it; `k-means` for compact groups
      and `axis` for slices of equal length along the longest axis, whose fibres run along the group's longest
      direction, or the body's if it has none, and change smoothly.
    * `ahead`, `up`: directions in the file. With `up=format`, y is up in GLB, whose format says so, and z in others, as
      in most CAD tools. With `up=auto`, the axis along which the body is most symmetric goes from side to side, the
      longer of the others ahead, the last up, z among equals. With `ahead=auto`, the longest axis other than `up` is
      ahead, x among equals. A body that then faces the wrong way needs `ahead=-x`.

    Parts thinner than a particle have their mass, in particles of small volume; a body that is too thin for
    the grid in more than half of its volume is refused.
    """

    path: MeshPath
    length: float = 0.0
    unit: Unit = "auto"
    muscles: int = 12
    grouping: Scheme = "paired"
    ahead: Direction = "auto"
    up: Literal["format", "auto", "x", "y", "z", "-x", "-y", "-z"] = "format"

    def __post_init__(self) -> None:
        check_scale(self.length, self.unit)
        check_count(self.grouping, self.muscles)
        check_directions(self.ahead, self._up)
        _ = self.mesh  # checks the file

    @cached_property
    def _file(self) -> FileMesh:
        return load(self.path)

    @property
    def _up(self) -> Direction:
        return upward(self.path) if self.up == "format" else self.up

    @cached_property
    def _directions(self) -> tuple[str, str]:
        """The directions ahead and up in the file."""
        raw = self._file.mesh
        points = raw.vertices
        if self._up == "auto" and len(within := lattice_within(shape_of(raw), raw.volume())[0]):
            points = within  # a wire may lie between all of them
        size = np.ptp(raw.vertices, axis=0)
        return directions(self.ahead, self._up, size, lambda axis: mirror_symmetry(points, raw.inside, axis))

    @cached_property
    def _turned(self) -> Mesh:
        """The surface with x ahead, y up, in the file's unit, the lowest point at y = 0, the middle at x = z = 0."""
        vertices = turned(self._file.mesh.vertices, *self._directions)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        foot = ((low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2)
        return Mesh(vertices - foot, self._file.mesh.faces)

    @cached_property
    def _size(self) -> Array:
        """Length, height and width in the file's unit `[3]`."""
        size: Array = np.ptp(self._turned.vertices, axis=0)
        return size

    @property
    def _scale(self) -> float:
        """Metres per unit of the file."""
        return METRES[self.unit] if self.unit != "auto" else (self.length or _ASSUMED) / float(self._size[0])

    @cached_property
    def mesh(self) -> Mesh:
        """The surface in place, like `_turned` [m]."""
        checked_size(self.path, self._size * self._scale)
        return Mesh(self._turned.vertices * self._scale, self._turned.faces)

    @cached_property
    def _volume(self) -> float:
        return self._file.mesh.volume() * self._scale**3

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """How the file was interpreted, as sentences."""
        assumed = f"its unit is not known, so it was scaled by {self._scale:.4g} to a length of {_ASSUMED:g} m"
        why = "as the format has it" if self._up == "y" else "as most CAD tools have it"
        return (
            scale_note(self._size, self._scale, self.length, self.unit, assumed),
            *pose_note(self.ahead, self.up, self._directions, why),
            *self._file.notes,
            *pieces_note(self.shape, self._volume),
        )

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        return shape_of(self.mesh)

    @cached_property
    def _thickness(self) -> Thickness:
        return Thickness.of(*lattice_within(self.shape, self._volume))

    @cached_property
    def groups(self) -> Grouping:
        """The muscle groups; they do not depend on the fidelity."""
        return group(self.grouping, self.shape, self._volume, self.muscles)

    @sampled_once
    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution.

        Raises:
            SceneError: the body is too thin for the grid, an end of it is lost, or a muscle has no particle.
        """
        self._thickness.check(fidelity, self.path)
        sample = whole_sample(self.path, self.shape, fidelity).of_volume(self._volume)
        shares = self.groups.membership(sample.points)
        membership = sample.mean(shares)
        check_used(membership, self.groups.names, fidelity, self.path)
        return Body.of(
            sample,
            membership,
            self.groups.names,
            **sample.ends((1.0 - 2.0 * _END) * self.shape.upper[0]),
            fibres=self.groups.fibres(sample.positions),  # they vary smoothly
            notes=(*self.notes, *sample.notes),
        )
