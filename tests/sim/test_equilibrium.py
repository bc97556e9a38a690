"""Settled states: computed once, read back bit for bit."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.sim.scenes import fidelity, medium_scene, passive_block
from zoobench.sim import equilibrium as module
from zoobench.sim.equilibrium import equilibrated, state_folder
from zoobench.sim.model.elastic_bodies import SceneObject
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.state import Matter
from zoobench.sim.solver import Solver

FRAMES = 2


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "state_folder", lambda: tmp_path / "equilibrated")


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Grows by one with every state that is computed and not read."""
    calls: list[int] = []

    def counted(solver: Solver, frames: int) -> Matter:
        calls.append(frames)
        return solver.equilibrate(frames)

    monkeypatch.setattr(module, "come_to_rest", counted)
    return calls


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """As `computed`, of states that are as they began: what is a state's key does not depend on what it is."""
    calls: list[int] = []

    def counted(solver: Solver, frames: int) -> Matter:
        calls.append(frames)
        return solver.matter.copy_slot(0)

    monkeypatch.setattr(module, "come_to_rest", counted)
    return calls


def get(scene: Scene, precision: int = 64, frames: int = FRAMES) -> Matter:
    """The equilibrated state, which must be there."""
    matter = equilibrated(scene, fidelity(precision), frames)
    assert matter is not None
    return matter


def same(one: Matter, other: Matter) -> bool:
    """Bitwise."""
    pairs = zip(one.tensors(), other.tensors(), strict=True)
    return all(a.dtype == b.dtype and a.shape == b.shape and torch.equal(a, b) for a, b in pairs)


@pytest.mark.parametrize("precision", [pytest.param(32, marks=pytest.mark.slow), 64])
def test_a_state_read_is_bitwise_the_state_computed(precision: int, computed: list[int]) -> None:
    """And the second time nothing is simulated."""
    scene = medium_scene("sand")
    exact = Solver(scene, fidelity(precision)).equilibrate(FRAMES)
    first, second = get(scene, precision), get(scene, precision)
    assert same(first, exact)
    assert same(second, exact)
    assert len(computed) == 1


def test_nothing_to_settle_is_no_state(computed: list[int]) -> None:
    """A scene without equilibration frames starts as it stands."""
    assert equilibrated(medium_scene(), fidelity(), 0) is None
    assert not computed


def test_everything_that_decides_the_state_is_in_the_key(asked: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    """Another constant, position, precision, number of frames, frame length or source file: another state."""
    scene = medium_scene("sand")
    assert scene.medium is not None
    assert isinstance(scene.medium.material, SandMaterial)
    softer = replace(scene.medium, material=replace(scene.medium.material, friction_angle=30.0))
    moved = scene.medium.positions.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 1.0)
    scenes = [
        scene,
        replace(scene, medium=softer),
        replace(scene, medium=replace(scene.medium, positions=moved)),
        replace(scene, gravity=(0.0, -3.8, 0.0)),
    ]
    for variant in scenes:
        get(variant)
    get(scene, precision=32)
    get(scene, frames=FRAMES + 1)
    equilibrated(scene, fidelity(64), FRAMES, frame_seconds=0.004)
    monkeypatch.setattr(module, "_sources", lambda: b"other physics")
    get(scene)
    assert len(asked) == 8


def test_a_particle_of_an_object_is_in_the_key(asked: list[int]) -> None:
    """However many there are: another place of one is another state."""
    block = passive_block((0.6, 0.3, 0.6), (5, 5, 5), np.zeros(3))
    moved = block.positions.copy()
    moved[500, 0] = np.nextafter(moved[500, 0], 1.0)
    for body in (block, replace(block, positions=moved)):
        get(replace(medium_scene("sand"), medium=None, objects=(SceneObject("block", body),)))
    assert len(asked) == 2


def test_an_object_begins_as_fast_as_the_scene_says(asked: list[int]) -> None:
    """After it has come to rest with all else: the state is one of rest but for its velocity, and is kept without."""
    block = passive_block((0.6, 0.3, 0.6), (5, 5, 5), np.zeros(3))
    scenes = [
        replace(medium_scene("sand"), medium=None, objects=(SceneObject("block", replace(block, velocities=each)),))
        for each in (np.zeros_like(block.positions), np.full_like(block.positions, 0.5))
    ]
    still, moving = (get(scene) for scene in scenes)
    assert len(asked) == 1
    own = scenes[0].slice_of("block")
    assert (moving.v[0, 0, own] == 0.5).all()
    moving.v[:, :, own] = 0.0
    assert same(still, moving)


def test_machines_of_one_kind_may_still_differ(computed: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder that several machines share keeps a state for each model of processor and each set of instructions."""
    told = [
        "model name\t: A\nflags\t\t: sse2\n",
        "model name\t: B\nflags\t\t: sse2\n",
        "model name\t: B\nflags\t\t: sse2 fma\n",
    ]
    for text in (*told, told[0]):
        monkeypatch.setattr(Path, "read_text", lambda _, text=text, **__: text)
        module.processor.cache_clear()
        get(medium_scene("sand"))
    module.processor.cache_clear()
    assert len(computed) == 3


@pytest.mark.parametrize("damage", ["empty", "cut", "bit"])
def test_a_damaged_file_is_computed_anew(damage: str, computed: list[int], tmp_path: Path) -> None:
    """Whether it lost its content, its end or a single bit."""
    first = get(medium_scene())
    (path,) = (tmp_path / "equilibrated").iterdir()
    content = bytearray(path.read_bytes())
    if damage == "empty":
        content.clear()
    elif damage == "cut":
        del content[-100:]
    else:
        content[len(content) // 2] ^= 1
    path.write_bytes(content)
    assert same(get(medium_scene()), first)
    assert same(get(medium_scene()), first)
    assert len(computed) == 2


def test_a_folder_that_cannot_be_written_is_no_error(computed: list[int], tmp_path: Path) -> None:
    """The state is then computed every time."""
    (tmp_path / "equilibrated").write_text("a file where the folder should be", encoding="utf-8")
    assert same(get(medium_scene()), get(medium_scene()))
    assert len(computed) == 2


def test_an_interrupted_write_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No half-written file under the name that is read, nor beside it."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        get(medium_scene())
    assert not list((tmp_path / "equilibrated").iterdir())


def test_the_folder_keeps_its_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The longest unused state is removed first; the newest one stays whatever its size."""
    bed = medium_scene("sand")
    heavier, heaviest = (replace(bed, gravity=(0.0, down, 0.0)) for down in (-10.0, -11.0))
    get(bed)
    (old,) = (tmp_path / "equilibrated").iterdir()
    os.utime(old, (0, 0))
    get(heavier)
    assert len(list((tmp_path / "equilibrated").iterdir())) == 2
    monkeypatch.setattr(module, "LARGEST_FOLDER", 0)
    get(heaviest)
    assert len(list((tmp_path / "equilibrated").iterdir())) == 1
    assert not old.exists()


def test_states_lie_beside_the_kernels(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """ZOOBENCH_CACHE moves both."""
    monkeypatch.setenv("ZOOBENCH_CACHE", str(tmp_path))
    assert state_folder() == tmp_path / "equilibrated"
