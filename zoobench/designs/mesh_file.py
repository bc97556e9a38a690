"""Meshes in files: faults of a file are reported before a library interprets it in its own way."""

import re
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from zoobench.designs.mesh_repair import repaired, trimesh_or_advice
from zoobench.designs.solid_mesh import Mesh, shape_of
from zoobench.designs.thin_parts import pieces_note
from zoobench.errors import UsageError
from zoobench.inputs import InputFile, path_of, read

FORMATS = ("stl", "obj", "ply", "glb")
_HEADER, _TRIANGLE = 84, 50  # [bytes] of a binary STL file
_NOT_FINITE = re.compile(rb"^\s*v\s[^\n]*(nan|inf)", re.MULTILINE | re.IGNORECASE)
_NEGATIVE = re.compile(rb"^\s*f\s[^\n]*-\d", re.MULTILINE)


class MeshPath(InputFile):
    """Annotation of a parameter that names a mesh."""

    __slots__ = ()
    endings: ClassVar[tuple[str, ...]] = tuple(f".{kind}" for kind in FORMATS)


@dataclass(frozen=True)
class FileMesh:
    """The closed surface of a file.

    Attributes:
        mesh: in the file's unit.
        notes: the repairs, as sentences.
        was_closed: whether it was closed in the file.
    """

    mesh: Mesh
    notes: tuple[str, ...]
    was_closed: bool


def upward(name: str) -> Literal["y", "z"]:
    """The axis that is up in a file of this name by its format: y in GLB, whose format says so, else z, as in CAD."""
    return "y" if path_of(name).suffix.lower() == ".glb" else "z"


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


def closed_mesh(name: str) -> Mesh:
    """The mesh in a file, if it is one closed piece.

    Raises:
        UsageError: as of `load`; its surface is open, or in several pieces.
    """
    found, file = load(name), path_of(name).name
    if not found.was_closed:
        raise UsageError(
            f"The surface in {file!r} is open, and an object needs a closed one. Close its holes in a modeller, then "
            "export it again."
        )
    if pieces := pieces_note(shape_of(found.mesh), found.mesh.volume()):
        raise UsageError(f"{file!r} is no single object. {pieces[0]} Join them in a modeller, then export it again.")
    return found.mesh


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
