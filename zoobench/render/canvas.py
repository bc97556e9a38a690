"""Films as pictures, drawn off screen and without a graphics card."""

import ctypes
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from zoobench.errors import UsageError
from zoobench.render.actors import INK, TARGET, WAY, put_ground, put_medium, put_robot, put_ways
from zoobench.render.colours import LIGHT
from zoobench.render.viewpoint import Camera, camera_for, stage_of

if TYPE_CHECKING:
    from zoobench.render.film import Film

Image = NDArray[np.uint8]

_BACKDROP = "#eceef1"
_LEAST_LETTERS = 9  # [points]
_MESA = ("libOSMesa.so.8", "libOSMesa.so")
_FAR = 10.0  # [m] from the middle of the picture to the camera, which sees in parallel


class FilmPainter:
    """Draws the moments of a film; used as a context.

    Args:
        film: what is drawn.
        title: at the top of every picture.
        width, height: of a picture [pixels].
        smooth: whether edges are smoothed, which takes twice the time.

    Raises:
        UsageError: the extra `render` is not installed, or the system has no OpenGL.
    """

    def __init__(self, film: "Film", title: str, *, width: int, height: int, smooth: bool = False) -> None:
        pyvista = pyvista_or_advice()
        stage = stage_of(film)
        camera = camera_for(stage, width / height)
        letters = max(_LEAST_LETTERS, height // 48)
        self._film = film
        self._plotter = pyvista.Plotter(off_screen=True, window_size=(width, height), lighting="none")
        plotter = self._plotter
        plotter.set_background(_BACKDROP)
        plotter.add_light(pyvista.Light(position=tuple(LIGHT), focal_point=(0.0, 0.0, 0.0), intensity=0.9))
        if smooth:
            plotter.enable_anti_aliasing("msaa", multi_samples=4)
        else:
            plotter.disable_anti_aliasing()
        put_ground(pyvista, plotter, stage, letters)
        self._updates = [
            put_medium(pyvista, plotter, stage, height / 2 / camera.half_height),
            put_robot(pyvista, plotter, stage, film.lattice, letters),
            put_ways(pyvista, plotter, stage, camera.towards),
        ]
        self._write(title, letters)
        self._aim(camera)

    def picture(self, moment: int) -> Image:
        """The picture of one moment, counted in those of the film, `[height, width, 3]`."""
        for update in self._updates:
            update(moment)
        self._clock.input = f"{self._film.times[moment]:.3f} s of {self._film.times[-1]:.3f} s"
        self._plotter.render()
        image: Image = self._plotter.screenshot(return_img=True)
        return image[..., :3]

    def pictures(self) -> Iterator[Image]:
        """Of all moments."""
        return map(self.picture, range(len(self._film.times)))

    def __enter__(self) -> "FilmPainter":
        return self

    def __exit__(self, *_: object) -> None:
        self._plotter.close()

    def _write(self, title: str, letters: int) -> None:
        plotter = self._plotter

        def text(words: str, x: float, y: float, colour: str = INK, size: float = 1.0) -> Any:
            actor = plotter.add_text(words, position=(x, y), viewport=True, color=colour)
            actor.prop.font_size = round(size * letters)
            return actor

        for words, y in (("activation", 0.82), ("contracts", 0.77), ("extends", 0.2)):
            text(words, 0.89, y)
        text(title, 0.02, 0.94, size=1.15)
        self._clock = text("", 0.02, 0.885, size=1.15)
        text("centre of mass and its way", 0.02, 0.06, WAY)
        if self._film.target is not None:
            text("target and its path", 0.02, 0.02, TARGET)

    def _aim(self, camera: Camera) -> None:
        view = self._plotter.camera
        view.parallel_projection = True
        view.focal_point = tuple(camera.focus)
        view.position = tuple(camera.focus + _FAR * camera.towards)
        view.up = tuple(camera.up)
        view.parallel_scale = camera.half_height
        view.clipping_range = (_FAR - 5.0, _FAR + 5.0)


_ADVICE = "Films need pyvista and imageio, and not both are installed. Try: pip install 'zoobench[render]'."


def pyvista_or_advice(*, opengl: bool = True) -> Any:
    """The drawing library, quiet, where it can draw if `opengl` is asked for.

    Raises:
        UsageError: it is not installed, or there is no OpenGL.
    """
    try:
        import pyvista
        from vtkmodules.vtkCommonCore import vtkLogger
    except ImportError:
        raise UsageError(_ADVICE) from None
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it complains of a missing screen, which is not needed
    if opengl:
        _check_opengl()
    return pyvista


def imageio_or_advice() -> Any:
    """What writes pictures, with what compresses moving ones.

    Raises:
        UsageError: it is not installed.
    """
    try:
        import imageio.v2 as imageio
        import imageio_ffmpeg  # noqa: F401  (imageio finds it by itself)
    except ImportError:
        raise UsageError(_ADVICE) from None
    return imageio


def _check_opengl() -> None:
    """VTK ends the process where it finds no OpenGL; so look first."""
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
        "libgl1-mesa-dri`, or write the frames with --format npz."
    )


def _window_class() -> str:
    """What VTK would draw into; Mesa's library for drawing without any system is its last choice."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (registers what there is)
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    return str(vtkRenderWindow().GetClassName())
