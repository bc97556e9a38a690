"""A user's own body: a point cloud from a file, with muscles and fibres."""

from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs.base import Body, Mask, Shape
from zoobench.designs.solid_mesh import trimesh_or_advice
from zoobench.errors import SceneError, UsageError
from zoobench.inputs import InputFile, path_of, read
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

_LARGEST = 1.0  # [m]
_END = 0.25  # of the length: head and tail


@register(Kind.DESIGN, "cloud", tags=("file",))
@dataclass(frozen=True, kw_only=True)
class CloudDesign:
    """A body from a point cloud in a file (PLY, PCD or NPZ), with the muscles and fibres given there.

    In metres, x ahead, y up. A PLY file has the vertex properties, and a PCD file the fields, x, y, z, muscle (a number
    from 0, or -1 for none), fx, fy, fz, and optionally stiffness and density_ratio; an NPZ file has the arrays
    `positions` [n, 3], `muscle` [n] and `fibres` [n, 3], and optionally the other two. `zoobench design export` writes
    such PLY and PCD files. Each point represents a cube as wide as the distance of neighbouring points; particles in
    the cube have the properties of the point.

    * `path`: of the file; its content becomes part of the run's key.
    """

    path: InputFile

    def __post_init__(self) -> None:
        _ = self._points  # checks the file

    @cached_property
    def _points(self) -> "_Points":
        points = _load(self.path)
        size = np.ptp(points.positions, axis=0)
        if not 0.0 < size.max() <= _LARGEST:
            raise SceneError(
                f"The points of {self.path!r} span {size.max():g} m; up to {_LARGEST:g} m was expected. Give metres."
            )
        return points

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import KDTree

        return KDTree(self._points.positions)

    @cached_property
    def _edge(self) -> float:
        """Edge of the cube that a point represents [m]."""
        return float(np.quantile(self._tree.query(self._points.positions, k=2)[0][:, 1], 0.95))

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
        return Shape.standing(lambda points: self._nearest(points)[1], *size)

    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution."""
        positions, volumes = self.shape.sample(fidelity)
        own, _ = self._nearest(positions)
        points = self._points
        count = int(points.muscle.max()) + 1
        reach = (1.0 - 2.0 * _END) * float(np.abs(positions[:, 0]).max())
        return Body(
            positions=positions,
            volumes=volumes,
            stiffness=points.stiffness[own],
            density_ratio=points.density_ratio[own],
            occupancy=np.ones(len(positions)),
            muscle_membership=np.eye(count + 1)[points.muscle[own], :count],  # -1 selects the last row, which is zero
            fibres=points.fibres[own],
            head=positions[:, 0] > reach,
            tail=positions[:, 0] < -reach,
            muscles=tuple(f"muscle-{number + 1}" for number in range(count)),
        )


@dataclass(frozen=True)
class _Points:
    """The checked columns of a file; see `CloudDesign`."""

    positions: Array
    muscle: NDArray[np.int64]
    fibres: Array
    stiffness: Array
    density_ratio: Array


def _load(name: str) -> _Points:
    """The points of a file.

    Raises:
        UsageError: the file cannot be read, or its columns are invalid.
    """
    path, content = path_of(name), read(name)
    reader = {".npz": _npz, ".pcd": _pcd, ".ply": _ply}.get(path.suffix.lower())
    if reader is None:
        raise UsageError(f"{path.name!r} ends in {path.suffix!r}. Give a point cloud as .ply, .pcd or .npz.")
    try:
        columns = reader(content)
        positions = np.array(columns["positions"], float)
        ones = np.ones(len(positions))
        found = _Points(
            positions,
            _whole(columns["muscle"]),
            np.array(columns["fibres"], float),
            np.array(columns.get("stiffness", ones), float),
            np.array(columns.get("density_ratio", ones), float),
        )
    except UsageError:
        raise
    except Exception as error:  # readers raise errors of many types
        reason = str(error).partition("\n")[0]
        raise UsageError(
            f"{path.name!r} is no point cloud with the required columns: {reason}. See `zoobench show cloud`."
        ) from None
    _check(found, path.name)
    lengths = np.linalg.norm(found.fibres, axis=1, keepdims=True)
    found.fibres[:] = np.where(lengths > 0.0, found.fibres / np.maximum(lengths, 1e-300), (1.0, 0.0, 0.0))
    return found


def _check(points: _Points, name: str) -> None:
    count = len(points.positions)
    shapes = {"positions": (count, 3), "muscle": (count,), "fibres": (count, 3), "stiffness": (count,)}
    shapes["density_ratio"] = (count,)
    for column, shape in shapes.items():
        values = getattr(points, column)
        if values.shape != shape or not np.isfinite(values).all() or count < 2:
            raise UsageError(
                f"The column {column!r} of {name!r} has shape {values.shape}; {shape} and finite values were expected."
            )
    if points.muscle.min() < -1 or set(range(points.muscle.max() + 1)) - set(points.muscle.tolist()):
        raise UsageError(f"The muscles of {name!r} are not numbered 0, 1, 2, ... with -1 for none. Renumber them.")
    if points.muscle.max() < 0:
        raise UsageError(f"{name!r} has no muscle. Give some points a muscle from 0 on.")
    if min(points.stiffness.min(), points.density_ratio.min()) <= 0.0:
        raise UsageError(f"{name!r} has a stiffness or density_ratio that is not positive. Give positive ones.")


def _whole(values: Any) -> NDArray[np.int64]:
    """Numbers of muscles as integers; other programs may write them as decimals.

    Raises:
        ValueError: a number is not whole.
    """
    numbers = np.asarray(values, float)
    if not (np.isfinite(numbers) & (numbers == np.round(numbers))).all():
        raise ValueError("a muscle's number is not whole")
    return numbers.astype(np.int64)


def _npz(content: bytes) -> dict[str, Any]:
    with np.load(BytesIO(content), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _ply(content: bytes) -> dict[str, Any]:
    cloud = trimesh_or_advice().load(BytesIO(content), file_type="ply")
    return _columns(cloud.metadata["_ply_raw"]["vertex"]["data"])


def _pcd(content: bytes) -> dict[str, Any]:
    try:
        from pypcd4 import PointCloud
    except ImportError:
        raise UsageError(
            "PCD files need pypcd4, which is not installed. Try: pip install 'zoobench[meshes]'."
        ) from None
    cloud: Any = PointCloud.from_fileobj(BytesIO(content))
    rows, promised = cloud.pc_data, cloud.metadata.points
    if len(rows) != promised:  # the library accepts truncated files
        raise ValueError(f"its header declares {promised} points, but it has {len(rows)}")
    return _columns(rows)


def _columns(rows: NDArray[np.void]) -> dict[str, Any]:
    """The columns of a table by name, with `positions` and `fibres` as vectors."""
    columns: dict[str, Any] = {name: rows[name] for name in rows.dtype.names or ()}
    columns["positions"] = np.stack([rows[name] for name in ("x", "y", "z")], axis=1)
    columns["fibres"] = np.stack([rows[name] for name in ("fx", "fy", "fz")], axis=1)
    return columns
