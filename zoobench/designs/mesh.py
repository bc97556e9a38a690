"""A user's own body: a mesh from a file, with muscles and fibres derived from its shape."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zoobench.designs.base import Body, sampled_once
from zoobench.designs.grouping import Grouping, Scheme, check_count, check_used, group
from zoobench.designs.pose import Direction, check_directions, directions, mirror_symmetry, pose_notes, turned
from zoobench.designs.sampling import Shape
from zoobench.designs.solid_mesh import Mesh, load
from zoobench.designs.thin_parts import Thickness, lattice_within, whole_sample
from zoobench.errors import SceneError, UsageError
from zoobench.inputs import InputFile
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_SMALLEST, _LARGEST = 0.01, 1.0  # [m] range of the body's length
_POINTS = 1_000_000  # by which a mesh is sampled: some of them lie in a fin of a millimetre
_END = 0.25  # of the length: head and tail


@register(Kind.DESIGN, "mesh", version=3, tags=("file",))
@dataclass(frozen=True, kw_only=True)
class MeshDesign:
    """A body from a mesh in a file (STL, OBJ, PLY or GLB), with muscles derived from its shape.

    The mesh is rotated by `ahead` and `up`, scaled, and placed on the ground. Holes are closed; what cannot be closed
    is filled with voxels. Its volume is divided into muscle groups, which do not depend on the resolution.

    * `path`: of the file; its content becomes part of the run's key.
    * `length`: of the body along `ahead` [m]; 0 if the file is in metres.
    * `muscles`: number of groups; for `paired` a multiple of four.
    * `grouping`: `paired` for rows of equal volume from the tail to the head, each with a muscle left and right at the
      bottom and at the top, so that the body can bend to all sides, with fibres along it; `k-means` for compact groups
      and `axis` for slices of equal length along the longest axis, whose fibres run along the group's longest
      direction, or the body's if it has none, and change smoothly.
    * `ahead`, `up`: directions in the file; most CAD tools have z up. With `up=auto`, the axis along which the body is
      most symmetric goes from side to side, the longer of the others ahead, the last up, z among equals. With
      `ahead=auto`, the longest axis other than `up` is ahead, x among equals. A body that then faces the wrong way
      needs `ahead=-x`.

    What is thinner than a particle is there with its mass, in particles of small volume; a body that is too thin for
    the grid in more than half of its volume is refused.
    """

    path: InputFile
    length: float = 0.10
    muscles: int = 12
    grouping: Scheme = "paired"
    ahead: Direction = "auto"
    up: Direction = "z"

    def __post_init__(self) -> None:
        if not 0.0 <= self.length < np.inf:
            raise UsageError(
                f"A mesh of length {self.length:g} m cannot be. Give a length of 0 (as in the file) or more."
            )
        check_count(self.grouping, self.muscles)
        check_directions(self.ahead, self.up)
        _ = self.mesh  # checks the file

    @cached_property
    def _raw(self) -> Mesh:
        return load(self.path)

    @cached_property
    def _directions(self) -> tuple[str, str]:
        """The directions ahead and up in the file."""
        raw = self._raw
        points = raw.vertices
        if self.up == "auto" and len(within := lattice_within(_shape(raw), abs(raw.volume()))[0]):
            points = within  # a wire may lie between all of them
        size = np.ptp(raw.vertices, axis=0)
        return directions(self.ahead, self.up, size, lambda axis: mirror_symmetry(points, raw.inside, axis))

    @cached_property
    def mesh(self) -> Mesh:
        """The surface in place: x ahead, y up, the lowest point at y = 0, the middle at x = z = 0 [m]."""
        vertices = turned(self._raw.vertices, *self._directions)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        vertices = vertices - ((low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2)
        scale = self.length / (high[0] - low[0]) if self.length else 1.0
        size = (high - low) * scale
        if not _SMALLEST <= size.max() <= _LARGEST:
            raise SceneError(
                f"The body of {self.path!r} is {size[0]:g} m long, {size[1]:g} m high and {size[2]:g} m wide; "
                f"{_SMALLEST:g} to {_LARGEST:g} m was expected of the largest. The file's unit may not be the metre: "
                "give the intended length, such as length=0.1."
            )
        return Mesh(vertices * scale, self._raw.faces, self._raw.repairs)

    @cached_property
    def _volume(self) -> float:
        return self.mesh.volume()

    @cached_property
    def shape(self) -> Shape:
        """The solid, standing on y = 0."""
        return _shape(self.mesh)

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
        sample = whole_sample(self.path, self.shape, fidelity)
        sample = replace(sample, volumes=sample.volumes * (self._volume / sample.volumes.sum()))
        shares = self.groups.membership(sample.points)
        membership = sample.mean(shares)
        check_used(membership, self.groups.names, fidelity, self.path)
        return Body.of(
            sample,
            membership,
            self.groups.names,
            **sample.ends((1.0 - 2.0 * _END) * self.shape.upper[0]),
            fibres=self.groups.fibres(sample.positions),  # they vary smoothly
            notes=(*pose_notes(self.up, self._directions), *self.mesh.repairs, *sample.notes),
        )


def _shape(mesh: Mesh) -> Shape:
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return Shape(mesh.inside, (low[0], low[1], low[2]), (high[0], high[1], high[2]), _POINTS)
