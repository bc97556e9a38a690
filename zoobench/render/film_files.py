"""Films in files: moving pictures, a sheet of pictures, or the frames as data for other tools."""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench.errors import UsageError
from zoobench.render.canvas import FilmPainter, Image, imageio_or_advice, pyvista_or_advice
from zoobench.render.film import evenly
from zoobench.render.formats import Destination, FilmFormat

if TYPE_CHECKING:
    from zoobench.render.film import Film

Progress = Callable[[int], None]
"""Called with the number of moments written so far."""

WIDTH = {FilmFormat.MP4: 1280, FilmFormat.GIF: 640, FilmFormat.PNG: 1600}
"""Of a picture where none is asked for [pixels]."""

_COLUMNS, _TILES = 2, 6  # of a sheet
_QUALITY = 7  # of 10, for moving pictures


def moments_of(form: FilmFormat, frames: int, every: int) -> list[int]:
    """What of an episode to keep, in control frames from the start: each `every`-th, or a few for a sheet."""
    if form is FilmFormat.PNG:
        return evenly(frames, _TILES)
    return list(range(0, frames + 1, every)) if every <= frames else [0, frames]


def check_tools(form: FilmFormat) -> None:
    """Find out before the simulation whether this format can be written here.

    Raises:
        UsageError: the extra `render` is not installed, or the system has no OpenGL.
    """
    if form.is_picture:
        imageio_or_advice()
    if form is not FilmFormat.NPZ:
        pyvista_or_advice(opengl=form.is_picture)


def write(
    film: "Film",
    target: Destination,
    *,
    title: str,
    width: int | None = None,
    rate: float = 25.0,
    progress: Progress = lambda _: None,
) -> None:
    """Write a film as its format asks; a file that cannot be finished is not there.

    * `mp4`, `gif`: moving pictures, one for every moment.
    * `png`: all moments on one sheet, row by row.
    * `npz`: the arrays of `Film` by name, its spec as JSON, names and labels of the body.
    * `vtk`: an index (.pvd, which ParaView opens) of a file for every moment, in a folder beside it that is named as it
      is: all particles with `activation` and `is_robot`.

    Args:
        title: over every picture.
        width: of the picture [pixels]; the format's own if None. The height follows.
        rate: moments shown per second [1/s].
        progress: is told how far it is.

    Raises:
        UsageError: as `check_tools`, or the file cannot be written.
    """
    try:
        if target.form is FilmFormat.NPZ:
            _write_arrays(film, target.path)
            progress(len(film.times))
        elif target.form is FilmFormat.VTK:
            _write_series(film, target.path, progress)
        else:
            _write_pictures(film, target, title, width or WIDTH[target.form], rate, progress)
    except OSError as error:
        raise UsageError(
            f"{str(target.path)!r} cannot be written: {error.strerror or error}. Give another --out."
        ) from None


def _write_pictures(film: "Film", target: Destination, title: str, width: int, rate: float, progress: Progress) -> None:
    imageio = imageio_or_advice()
    columns = _COLUMNS if target.form is FilmFormat.PNG else 1
    across, down = _even(width / columns), _even(width / columns * 9 / 16)
    smooth = target.form is FilmFormat.PNG
    painter = FilmPainter(film, title, width=across, height=down, smooth=smooth)
    with painter, _unfinished(target.path) as path:
        pictures = _counted(painter.pictures(), progress)
        if target.form is FilmFormat.PNG:
            imageio.imwrite(path, _sheet(list(pictures), columns))
            return
        options: dict[str, Any] = {"duration": 1000.0 / rate, "loop": 0}
        if target.form is FilmFormat.MP4:
            options = {"fps": rate, "quality": _QUALITY, "macro_block_size": 2, "ffmpeg_log_level": "error"}
            options["output_params"] = ["-preset", "veryfast"]  # a little larger, and drawing need not wait for it
        with imageio.get_writer(path, mode="I", **options) as writer:
            for picture in pictures:
                writer.append_data(picture)


def _sheet(pictures: list[Image], columns: int) -> Image:
    """Pictures of one size side by side, row by row; white where none is left."""
    rows = -(-len(pictures) // columns)
    height, width = pictures[0].shape[:2]
    sheet = np.full((rows * height, columns * width, 3), 255, np.uint8)
    for number, picture in enumerate(pictures):
        top, left = number // columns * height, number % columns * width
        sheet[top : top + height, left : left + width] = picture
    return sheet


def _write_arrays(film: "Film", path: Path) -> None:
    body = film.body
    arrays: dict[str, Any] = {name: value for name, value in vars(film).items() if isinstance(value, np.ndarray)}
    with _unfinished(path) as unfinished, unfinished.open("wb") as file:
        np.savez_compressed(
            file,
            spec=np.array(json.dumps(film.spec.to_dict())),
            score=film.evaluation.score,
            particle_edge=film.particle_edge,
            activation=film.activation,
            muscles=np.array(body.muscles),
            muscle_membership=body.muscle_membership,
            occupancy=body.occupancy,
            head=body.head,
            tail=body.tail,
            **arrays,
        )


def _write_series(film: "Film", path: Path, progress: Progress) -> None:
    pyvista = pyvista_or_advice(opengl=False)
    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    exists = film.solid
    is_robot = np.repeat([1, 0], [int(exists.sum()), film.medium.shape[1]]).astype(np.uint8)
    passive = np.zeros(film.medium.shape[1])
    entries = []
    for moment in range(len(film.times)):
        cloud = pyvista.PolyData(np.vstack([film.robot[moment, exists], film.medium[moment]]))
        cloud["is_robot"] = is_robot
        cloud["activation"] = np.hstack([film.activation[moment, exists], passive])
        name = f"{moment:05d}.vtp"
        cloud.save(folder / name)
        entries.append(f'<DataSet timestep="{film.times[moment]:.6f}" part="0" file="{folder.name}/{name}"/>')
        progress(moment + 1)
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "<Collection>", *entries]
    path.write_text("\n".join([*lines, "</Collection>", "</VTKFile>", ""]), encoding="utf-8")


@contextmanager
def _unfinished(path: Path) -> Iterator[Path]:
    """A name to write under; the file gets its own when it is whole, and goes when it never will be."""
    unfinished = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _counted(pictures: Iterable[Image], progress: Progress) -> Iterator[Image]:
    for number, picture in enumerate(pictures, start=1):
        progress(number)
        yield picture


def _even(length: float) -> int:
    """Moving pictures want even numbers of pixels."""
    return max(2, 2 * round(length / 2))
