"""The solids of objects, and what is refused of a user's mesh."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from zoobench import registry
from zoobench.envs.base import Environment
from zoobench.envs.object_solids import PROPORTIONS, solid_of
from zoobench.errors import UsageError
from zoobench.inputs import pin
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.spec import Ref

GRID = Fidelity(1 / 64)


def _cone() -> Any:
    """A cone 30 mm wide and 40 mm high, its tip up along z."""
    trimesh = pytest.importorskip("trimesh")
    return trimesh.creation.cone(radius=15.0, height=40.0, sections=64)


def _bowl(wall: float) -> Any:
    """A hollow ball 60 mm wide with so thick a wall [mm]."""
    trimesh = pytest.importorskip("trimesh")
    inner = trimesh.creation.icosphere(subdivisions=3, radius=30.0 - wall)
    inner.invert()
    return trimesh.util.concatenate([trimesh.creation.icosphere(subdivisions=3, radius=30.0), inner])


def _scene(**given: Any) -> Scene:
    params = ",".join(f"{name}={value}" for name, value in given.items())
    env: Environment = registry.create(Kind.ENV, Ref.parse(f"ground[{params}]"))
    return env.scene(registry.create(Kind.DESIGN, Ref("block")).body(GRID), GRID)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["stl", "glb"])
def test_an_object_of_a_mesh_stands_as_in_its_file(kind: str, tmp_path: Path) -> None:
    """With its longest side and mass as asked for, upright as the format has it, and with the mesh's volume."""
    mesh, path = _cone(), tmp_path / f"a.{kind}"
    if kind == "glb":
        mesh.apply_transform([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    mesh.export(path)
    scene = _scene(object="mesh", object_file=path, object_size=0.12, object_mass=0.05)
    body = scene.objects[0].body
    size, edge = np.ptp(body.positions, axis=0), GRID.particle_edge
    np.testing.assert_allclose(size + edge, (0.09, 0.12, 0.09), atol=1.5 * edge)
    assert body.masses.sum() == pytest.approx(0.05, rel=1e-12)
    assert body.volumes.sum() == pytest.approx(_cone().volume * (0.12 / 40.0) ** 3, rel=1e-5)
    centre = body.masses @ body.positions / body.masses.sum()
    assert centre[1] - body.positions[:, 1].min() + edge / 2 == pytest.approx(0.12 / 4, abs=0.2 * edge)


def test_a_mesh_is_part_of_the_run_by_its_content(tmp_path: Path) -> None:
    """Another file of the same name is another environment; without a mesh nothing of it is in the key."""
    path = tmp_path / "a.stl"
    _cone().export(path)
    ref = Ref.parse(f"ground[object=mesh,object_file={path}]")
    first = registry.resolve(Kind.ENV, ref)
    assert first.kwargs["object_file"] == pin(str(path))
    _bowl(20.0).export(path)
    assert registry.resolve(Kind.ENV, ref) != first
    assert "object_file" not in registry.resolve(Kind.ENV, Ref.parse("ground[object=box]")).kwargs


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"object": "mesh"}, "object=mesh with no object_file is not possible. Give object=mesh and object_file=PATH"),
        ({"object": "box", "object_file": "whole.stl"}, "object=box with an object_file is not possible"),
        ({"object_file": "whole.stl"}, "object=none with an object_file"),
        ({"object": "mesh", "object_file": "missing.stl"}, "missing.stl"),
        ({"object": "mesh", "object_file": "whole.txt"}, "whole.txt"),
        ({"object": "mesh", "object_file": "open.stl"}, "'open.stl' is open, and an object needs a closed one"),
        ({"object": "mesh", "object_file": "two.stl"}, "'two.stl' is no single object. The body is in 2 pieces"),
        ({"object": "mesh", "object_file": "shell.stl"}, "thinner than a cell of 0.01562 m"),
        (
            {"object": "mesh", "object_file": "whole.stl", "object_size": 0.03},
            "Give an object_size of 0.0417 m or more",
        ),
    ],
)
def test_impossible_meshes_are_refused(given: dict[str, str], told: str, tmp_path: Path) -> None:
    """With what was given and a remedy."""
    whole = _cone()
    two = whole.copy().apply_translation((60.0, 0.0, 0.0)) + whole
    whole.export(tmp_path / "whole.stl")
    two.export(tmp_path / "two.stl")
    _bowl(8.0).export(tmp_path / "shell.stl")
    whole.update_faces(np.arange(len(whole.faces)) > 4)
    whole.export(tmp_path / "open.stl")
    (tmp_path / "whole.txt").touch()
    files = {name: tmp_path / value if name == "object_file" else value for name, value in given.items()}
    with pytest.raises(UsageError, match=told):
        _scene(**files)


@pytest.mark.parametrize("kind", PROPORTIONS)
def test_solids_of_the_package_need_two_cells(kind: Any) -> None:
    """Neither more, as for a ball two cells across, nor less."""
    thinnest = min(PROPORTIONS[kind])
    solid_of(kind, 2.0 / 64 / thinnest, "").check(GRID)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="cells of"):
        solid_of(kind, 1.9 / 64 / thinnest, "").check(GRID)  # type: ignore[arg-type]
