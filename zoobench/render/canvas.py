"""Pictures drawn off screen with PyVista, which needs no graphics card."""

import ctypes
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import UsageError, extra, reason
from zoobench.render.colours import Colour
from zoobench.render.viewpoint import Camera

Image = NDArray[np.uint8]
"""Red, green and blue, `[height, width, 3]`."""

INK = "#222222"

_BACKDROP = "#eceef1"
_LIGHT = (0.35, 0.85, 0.4)  # direction to the light: above, in front and to the right of the robot
_SMALLEST_FONT = 9  # [points]
_DISTANCE = 10.0  # [m] from the middle of the picture to the camera, whose projection is parallel
_MESA = ("libOSMesa.so.8", "libOSMesa.so")
_DRAWING = ("pyvista", "imageio.v2", "imageio_ffmpeg", "skimage.measure")


class Canvas:
    """An off-screen picture; used as a context.

    Args:
        width, height: of the picture [pixels].
        smooth: whether edges are smoothed, which takes twice the time.
        views: PyVista's options for several views in one picture.

    Attributes:
        pyvista: the library.
        plotter: its plotter, to which meshes are added.
        font_size: of text [points].

    Raises:
        UsageError: the extra `render` is not installed, or the system has no OpenGL.
    """

    def __init__(self, width: int, height: int, *, smooth: bool = False, **views: Any) -> None:
        check_drawing()
        self.pyvista: Any = import_module("pyvista")
        self.font_size = max(_SMALLEST_FONT, height // 48)
        self.plotter: Any = self.pyvista.Plotter(
            off_screen=True, window_size=(width, height), lighting="none", border=False, **views
        )
        self.plotter.set_background(_BACKDROP)
        if smooth:
            self.plotter.enable_anti_aliasing("msaa", multi_samples=4)
        else:
            self.plotter.disable_anti_aliasing()
        for renderer in self.plotter.renderers:
            renderer.add_light(self.pyvista.Light(position=_LIGHT, focal_point=(0.0, 0.0, 0.0), intensity=0.9))

    def __enter__(self) -> "Canvas":
        return self

    def __exit__(self, *_: object) -> None:
        self.plotter.close()

    @property
    def view_size(self) -> tuple[float, float]:
        """Width and height of the current view [pixels]."""
        left, bottom, right, top = self.plotter.renderer.GetViewport()
        width, height = self.plotter.window_size
        return width * (right - left), height * (top - bottom)

    def aim(self, camera: Camera) -> None:
        """Look at the world through a camera."""
        view = self.plotter.camera
        view.parallel_projection = True
        view.focal_point = tuple(camera.focus)
        view.position = tuple(camera.focus + _DISTANCE * camera.towards)
        view.up = tuple(camera.up)
        view.parallel_scale = camera.half_height
        view.clipping_range = (_DISTANCE - 5.0, _DISTANCE + 5.0)

    def line(self, points: Array, colour: str, **look: Any) -> Any:
        """A line through points `[n, 3]` [m]; the mesh."""
        line = self.pyvista.lines_from_points(points)
        self.plotter.add_mesh(line, color=colour, lighting=False, **look)
        return line

    def text(self, words: str, x: float, y: float, *, colour: str | Colour = INK, size: float = 1.0) -> Any:
        """Words whose lower left corner is at a share of the view; the actor."""
        actor = self.plotter.add_text(words, position=(x, y), viewport=True, color=colour)
        actor.prop.font_size = round(size * self.font_size)
        return actor

    def legend(self, entries: Sequence[tuple[str, str | Colour]], x: float, y: float) -> None:
        """Names, one below the other from a share of the view on, each next to a dot of its colour."""
        width, height = self.view_size
        for number, (name, colour) in enumerate(entries):
            level = y - 1.9 * number * self.font_size / height
            self.text("•", x, level - 0.6 * self.font_size / height, colour=colour, size=2.0)
            self.text(name, x + 1.5 * self.font_size / width, level)

    def image(self) -> Image:
        """The picture as it is now."""
        self.plotter.render()
        image: Image = self.plotter.screenshot(return_img=True)
        return image[..., :3]


def side_by_side(images: Sequence[Image], columns: int) -> Image:
    """Images of one size on one sheet, row by row; white where none is left."""
    missing = [np.full_like(images[0], 255)] * (-len(images) % columns)
    tiles = [*images, *missing]
    return np.vstack([np.hstack(tiles[first : first + columns]) for first in range(0, len(tiles), columns)])


def save(image: Image, path: Path, *, colours: int | None = None) -> None:
    """Write a PNG, with so many colours at most; folders on the way are made.

    Raises:
        UsageError: the file cannot be written, or it does not end in .png.
    """
    from PIL import Image as Pillow

    if path.suffix.lower() != ".png":
        raise UsageError(f"{str(path)!r} does not end in .png, the format of pictures. Give for example picture.png.")
    picture = Pillow.fromarray(image)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if colours is not None:
            # the usual median cut gives the colours of small things, as a legend's, to large ones
            picture = picture.quantize(colours, method=Pillow.Quantize.MAXCOVERAGE)
        picture.save(path, optimize=True)
    except OSError as error:
        raise UsageError(
            f"{str(path)!r} cannot be written: {reason(error)}. Give a file in a folder that you may write to."
        ) from None


def check_drawing() -> None:
    """Check that this machine can draw pictures and films.

    Raises:
        UsageError: the extra `render` is not installed, or the system has no OpenGL.
    """
    with extra("render", "Pictures need"):
        for module in _DRAWING:
            import_module(module)
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it complains of a missing screen, which is not needed
    _check_opengl()


def _check_opengl() -> None:
    """Look for OpenGL first, since VTK ends the process where it finds none."""
    if not _window_class().startswith("vtkOS"):
        return
    for name in _MESA:
        try:
            ctypes.CDLL(name)
        except OSError:
            continue
        return
    raise UsageError(
        "This system has no OpenGL to draw with. Install Mesa, on Debian and Ubuntu with `apt install libegl1 "
        "libgl1-mesa-dri`; `zoobench render --format npz` writes the frames of a film without it."
    )


def _window_class() -> str:
    """The class of VTK's window; Mesa's library for drawing without a window system is its last choice."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (registers the classes)
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    return str(vtkRenderWindow().GetClassName())
