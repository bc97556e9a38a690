"""Films in files hold what was filmed."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.render.filmed import SPEC, needs_drawing, short_film
from zoobench.errors import UsageError
from zoobench.render.film_files import check_tools, moments_of, write
from zoobench.render.formats import Destination, FilmFormat
from zoobench.spec import RunSpec


def written(folder: Path, form: FilmFormat, **options: int) -> Path:
    """The short film in a file of this format; nothing else is left beside it."""
    path = folder / f"film{form.suffix}"
    told: list[int] = []
    write(short_film(), Destination(path, form), title="a title", progress=told.append, **options)
    assert told[-1] == 3
    assert not list(folder.glob(".*"))
    return path


def test_arrays_come_back(tmp_path: Path) -> None:
    """Without any extra."""
    film = short_film()
    with np.load(written(tmp_path, FilmFormat.NPZ), allow_pickle=False) as found:
        for name in ("times", "robot", "medium", "activity", "activation", "centre", "target"):
            np.testing.assert_array_equal(found[name], getattr(film, name))
        assert RunSpec.from_dict(json.loads(str(found["spec"]))) == SPEC
        assert float(found["score"]) == film.evaluation.score
        assert tuple(found["muscles"]) == film.body.muscles


def test_a_series_of_files_comes_back(tmp_path: Path) -> None:
    """The index names a file for each moment, in which the robot's particles come first."""
    pyvista = pytest.importorskip("pyvista")
    film = short_film()
    index = pyvista.get_reader(written(tmp_path, FilmFormat.VTK))
    np.testing.assert_allclose(index.time_values, film.times, atol=1e-6)
    for moment in range(3):
        index.set_active_time_point(moment)
        (cloud,) = index.read()
        assert int(cloud["is_robot"].sum()) == film.robot.shape[1]
        np.testing.assert_allclose(cloud.points[: film.robot.shape[1]], film.robot[moment])
        np.testing.assert_allclose(cloud["activation"][: film.robot.shape[1]], film.activation[moment])


def _colours(picture: "np.ndarray[tuple[int, ...], np.dtype[np.uint8]]") -> dict[str, float]:
    """How much of a picture is sand, and how much has the red or the blue of active muscles."""
    red, green, blue = np.moveaxis(picture[..., :3].astype(float), -1, 0)
    sand = (red > 1.1 * green) & (green > 1.2 * blue) & (red < 1.6 * green) & (red > 90)
    active = (blue > 1.4 * red) | (red > 1.8 * green)
    return {"sand": float(sand.mean()), "active": float(active.mean())}


@pytest.mark.parametrize("form", [pytest.param(FilmFormat.MP4, marks=pytest.mark.slow), FilmFormat.GIF])
def test_moving_pictures_show_the_robot_in_its_medium(tmp_path: Path, form: FilmFormat) -> None:
    """A picture for each moment, of the width asked for, that differs from the one before."""
    needs_drawing()
    imageio = pytest.importorskip("imageio.v2")
    with imageio.get_reader(written(tmp_path, form, width=320)) as reader:
        pictures = [np.asarray(picture) for picture in reader]
    assert [picture.shape[:2] for picture in pictures] == [(180, 320)] * 3
    assert _colours(pictures[1])["sand"] > 0.1
    assert np.abs(pictures[0][..., :3].astype(int) - pictures[2][..., :3]).max() > 50


def test_a_sheet_shows_all_moments_and_the_robot_in_colour(tmp_path: Path) -> None:
    """Two side by side; the robot at rest is grey, and coloured once its muscles are active."""
    needs_drawing()
    imageio = pytest.importorskip("imageio.v2")
    sheet = imageio.imread(written(tmp_path, FilmFormat.PNG, width=640))
    assert sheet.shape == (2 * 180, 640, 3)
    start, later = sheet[:180, :320], sheet[:180, 320:]
    assert _colours(start)["sand"] > 0.1
    middle = (slice(30, None), slice(0, 270))  # without the colour bar
    assert _colours(later[middle])["active"] > _colours(start[middle])["active"] + 0.01
    assert (sheet[180:, 320:] == 255).all()
    bar = start[45:135, 295:308].astype(int)  # red contracts, above; blue extends, below
    assert (bar[:30, :, 0] - bar[:30, :, 2]).max() > 100
    assert (bar[-30:, :, 2] - bar[-30:, :, 0]).max() > 100
    assert (bar[:30, :, 2] - bar[:30, :, 0]).max() < 30


def test_what_is_kept_depends_on_the_format() -> None:
    """A few moments for a sheet; else each so many, and never one alone."""
    assert moments_of(FilmFormat.PNG, 200, 7) == [0, 40, 80, 120, 160, 200]
    assert moments_of(FilmFormat.MP4, 6, 2) == [0, 2, 4, 6]
    assert moments_of(FilmFormat.NPZ, 6, 100) == [0, 6]


@pytest.mark.parametrize(
    ("missing", "form"), [("pyvista", "mp4"), ("imageio.v2", "gif"), ("skimage.measure", "png"), ("pyvista", "vtk")]
)
def test_a_missing_extra_says_what_to_install(monkeypatch: pytest.MonkeyPatch, missing: str, form: str) -> None:
    """Before anything is simulated; the arrays need none."""
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(UsageError, match=r"pip install 'zoobench\[render\]'"):
        check_tools(FilmFormat(form))
    check_tools(FilmFormat.NPZ)


def test_a_system_without_opengl_writes_data_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are refused, since VTK would end the process."""
    for module in ("pyvista", "imageio_ffmpeg", "skimage"):
        pytest.importorskip(module)
    monkeypatch.setattr("zoobench.render.canvas._window_class", lambda: "vtkOSOpenGLRenderWindow")
    monkeypatch.setattr("zoobench.render.canvas._MESA", ("no-such-library.so",))
    with pytest.raises(UsageError, match="no OpenGL"):
        check_tools(FilmFormat.PNG)
    check_tools(FilmFormat.VTK)


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """A folder of that name."""
    path = tmp_path / "film.npz"
    (path / "full").mkdir(parents=True)
    with pytest.raises(UsageError, match=r"film\.npz"):
        write(short_film(), Destination(path, FilmFormat.NPZ), title="")
    assert not list(tmp_path.glob(".*"))


def test_no_medium_and_no_target_are_no_trouble(tmp_path: Path) -> None:
    """Bare ground, and a task that only wants speed."""
    needs_drawing()
    film = short_film()
    bare = replace(film, medium=film.medium[:, :0], target=None, scene=replace(film.scene, medium=None))
    path = tmp_path / "bare.png"
    write(bare, Destination(path, FilmFormat.PNG), title="bare", width=320)
    assert path.read_bytes().startswith(b"\x89PNG")
