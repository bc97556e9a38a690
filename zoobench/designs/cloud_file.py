"""Files of point clouds: their columns, checked, and colours as body parts."""

from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs.claimed_size import check_npz, check_pcd
from zoobench.designs.grouping import main_axis
from zoobench.designs.mesh_repair import trimesh_or_advice
from zoobench.designs.thin_parts import NEAR, clumps
from zoobench.errors import UsageError, extra
from zoobench.inputs import path_of, read

_MOST_COLOURS = 64
_REGULAR = 1.2  # most of the distances of neighbours on a lattice, relative to their median
_SCATTERED = 2.0  # of the same: a cube so wide around each of randomly scattered points leaves no holes


@dataclass(frozen=True)
class Points:
    """The checked columns of a file; see `CloudDesign`.

    Attributes:
        fill: the share of each point's cube that is solid.
        muscle: the number of each point's muscle, or -1; None if the file has neither muscles nor colours.
        notes: what was made of colours, as sentences.
    """

    positions: Array
    muscle: NDArray[np.int64] | None
    fibres: Array
    stiffness: Array
    density_ratio: Array
    fill: Array
    notes: tuple[str, ...] = ()

    @cached_property
    def edge(self) -> float:
        """Edge of the cube that a point represents, in the file's unit."""
        from scipy.spatial import KDTree

        gaps = KDTree(self.positions).query(self.positions, k=2)[0][:, 1]
        usual, most = np.quantile(gaps, (0.5, 0.95))
        return float(most if most <= _REGULAR * usual else _SCATTERED * most)


def load_points(name: str) -> Points:
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
        colours = _colours(columns)
        found = Points(
            positions,
            _whole(columns["muscle"]) if "muscle" in columns else None,
            np.array(columns.get("fibres", np.tile([1.0, 0.0, 0.0], (len(positions), 1))), float),
            np.array(columns.get("stiffness", ones), float),
            np.array(columns.get("density_ratio", ones), float),
            np.array(columns.get("fill", ones), float),
        )
        for column, other in (("muscle", "fibres"), ("fibres", "muscle")):
            if column in columns and other not in columns:
                raise ValueError(f"it has {column} but no {other}")
    except UsageError:
        raise
    except Exception as error:  # readers raise errors of many types
        reason = str(error).partition("\n")[0]
        raise UsageError(
            f"{path.name!r} is no point cloud with the required columns: {reason}. See `zoobench show cloud`."
        ) from None
    _check(found, path.name)
    if found.muscle is None and colours is not None:
        found = _painted(found, colours, path.name)
    lengths = np.linalg.norm(found.fibres, axis=1, keepdims=True)
    found.fibres[:] = np.where(lengths > 0.0, found.fibres / np.maximum(lengths, 1e-300), (1.0, 0.0, 0.0))
    return found


def _check(points: Points, name: str) -> None:
    count = len(points.positions)
    if count < 2:
        raise UsageError(f"The column 'positions' of {name!r} has {count} points. Give those of a body, two at least.")
    shapes = {"positions": (count, 3), "fibres": (count, 3), "stiffness": (count,), "density_ratio": (count,)}
    shapes["fill"] = (count,)
    shapes |= {} if points.muscle is None else {"muscle": (count,)}
    for column, shape in shapes.items():
        values = getattr(points, column)
        if values.shape != shape or not np.isfinite(values).all():
            raise UsageError(
                f"The column {column!r} of {name!r} has shape {values.shape}; {shape} and finite values were expected."
            )
    if not points.edge > 0.0:
        raise UsageError(f"Most points of {name!r} lie on each other. Give each of them once.")
    if min(points.stiffness.min(), points.density_ratio.min()) <= 0.0:
        raise UsageError(f"{name!r} has a stiffness or density_ratio that is not positive. Give positive ones.")
    if not 0.0 < points.fill.min() <= points.fill.max() <= 1.0:
        raise UsageError(f"{name!r} has a fill that is not a share of a cube. Give numbers above 0, up to 1.")
    if points.muscle is None:
        return
    numbers = np.unique(points.muscle)
    if numbers[0] < -1 or not np.array_equal(numbers[numbers >= 0], np.arange((numbers >= 0).sum())):
        raise UsageError(f"The muscles of {name!r} are not numbered 0, 1, 2, ... with -1 for none. Renumber them.")
    if numbers[-1] < 0:
        raise UsageError(f"{name!r} has no muscle. Give some points a muscle from 0 on.")


def _painted(points: Points, colours: NDArray[np.int64], name: str) -> Points:
    """Points with a muscle for every colour `[n, 3]` but black, which is passive, and fibres along it.

    The convention of the published benchmark (SoftZoo's `AnnotatedPCD`): colours in the order of red, green and blue;
    the fibres of a colour are the first principal axis of the largest clump of its points.

    Raises:
        UsageError: there is no colour but black, or more than a few.
    """
    found, own = np.unique(colours, axis=0, return_inverse=True)
    own = own.ravel()
    active = found.any(axis=1)
    if not active.any() or active.sum() > _MOST_COLOURS:
        raise UsageError(
            f"{name!r} has points of {active.sum()} colours other than black; 1 to {_MOST_COLOURS} were expected, one "
            "for each muscle. Paint the parts, or leave the colours out and give grouping=paired."
        )
    muscle = np.where(active, np.cumsum(active) - 1, -1)[own]
    fibres, near = points.fibres.copy(), NEAR * points.edge
    for number in range(int(active.sum())):
        part = points.positions[muscle == number]
        labels = clumps(part, near)
        fibres[muscle == number], _ = main_axis(part[labels == np.bincount(labels).argmax()])
    passive = f", {100 * (muscle < 0).mean():.0f} % of the points are black and passive" if (muscle < 0).any() else ""
    note = f"The muscles are the {active.sum()} colours of the points, in the order of red, green, blue{passive}."
    return replace(points, muscle=muscle, fibres=fibres, notes=(note,))


def _colours(columns: dict[str, Any]) -> NDArray[np.int64] | None:
    """Red, green and blue of every point `[n, 3]`, from columns of their own or packed into one as the PCL does."""
    if all(name in columns for name in ("red", "green", "blue")):
        return np.stack([np.asarray(columns[name]) for name in ("red", "green", "blue")], axis=1).astype(np.int64)
    packed = next((np.ascontiguousarray(columns[name]) for name in ("rgb", "rgba") if name in columns), None)
    if packed is None:
        return None
    # four bytes, declared as an integer or, by tradition, as a float
    bits = packed.astype(np.float32).view(np.uint32) if packed.dtype.kind == "f" else packed
    return np.stack([bits.astype(np.int64) >> shift & 255 for shift in (16, 8, 0)], axis=1)


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
    check_npz(content)
    with np.load(BytesIO(content), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _ply(content: bytes) -> dict[str, Any]:
    cloud = trimesh_or_advice().load(BytesIO(content), file_type="ply")
    return _columns(cloud.metadata["_ply_raw"]["vertex"]["data"])


def _pcd(content: bytes) -> dict[str, Any]:
    with extra("meshes", "PCD files need"):
        from pypcd4 import PointCloud
    check_pcd(content)
    cloud: Any = PointCloud.from_fileobj(BytesIO(content))
    rows, promised = cloud.pc_data, cloud.metadata.points
    if len(rows) != promised:  # the library accepts truncated files
        raise ValueError(f"its header declares {promised} points, but it has {len(rows)}")
    return _columns(rows)


def _columns(rows: NDArray[np.void]) -> dict[str, Any]:
    """The columns of a table by name, with `positions` and `fibres` as vectors."""
    columns: dict[str, Any] = {name: rows[name] for name in rows.dtype.names or ()}
    columns["positions"] = np.stack([rows[name] for name in ("x", "y", "z")], axis=1)
    if all(name in columns for name in ("fx", "fy", "fz")):
        columns["fibres"] = np.stack([rows[name] for name in ("fx", "fy", "fz")], axis=1)
    return columns
