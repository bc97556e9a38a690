"""What drawing needs, and images in files."""

import sys
from pathlib import Path

import numpy as np
import pytest

from zoobench.errors import UsageError
from zoobench.render.canvas import check_drawing, save, side_by_side


@pytest.mark.parametrize("missing", ["pyvista", "imageio.v2", "skimage.measure"])
def test_a_missing_extra_says_what_to_install(monkeypatch: pytest.MonkeyPatch, missing: str) -> None:
    """The message names the library and the extra."""
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(UsageError, match=rf"{missing.partition('.')[0]}.*pip install 'zoobench\[render\]'"):
        check_drawing()


def test_a_system_without_opengl_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """VTK would end the process."""
    for module in ("pyvista", "imageio_ffmpeg", "skimage"):
        pytest.importorskip(module)
    monkeypatch.setattr("zoobench.render.canvas._window_class", lambda: "vtkOSOpenGLRenderWindow")
    monkeypatch.setattr("zoobench.render.canvas._MESA", ("no-such-library.so",))
    with pytest.raises(UsageError, match="no OpenGL"):
        check_drawing()


def test_images_stand_side_by_side() -> None:
    """Row by row; white where none is left."""
    images = [np.full((2, 3, 3), value, np.uint8) for value in (1, 2, 3)]
    sheet = side_by_side(images, columns=2)
    assert sheet.shape == (4, 6, 3)
    assert sheet[::2, ::3, 0].tolist() == [[1, 2], [3, 255]]


def test_only_png_files_are_written(tmp_path: Path) -> None:
    """Another ending, or none, is refused; folders are made."""
    imageio = pytest.importorskip("imageio.v2")
    image = np.full((2, 3, 3), 7, np.uint8)
    for name in ("one", "one.jpg", ".png"):
        with pytest.raises(UsageError, match=r"does not end in \.png"):
            save(image, tmp_path / name)
    assert not list(tmp_path.iterdir())
    save(image, tmp_path / "new" / "one.png")
    np.testing.assert_array_equal(imageio.imread(tmp_path / "new" / "one.png"), image)


def test_few_colours_keep_those_of_small_things(tmp_path: Path) -> None:
    """Beside large bodies of all shades the dots of a legend stay what they are, and are told apart."""
    from PIL import Image

    dots = [(247, 67, 100), (247, 167, 67), (67, 247, 147), (128, 67, 247), (247, 67, 230), (168, 168, 168)]
    shade = np.linspace(0, 1, 300)[:, None] * np.linspace(0.3, 1, 400)[None, :]
    picture = (shade[..., None] * np.array([90.0, 150.0, 240.0])).astype(np.uint8)
    for place, dot in enumerate(dots):
        picture[10:16, 20 * place : 20 * place + 6] = dot
    save(picture, tmp_path / "sheet.png", colours=64)
    kept = np.asarray(Image.open(tmp_path / "sheet.png").convert("RGB")).astype(int)
    for place, dot in enumerate(dots):
        assert np.abs(kept[12, 20 * place + 2] - dot).max() <= 12
