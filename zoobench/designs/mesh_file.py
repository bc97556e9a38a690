"""Meshes in files: faults of a file are reported before a library interprets it in its own way."""

import re
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

from zoobench.designs.mesh_repair import repaired, trimesh_or_advice
from zoobench.designs.solid_mesh import Mesh
from zoobench.errors import UsageError
from zoobench.inputs import path_of, read

FORMATS = ("stl", "obj", "ply", "glb")
_HEADER, _TRIANGLE = 84, 50  # [bytes] of a binary STL file
_NOT_FINITE = re.compile(rb"^\s*v\s[^\n]*(nan|inf)", re.MULTILINE | re.IGNORECASE)
_NEGATIVE = re.compile(rb"^\s*f\s[^\n]*-\d", re.MULTILINE)


@dataclass(frozen=True)
class FileMesh:
    """The closed surface of a file.

    Attributes:
        mesh: in the file's unit.
        notes: the repairs, as sentences.
    """

    mesh: Mesh
    notes: tuple[str, ...]


def load(name: str) -> FileMesh:
    """The mesh in a file, closed and with normals outwards.

    Raises:
        UsageError: the file cannot be read, or its mesh is empty or beyond repair.
    """
    trimesh, path = trimesh_or_advice(), path_of(name)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise UsageError(f"{path.name!r} ends in {path.suffix!r}. Give a mesh as one of {', '.join(FORMATS)}.")
    content = read(name)
    if fault := _fault_of_stl(content) if kind == "stl" else "":
        raise UsageError(f"{path.name!r} is no whole STL file: {fault}. Export it again.")
    if kind == "obj" and _NOT_FINITE.search(content):  # trimesh leaves out the faces of such corners
        raise UsageError(f"{path.name!r} has corners that are not finite. Export it again.")
    if kind == "obj" and _NEGATIVE.search(content):
        content = _counted_from_the_first(content, path)
    try:
        mesh = trimesh.load(BytesIO(content), file_type=kind, force="mesh", process=True)
        faces = len(getattr(mesh, "faces", ()))
    except Exception as error:  # readers raise errors of many types
        raise UsageError(f"{path.name!r} is no {kind} file that can be read: {error}. Export it again.") from None
    if not faces:
        raise UsageError(f"{path.name!r} holds no triangles. Export a mesh of the surface.")
    if not np.isfinite(mesh.vertices[mesh.faces]).all():
        raise UsageError(f"{path.name!r} has corners that are not finite. Export it again.")
    return FileMesh(*repaired(mesh, path.name))


def _fault_of_stl(content: bytes) -> str:
    """The fault of an STL file that is too short or too long, in words; empty if there is none."""
    if content.lstrip()[:5].lower() == b"solid" and re.search(rb"\b(facet|endsolid)\b", content[:4096], re.IGNORECASE):
        begun, ended = (len(re.findall(rb"(?im)^\s*" + word, content)) for word in (rb"facet\b", rb"endfacet\b"))
        if begun != ended:
            return f"it ends within a triangle, its number {begun}"
        solids, ends = (len(re.findall(rb"(?im)^\s*" + word, content)) for word in (rb"solid\b", rb"endsolid\b"))
        return (
            "" if ends >= solids else f"its last line is no endsolid, and it may lack more than its {ended} triangles"
        )
    if len(content) < _HEADER:
        return f"it has {len(content)} bytes, and its header alone takes {_HEADER}"
    promised = int.from_bytes(content[_HEADER - 4 : _HEADER], "little")
    size = _HEADER + _TRIANGLE * promised
    if size == len(content):
        return ""
    count = (len(content) - _HEADER) / _TRIANGLE
    return (
        f"its header promises {promised:,} triangles in {size:,} bytes, and it has {len(content):,}, for {count:,.4g}"
    )


def _counted_from_the_first(content: bytes, path: Path) -> bytes:
    """An OBJ file whose faces name their corners by numbers from the first on; they may count back from the last.

    Only lines that define the surface are kept. trimesh counts back from the end of the file, not from the line.

    Raises:
        UsageError: a face names a corner that is not there.
    """
    lines, count = [], 0
    for number, line in enumerate(content.splitlines(), 1):
        words = line.split()
        if words[:1] == [b"v"]:
            count += 1
            lines.append(line)
        elif words[:1] == [b"f"]:
            try:
                corners = [int(word.partition(b"/")[0]) for word in words[1:]]
            except ValueError:
                corners = [0]
            corners = [corner if corner > 0 else count + 1 + corner for corner in corners]
            if not all(0 < corner <= count for corner in corners):
                raise UsageError(f"Line {number} of {path.name!r} names a corner that is not there. Export it again.")
            lines.append(b"f " + b" ".join(b"%d" % corner for corner in corners))
    return b"\n".join([*lines, b""])
