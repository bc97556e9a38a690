"""Pictures of environments and bodies show what is simulated."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.render.filmed import EACH_ENV, needs_drawing, smoke_snapshot
from zoobench import registry
from zoobench.designs.base import Body
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.render.bodies import Sampled, body_at
from zoobench.render.canvas import Image, save
from zoobench.render.recording import Snapshot, snapshots
from zoobench.render.stills import SHEET, draw_snapshots, portrait_image, snapshot_image, titles
from zoobench.render.viewpoint import Region, region_of
from zoobench.spec import Ref

SMOKE = Ref("smoke")
SIZE = (480, 270)

MEDIA = {
    "desert": (0.88, 0.74, 0.48),
    "clay": (0.72, 0.45, 0.34),
    "wetland": (0.46, 0.38, 0.27),
    "shallow-water": (0.36, 0.62, 0.88),
    "ocean[water=grid]": (0.31, 0.34, 0.36),  # water that is looked through
}
GROUND, ICE = (0.62, 0.59, 0.54), (0.74, 0.88, 0.96)


@pytest.fixture(autouse=True)
def _drawing() -> None:
    needs_drawing()


def purple(image: Image) -> float:
    """Share of the pixels that have the colour of the caterpillar's back muscles."""
    red, green, blue = np.moveaxis(image.astype(float), -1, 0)
    return float(((red > 1.6 * green) & (blue > 2.0 * green)).mean())


def tinted(image: Image, colour: tuple[float, float, float]) -> float:
    """Share of the pixels that have this colour, darker or brighter."""
    ratio = image / np.maximum(image.sum(axis=-1, keepdims=True), 1.0) - np.array(colour) / sum(colour)
    return float((np.abs(ratio).max(axis=-1) < 0.01).mean())


def near(image: Image, colour: tuple[float, float, float]) -> float:
    """Share of the pixels whose hue and saturation are roughly these."""
    ratio = image / np.maximum(image.sum(axis=-1, keepdims=True), 1.0) - np.array(colour) / sum(colour)
    return float((np.abs(ratio).max(axis=-1) < 0.06).mean())


def darkened(image: Image, colour: tuple[float, float, float]) -> float:
    """Share of the pixels that have this colour in the robot's shadow."""
    return float((np.abs(image - 255 * 0.65 * np.array(colour)).max(axis=-1) < 20).mean())


def dark(image: Image) -> float:
    """Share of the pixels that are nearly black, as text and strokes."""
    return float((image.max(axis=-1) < 70).mean())


@EACH_ENV
def test_every_picture_shows_the_robot_its_medium_and_the_ground(name: str) -> None:
    """Purple back muscles, the colour of the medium, that of the ground, the legend and the title."""
    shot = smoke_snapshot(name)
    image = snapshot_image(shot, SIZE)
    assert image.shape == (270, 480, 3)
    assert (image[:40, :200].max(axis=-1) < 150).mean() > 0.01
    assert near(image[:120, 400:], (0.95, 0.93, 0.27)) > 0.0005  # a muscle of the left, which is not seen
    assert purple(image) > 0.003
    if (medium := MEDIA.get(shot.env)) is not None:
        assert tinted(image, medium) > 0.05
    assert tinted(image, ICE if shot.env == "ice" else GROUND) > 0.01


@pytest.mark.slow
def test_a_cut_medium_shows_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """Under water it would be hidden if the water before it were drawn."""
    shot = smoke_snapshot("shallow-water")
    shot = replace(shot, robot=shot.robot - np.float32([0.0, 0.02, 0.0]))
    assert purple(snapshot_image(shot, SIZE)) > 0.003

    def whole(recording: Snapshot) -> Region:
        return replace(region_of(recording), immersed=False)

    monkeypatch.setattr("zoobench.render.stills.region_of", whole)
    assert purple(snapshot_image(shot, SIZE)) < 0.001


@pytest.mark.slow
def test_the_robot_throws_a_shadow_on_ground_and_medium(monkeypatch: pytest.MonkeyPatch) -> None:
    """There are darker pixels of their colour, which go with the shadow."""
    for shot, colour in ((smoke_snapshot("ice"), ICE), (smoke_snapshot("desert"), MEDIA["desert"])):
        with_shadow = darkened(snapshot_image(shot, SIZE), colour)
        with monkeypatch.context() as patch:
            patch.setattr("zoobench.render.actors._SHADOW", 1.0)
            assert with_shadow > darkened(snapshot_image(shot, SIZE), colour) + 0.0015, shot.env


@pytest.mark.slow
def test_files_are_one_for_each_environment_and_a_sheet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the sheet's four tiles each shows the robot; it is a small file."""
    imageio = pytest.importorskip("imageio.v2")
    monkeypatch.setattr("zoobench.render.stills._SIZE", (160, 90))  # of the pictures beside the sheet, for speed
    names = ("ground", "desert", "ice", "clay")
    paths = list(draw_snapshots([smoke_snapshot(name) for name in names], tmp_path / "new"))
    assert [path.name for path in paths] == [*(f"{name}.png" for name in names), SHEET]
    assert all(imageio.imread(path).shape == (90, 160, 3) for path in paths[:-1])
    assert paths[-1].stat().st_size < 75_000
    sheet = np.asarray(imageio.imread(paths[-1], mode="RGB"))
    assert sheet.shape == (540, 960, 3)
    for number, name in enumerate(names):
        top, left = number // 2 * 270, number % 2 * 480
        assert purple(sheet[top : top + 270, left : left + 480]) > 0.003, name


@pytest.mark.slow
def test_one_picture_makes_no_sheet(tmp_path: Path) -> None:
    """A sheet of one would be that one again."""
    assert [path.name for path in draw_snapshots([smoke_snapshot("ground")], tmp_path)] == ["ground.png"]


@pytest.mark.slow
def test_parameters_are_in_title_and_file_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two variants of one environment do not overwrite each other; hills are drawn."""
    monkeypatch.setattr("zoobench.render.stills._SIZE", (160, 90))
    shots = list(snapshots([Ref.parse("ground"), Ref.parse("ground[relief=0.03]")], fidelity=SMOKE))
    names = [path.name for path in draw_snapshots(shots, tmp_path)]
    assert names == ["ground.png", "ground-relief-0.03.png", SHEET]
    assert titles(shots[1])[0] == "ground[relief=0.03] (bare ground)"
    assert "at rest" in titles(shots[0])[1]
    flat, hilly = (snapshot_image(shot, SIZE) for shot in shots)
    assert np.abs(flat.astype(int) - hilly).max() > 30


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """A file where the folder should be."""
    (tmp_path / "taken").write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match="taken"):
        list(draw_snapshots([smoke_snapshot("ground")], tmp_path / "taken"))


@pytest.mark.slow
def test_a_portrait_shows_muscles_passive_matter_and_fibres(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fish's right flank in its colours, its grey head, and strokes, which go with the fibres.

    The hindmost segment shades into the grey of the tail fin.
    """
    sampled = body_at(Ref("fish"), Ref("draft"))
    image = portrait_image(sampled, "fish")
    assert image.shape == (675, 1200, 3)
    body = image[:, :1000]  # without the legend
    for colour in ((0.54, 0.72, 0.20), (0.20, 0.72, 0.62), (0.37, 0.20, 0.72)):
        assert near(body, colour) > 0.005, colour
    assert tinted(body[300:, :660], (1.0, 1.0, 1.0)) > 0.02
    for colour in ((0.95, 0.27, 0.37), (0.27, 0.95, 0.83)):  # the left flank's, which the legend names
        assert near(image[:, 1000:], colour) > 0.0003, colour
    monkeypatch.setattr("zoobench.render.stills.put_fibres", lambda *_: None)
    plain = portrait_image(sampled, "fish")
    assert dark(image[100:]) > dark(plain[100:]) + 0.0005


@pytest.mark.parametrize(
    "change",
    [
        lambda body: replace(body, muscles=(), muscle_membership=np.zeros((body.particle_count, 0))),
        lambda body: replace(body, occupancy=(body.positions[:, 0] > 0).astype(float)),
    ],
    ids=["no muscles", "half empty"],
)
def test_unusual_bodies_have_portraits(tmp_path: Path, change: Callable[[Body], Body]) -> None:
    """A body without muscles, and one of a design space that is half empty."""
    sampled = body_at(Ref("voxel"), SMOKE)
    save(portrait_image(Sampled(change(sampled.body), sampled.grid), "a body"), tmp_path / "body.png")
    assert (tmp_path / "body.png").read_bytes().startswith(b"\x89PNG")


def test_a_body_on_a_face_centred_lattice_has_a_portrait() -> None:
    """Four particles a cell."""
    grid = registry.create(Kind.FIDELITY, Ref.parse("draft[particles_per_cell=4]"))
    body: Body = registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid)
    assert purple(portrait_image(Sampled(body, grid), "caterpillar")) > 0.02
