"""Export of bodies for other tools: particles with their properties, or the surface around them."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.solid_mesh import Mesh
from zoobench.errors import UsageError, extra, reason

_NAME = re.compile(r"(?!end_header$)[!-~]{1,80}")  # of a muscle, in the header of a file
_EXISTS = 0.5  # least occupancy of an exported particle
_SOFTNESS = 0.7  # [particle edges] of the filter that smooths the steps of the lattice


def export(body: Body, path: Path) -> None:
    """Write a body in the format given by the suffix of the path, in metres, x ahead and y up.

    * `npz`: the arrays of `Body` by name.
    * `ply`: the cubes of the existing particles as vertices x, y, z (their centres), muscle (-1 for none), fx, fy, fz,
      stiffness, density_ratio, fill (the share of a cube that is solid; above 1 where slivers have joined it).
    * `pcd`: the same columns as fields of the Point Cloud Library's format 0.7, in binary.
    * `stl`: the closed surface around them, which encloses the body's volume.

    Raises:
        UsageError: another suffix, a file that cannot be written, no scikit-image for `stl`, or a muscle whose name
            the header of `ply` or `pcd` cannot hold.
    """
    writer = {".npz": _npz, ".pcd": _pcd, ".ply": _ply, ".stl": _stl}.get(path.suffix.lower())
    if writer is None:
        raise UsageError(f"{str(path)!r} ends in {path.suffix!r}. Give a file that ends in .npz, .pcd, .ply or .stl.")
    try:
        writer(body, path)
    except OSError as error:
        raise UsageError(f"{str(path)!r} cannot be written: {reason(error)}. Give another file.") from None


def _npz(body: Body, path: Path) -> None:
    arrays: dict[str, Any] = {name: value for name, value in vars(body).items() if isinstance(value, np.ndarray)}
    with path.open("wb") as file:
        np.savez_compressed(file, muscles=np.array(body.muscles), edge=body.edge, **arrays)


def _ply(body: Body, path: Path) -> None:
    rows = _rows(body)
    names = _muscle_lines(body, "comment")
    columns = "".join(f"property {'int' if name == 'muscle' else 'float'} {name}\n" for name in COLUMNS)
    header = f"ply\nformat binary_little_endian 1.0\n{names}element vertex {len(rows)}\n{columns}end_header\n"
    path.write_bytes(header.encode("ascii") + rows.tobytes())


def _pcd(body: Body, path: Path) -> None:
    rows = _rows(body)
    names = _muscle_lines(body, "#")
    fields = {
        "VERSION": ["0.7"],
        "FIELDS": COLUMNS,
        "SIZE": ["4"] * len(COLUMNS),
        "TYPE": ["I" if name == "muscle" else "F" for name in COLUMNS],
        "COUNT": ["1"] * len(COLUMNS),
        "WIDTH": [str(len(rows))],
        "HEIGHT": ["1"],
        "VIEWPOINT": "0001000",
        "POINTS": [str(len(rows))],
        "DATA": ["binary"],
    }
    header = names + "".join(f"{name} {' '.join(words)}\n" for name, words in fields.items())
    path.write_bytes(header.encode("ascii") + rows.tobytes())


def _muscle_lines(body: Body, comment: str) -> str:
    """A line of the header for each muscle, as `zoobench.designs.cloud_file` reads it.

    Raises:
        UsageError: a name is empty, longer than 80 characters, not of ASCII without spaces, or ends a PLY header.
    """
    for name in body.muscles:
        if not _NAME.fullmatch(name):
            raise UsageError(
                f"The header of a PLY or PCD file cannot hold a muscle of the name {name!r}: it takes 1 to 80 "
                "characters of ASCII without spaces, and not 'end_header'. Give a file that ends in .npz."
            )
    return "".join(f"{comment} muscle {number} {name}\n" for number, name in enumerate(body.muscles))


COLUMNS = ("x", "y", "z", "muscle", "fx", "fy", "fz", "stiffness", "density_ratio", "fill")
"""Columns of a PLY or PCD file."""


def _rows(body: Body) -> "np.ndarray[tuple[int, ...], np.dtype[np.void]]":
    """The existing particles, one row of `COLUMNS` each."""
    own = body.occupancy > _EXISTS
    shares = body.muscle_membership[own]
    active = shares.sum(axis=1) > 0.5
    rows = np.zeros(int(own.sum()), dtype=[(name, "<i4" if name == "muscle" else "<f4") for name in COLUMNS])
    for number, name in enumerate("xyz"):
        rows[name] = body.sites[own, number]
        rows[f"f{name}"] = body.fibres[own, number]
    rows["muscle"] = np.where(active, shares.argmax(axis=1), -1) if shares.shape[1] else -1
    rows["stiffness"], rows["density_ratio"] = body.stiffness[own], body.density_ratio[own]
    rows["fill"] = (body.occupancy * body.volumes)[own] / body.edge**3
    return rows


def _stl(body: Body, path: Path) -> None:
    vertices, faces = surface(body)
    triangles = vertices[faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    rows = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
    rows["normal"], rows["corners"] = normals, triangles
    header = b"zoobench body, in metres, x ahead, y up".ljust(80)
    path.write_bytes(header + np.uint32(len(faces)).tobytes() + rows.tobytes())


def surface(body: Body) -> tuple[Array, "np.ndarray[tuple[int, ...], np.dtype[np.int64]]"]:
    """A closed surface around the existing particles: vertices `[n, 3]` [m] and faces `[m, 3]`, normals outwards.

    Marching cubes (Lorensen and Cline 1987) on the filtered lattice of particles, at the level that encloses the body's
    volume.

    Raises:
        UsageError: scikit-image is not installed.
    """
    with extra("meshes", "Surfaces need"):
        from skimage import measure
    from scipy.ndimage import gaussian_filter

    marching_cubes: Any = measure.marching_cubes  # has no types
    own = body.occupancy > _EXISTS
    sites, edge = body.sites[own], _spacing(body)
    lower = sites.min(axis=0) - 4 * edge
    cells = np.round((sites - lower) / edge).astype(int)
    filled = np.zeros(cells.max(axis=0) + 5)
    filled[tuple(cells.T)] = body.volumes[own] / body.edge**3
    field = gaussian_filter(filled, _SOFTNESS)
    target = float((body.occupancy * body.volumes)[own].sum())
    # nothing of a small body is as full as the middle of a large one
    high = min(0.95, 0.99 * float(field.max()))
    low = 0.05 if high > 0.05 else 0.0
    for _ in range(12):
        level = (low + high) / 2
        vertices, faces, *_ = marching_cubes(field, level, spacing=(edge,) * 3, gradient_direction="descent")
        volume = Mesh(vertices.astype(np.float64), faces).signed_volume()
        low, high = (level, high) if abs(volume) > target else (low, level)
    found: Array = vertices.astype(np.float64) + lower
    turned = faces if volume > 0.0 else faces[:, ::-1]
    return found, turned.astype(np.int64)


def _spacing(body: Body) -> float:
    """Edge of the cubic lattice that holds the sites of a body [m]; on the face-centred lattice, half of them."""
    steps = np.concatenate([np.diff(np.unique(axis)) for axis in body.sites.T])
    return float(steps[steps > 0.1 * body.edge].min(initial=body.edge))
