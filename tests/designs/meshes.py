"""Meshes of the tests' own making, in millimetres, x ahead and z up."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from zoobench.designs.mesh import MeshDesign
from zoobench.inputs import InputFile

_SIDES = 24
# x, half height and half width [mm]: the tail's lobe, a thin stalk, the trunk
TRUNK = [(-50, 14, 0.6), (-42, 10, 0.6), (-38, 1.0, 0.6), (-21, 1.0, 0.6), (-19, 6, 4), (-8, 14, 9), (10, 18, 12),
          (30, 16, 11), (42, 10, 8), (50, 3, 2)]  # fmt: skip


def fish(*, fins: str = "", open_ends: bool = False, trunk: Sequence[tuple[float, float, float]] = TRUNK) -> Any:
    """A fish 100 mm long whose tail, 29 % of its length, hangs on a stalk 2 mm high and 1.2 mm wide.

    Args:
        fins: "flat" for a back fin 1 mm thick that overlaps the trunk, "sheet" for one of a single layer of triangles.
        open_ends: without the faces that close its nose and its tail.
        trunk: x, half height and half width of its cross-sections [mm].
    """
    trimesh = pytest.importorskip("trimesh")
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    rings = [[(x, wide * np.cos(a), high * np.sin(a)) for a in angles] for x, high, wide in trunk]
    corners = [*np.concatenate(rings), (trunk[0][0], 0.0, 0.0), (trunk[-1][0], 0.0, 0.0)]
    faces = []
    last = len(trunk) - 1
    for ring in range(last):
        for side in range(_SIDES):
            a, b = ring * _SIDES + side, ring * _SIDES + (side + 1) % _SIDES
            faces += [(a, b + _SIDES, b), (a, a + _SIDES, b + _SIDES)]
    for side in range(0 if open_ends else _SIDES):
        following = (side + 1) % _SIDES
        faces.append((len(corners) - 2, side, following))
        faces.append((len(corners) - 1, last * _SIDES + following, last * _SIDES + side))
    body = trimesh.Trimesh(corners, faces)
    body.fix_normals()
    if fins == "flat":
        fin = trimesh.creation.box(extents=(20.0, 1.0, 20.0))
        return trimesh.util.concatenate([body, fin.apply_translation((5.0, 0.0, 20.0))])
    if fins == "sheet":
        fin = trimesh.Trimesh([(-5, 0, 12), (15, 0, 12), (15, 0, 30), (-5, 0, 30)], [(0, 1, 2), (0, 2, 3)])
        return trimesh.util.concatenate([body, fin])
    return body


def design(mesh: Any, path: Path, **params: Any) -> MeshDesign:
    """The design from a file of the mesh."""
    mesh.export(path)
    return MeshDesign(path=InputFile(path), **params)
