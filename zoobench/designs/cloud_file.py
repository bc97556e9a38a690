"""Point clouds in files: reading their columns."""

import re
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.designs.claimed_size import check_npz, check_pcd
from zoobench.designs.cloud_points import Points, check_columns, one_each, painted, placed, without_crumbs
from zoobench.designs.mesh_repair import trimesh_or_advice
from zoobench.errors import UsageError, extra
from zoobench.inputs import path_of, read

ENDINGS = (".ply", ".pcd", ".npz")
_MUSCLE = re.compile(rb"^(?:comment|#) muscle (\d{1,4}) (\S{1,80})\s*$", re.MULTILINE)
_WORDS = 200  # letters of a reader's reason
_OLD = re.compile(rb"^VERSION +0?\.[56] *\r?$", re.MULTILINE)  # of PCD files, with the same columns
_HEADER = 100_000  # [bytes] in which the names of muscles are looked for


def load_points(name: str) -> Points:
    """The points of a file.

    Raises:
        UsageError: the file cannot be read, or its columns are invalid.
    """
    path = path_of(name)
    reader = {".npz": _npz, ".pcd": _pcd, ".ply": _ply}.get(path.suffix.lower())
    if reader is None:
        raise UsageError(f"{path.name!r} ends in {path.suffix!r}. Give a point cloud as .ply, .pcd or .npz.")
    content = read(name)
    try:
        columns = reader(content)
        found = _points(columns, content)
        colours = _colours(columns)
    except UsageError:
        raise
    except Exception as error:  # readers raise errors of many types
        reason = " ".join(str(error).split())[:_WORDS]
        raise UsageError(
            f"{path.name!r} is no point cloud with the required columns: {reason}. See `zoobench show cloud`."
        ) from None
    check_columns(found, path.name)
    if found.shares is None and colours is not None:
        found = painted(found, colours, path.name)
    lengths = np.linalg.norm(found.fibres, axis=1, keepdims=True)
    found.fibres[:] = np.where(lengths > 0.0, found.fibres / np.maximum(lengths, 1e-300), (1.0, 0.0, 0.0))
    return without_crumbs(placed(found, path.name))


def _points(columns: dict[str, Any], content: bytes) -> Points:
    """The columns by their meaning, as yet unchecked."""
    for column, other in (("muscle", "fibres"), ("fibres", "muscle")):
        if column in columns and other not in columns and "shares" not in columns:
            raise ValueError(f"it has {column} but no {other}")
    positions = np.array(columns["positions"], float)
    ones = np.ones(len(positions))
    shares, names = None, tuple(str(name) for name in columns.get("names", ()))
    if "shares" in columns:
        shares = np.array(columns["shares"], float)
    elif "muscle" in columns:
        numbers = _whole(columns["muscle"])
        shares = one_each(numbers)
        written = {int(number): word.decode("ascii", "replace") for number, word in _MUSCLE.findall(content[:_HEADER])}
        names = tuple(written.get(number, f"muscle-{number + 1}") for number in range(shares.shape[1]))
    return Points(
        positions,
        shares,
        names,
        np.array(columns.get("fibres", np.tile([1.0, 0.0, 0.0], (len(positions), 1))), float),
        np.array(columns.get("stiffness", ones), float),
        np.array(columns.get("density_ratio", ones), float),
        np.array(columns.get("fill", ones), float),
    )


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
        columns = {name: file[name] for name in file.files}
    if "muscle_membership" not in columns:
        return columns
    # as `zoobench design export` writes a body
    return {
        "positions": columns["sites"],
        "shares": columns["muscle_membership"],
        "names": columns["muscles"],
        "fibres": columns["fibres"],
        "stiffness": columns["stiffness"],
        "density_ratio": columns["density_ratio"],
        "fill": columns["occupancy"] * columns["volumes"] / columns["edge"] ** 3,
    }


def _ply(content: bytes) -> dict[str, Any]:
    cloud = trimesh_or_advice().load(BytesIO(content), file_type="ply")
    vertices = cloud.metadata["_ply_raw"]["vertex"]
    columns = {name: np.ravel(vertices["data"][name]) for name in vertices["properties"]}
    if any(len(column) != vertices["length"] for column in columns.values()):
        raise ValueError(f"its header declares {vertices['length']} points, and it has fewer")
    return _with_vectors(columns)


def _pcd(content: bytes) -> dict[str, Any]:
    with extra("meshes", "PCD files need"):
        from pypcd4 import PointCloud
    check_pcd(content)
    cloud: Any = PointCloud.from_fileobj(BytesIO(_OLD.sub(b"VERSION 0.7", content, count=1)))
    rows, promised = cloud.pc_data, cloud.metadata.points
    if len(rows) != promised:  # the library accepts truncated files
        raise ValueError(f"its header declares {promised} points, but it has {len(rows)}")
    return _with_vectors({name: rows[name] for name in rows.dtype.names or ()})


def _with_vectors(columns: dict[str, Any]) -> dict[str, Any]:
    """The columns of a table with `positions` and `fibres` as vectors."""
    columns["positions"] = np.stack([columns[name] for name in ("x", "y", "z")], axis=1)
    if all(name in columns for name in ("fx", "fy", "fz")):
        columns["fibres"] = np.stack([columns[name] for name in ("fx", "fy", "fz")], axis=1)
    return columns
