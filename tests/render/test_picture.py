"""Pictures show what is simulated."""

import sys
from pathlib import Path

import numpy as np
import pytest

from zoobench.errors import UsageError
from zoobench.render.colours import covered, outward, palette
from zoobench.render.picture import SHEET, Snapshot, pictures, snapshots
from zoobench.spec import Ref

ENVS = ("ground", "ice", "desert", "clay", "wetland", "snow", "shallow-water", "ocean")
SMOKE = Ref("smoke")


@pytest.fixture(scope="module")
def shots() -> list[Snapshot]:
    """All environments at rest, coarsely."""
    return list(snapshots([Ref(name) for name in ENVS], fidelity=SMOKE))


def pixels(path: Path) -> "np.ndarray[tuple[int, ...], np.dtype[np.float64]]":
    """Red, green and blue of a picture, `[height, width, 3]` in [0, 1]."""
    from matplotlib.image import imread

    return np.asarray(imread(path), dtype=np.float64)[..., :3]


def test_the_robot_neither_hovers_nor_overlaps(shots: list[Snapshot]) -> None:
    """At rest, it touches what it stands or swims on, to a particle's edge, and no medium is inside it."""
    from scipy.spatial import KDTree

    for shot in shots:
        if len(shot.medium):
            gap, _ = KDTree(shot.medium).query(shot.robot)
            assert 0.5 * shot.particle_edge < gap.min() < 1.5 * shot.particle_edge, shot.env
        else:
            assert 0.0 < shot.robot[:, 1].min() < shot.particle_edge, shot.env


def test_every_picture_shows_the_robot_and_its_medium(shots: list[Snapshot], tmp_path: Path) -> None:
    """One file each, in which purple back muscles are seen, and the colour of the medium is."""
    paths = list(pictures(shots, tmp_path / "new"))
    assert [path.name for path in paths] == [*(f"{name}.png" for name in ENVS), SHEET]
    tints = {"desert": (0.88, 0.74, 0.48), "clay": (0.72, 0.45, 0.34), "ocean": (0.36, 0.62, 0.88)}
    for path in paths[:-1]:
        image = pixels(path)
        red, green, blue = np.moveaxis(image, -1, 0)
        assert ((red > 1.6 * green) & (blue > 2.0 * green)).mean() > 0.003, path.name
        if (tint := tints.get(path.stem)) is not None:
            ratio = image / np.maximum(image.sum(axis=-1, keepdims=True), 1e-9) - np.array(tint) / sum(tint)
            assert (np.abs(ratio).max(axis=-1) < 0.02).mean() > 0.05, path.name
    assert paths[-1].stat().st_size < 150_000


def test_one_picture_makes_no_sheet(shots: list[Snapshot], tmp_path: Path) -> None:
    """A contact sheet of one would be that one again."""
    assert [path.name for path in pictures(shots[:1], tmp_path)] == ["ground.png"]


def test_parameters_are_in_title_and_file_name(tmp_path: Path) -> None:
    """Two variants of one environment do not overwrite each other."""
    envs = [Ref.parse("ground"), Ref.parse("ground[relief=0.03]")]
    names = [path.name for path in pictures(list(snapshots(envs, fidelity=SMOKE)), tmp_path)]
    assert names == ["ground.png", "ground-relief-0.03.png", SHEET]


STRONG = Ref("sine-basis", params=(("scale", 1.0),))


def test_an_episode_moves_what_is_drawn() -> None:
    """Thirty frames of the controller leave robot and sand elsewhere; the same seed leaves them in the same place."""
    at_rest, moved, again = (
        next(iter(snapshots([Ref("desert")], controller=STRONG, fidelity=SMOKE, frames=frames)))
        for frames in (0, 30, 30)
    )
    assert np.abs(moved.robot - at_rest.robot).max() > 1e-3
    assert np.abs(moved.medium - at_rest.medium).max() > 1e-4
    assert (moved.robot == again.robot).all()
    assert moved.seconds == pytest.approx(0.24)


def test_missing_matplotlib_says_what_to_install(
    shots: list[Snapshot], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pictures are an extra."""
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(UsageError, match=r"pip install 'zoobench\[plots\]'"):
        list(pictures(shots[:1], tmp_path))


def test_a_folder_that_cannot_be_written_is_named(shots: list[Snapshot], tmp_path: Path) -> None:
    """A file where the folder should be."""
    (tmp_path / "taken").write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="taken"):
        list(pictures(shots[:1], tmp_path / "taken"))


def test_normals_point_out_of_a_ball() -> None:
    """On its surface they are the radii, to the lattice's roughness."""
    axis = np.linspace(-1.0, 1.0, 15)
    lattice = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    ball = lattice[np.linalg.norm(lattice, axis=1) <= 1.0]
    surface = np.linalg.norm(ball, axis=1) > 0.9
    cosine = (outward(ball, 0.3)[surface] * ball[surface]).sum(axis=1) / np.linalg.norm(ball[surface], axis=1)
    assert cosine.min() > 0.9


def test_a_single_layer_is_lit_from_above() -> None:
    """Its neighbours lie on both sides, so that their mean does not say which way is out."""
    axis = np.linspace(0.0, 1.0, 11)
    x, z = np.meshgrid(axis, axis)
    layer = np.stack([x.ravel(), np.zeros(121), z.ravel()], axis=1)
    layer += np.random.default_rng(0).normal(0.0, 0.002, layer.shape)
    inner = ((layer[:, [0, 2]] > 0.15) & (layer[:, [0, 2]] < 0.85)).all(axis=1)
    assert outward(layer, 0.18, upward=0.18)[inner, 1].min() > 0.9


def test_the_shadow_falls_straight_down() -> None:
    """Under the robot, not beside it."""
    ground = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.05], [0.2, 0.0, 0.0]])
    assert covered(ground, np.array([[0.0, 0.3, 0.0]]), 0.01).tolist() == [True, False, False]


def test_muscles_have_colours_of_their_own() -> None:
    """Left and right of one group share a hue, no two muscles a colour."""
    names = ("ventral-1-left", "ventral-1-right", "dorsal-left", "dorsal-right", "tail")
    colours = np.array(palette(names))
    gaps = np.abs(colours[:, None] - colours[None]).max(axis=2) + np.eye(len(names))
    assert gaps.min() > 0.1
