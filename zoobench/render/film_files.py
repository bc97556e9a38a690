"""Files of films: moving pictures, a sheet of pictures, or the frames as data for other tools."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError, extra, reason
from zoobench.render.actors import PATH, TARGET, Update, put_ground, put_medium, put_objects, put_paths, put_robot
from zoobench.render.canvas import INK, Canvas, Image, check_drawing, side_by_side
from zoobench.render.film import Film, evenly
from zoobench.render.formats import Destination, FilmFormat
from zoobench.render.viewpoint import Region, camera_for, region_of
from zoobench.render.vortices import STRONG, put_water

Progress = Callable[[int], None]
"""Called with the number of moments done so far."""

WIDTH = {FilmFormat.MP4: 1280, FilmFormat.GIF: 640, FilmFormat.PNG: 1600}
"""Default width of a picture [pixels]."""

_COLUMNS, _TILES = 2, 6  # of a sheet
_SMALL = (480, 270)  # a picture on a sheet for a page [pixels]
_QUALITY, _CLIP_QUALITY = 7, 6  # of 10, for moving pictures and those of a page
CLIP_RATE = 25.0
"""Moments of a film for a page that are shown in a second [1/s]."""
_POSTER_QUALITY = 45  # of 100, of the picture that is shown until a film is played


def moments_of(form: FilmFormat, frames: int, every: int) -> list[int]:
    """The moments to keep, in control frames from the start: each `every`-th, or a few for a sheet."""
    if form is FilmFormat.PNG:
        return sheet_moments(frames)
    return list(range(0, frames + 1, every)) if every <= frames else [0, frames]


def check_tools(form: FilmFormat) -> None:
    """Check before the simulation that this machine can write a format.

    Raises:
        UsageError: the extra `render` is not installed, or the system has no OpenGL.
    """
    if form.is_picture:
        check_drawing()
    elif form is FilmFormat.VTK:
        with extra("render", "Files of VTK need"):
            import_module("pyvista")


def write(
    film: Film,
    target: Destination,
    *,
    title: str,
    width: int | None = None,
    rate: float = 25.0,
    progress: Progress = lambda _: None,
) -> None:
    """Write a film in a format; a file that cannot be finished is removed, but for the parts of a `vtk` series.

    * `mp4`, `gif`: moving pictures, one for every moment.
    * `png`: all moments on one sheet, row by row.
    * `npz`: the arrays of `Film` by name, its spec as JSON, names and labels of the body.
    * `vtk`: an index (.pvd, which ParaView opens) of a file for every moment, in a folder of the same name next to it:
      all particles with `activation`, `is_robot` and `body`, which is 0 for the robot, and objects before the medium.

    Args:
        title: at the top of every picture.
        width: of the picture [pixels]; that of `WIDTH` if None. The height follows.
        rate: moments shown per second [1/s].
        progress: called with the number of moments written so far.

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
        raise UsageError(f"{str(target.path)!r} cannot be written: {reason(error)}. Give another --out.") from None


def _write_pictures(
    film: Film, target: Destination, title: str, width: int, rate: float, progress: Progress, is_clip: bool = False
) -> None:
    imageio: Any = import_module("imageio.v2")  # its types lack the writer's

    is_sheet = target.form is FilmFormat.PNG
    across = width / _COLUMNS if is_sheet else width
    size = _even(across), _even(across * 9 / 16)
    images = film_images(film, title, size, smooth=is_sheet, progress=progress)
    with _unfinished(target.path) as path:
        if is_sheet:
            imageio.imwrite(path, side_by_side(list(images), _COLUMNS))
            return
        options: dict[str, Any] = {"duration": 1000.0 / rate, "loop": 0}
        if target.form is FilmFormat.MP4:
            quality = _CLIP_QUALITY if is_clip else _QUALITY
            options = {"fps": rate, "quality": quality, "macro_block_size": 2, "ffmpeg_log_level": "error"}
            # the fastest encoders make files a little larger, and drawing need not wait for them
            options["output_params"] = ["-preset", "slow" if is_clip else "veryfast"]
        with imageio.get_writer(path, mode="I", **options) as writer:
            for image in images:
                writer.append_data(image)


def film_images(
    film: Film, title: str, size: tuple[int, int], *, smooth: bool = False, progress: Progress = lambda _: None
) -> Iterator[Image]:
    """The images of all moments; the robot's skin shows the activation of its muscles.

    Args:
        title: at the top of every image.
        size: width and height of an image [pixels].
        smooth: whether edges are smoothed, which takes twice the time.
        progress: called with the number of moments drawn so far.
    """
    region = region_of(film)
    camera = camera_for(region, size[0] / size[1])
    with Canvas(*size, smooth=smooth) as canvas:
        put_ground(canvas, region, camera.towards)
        updates = [
            put_medium(canvas, region, size[1] / 2 / camera.half_height),
            put_water(canvas, film),
            put_active_robot(canvas, region, film.activation),
            put_objects(canvas, region),
            put_paths(canvas, film, film.kept, camera.towards),
        ]
        canvas.text(title, 0.02, 0.94, size=1.15)
        clock = canvas.text("", 0.02, 0.885, size=1.15)
        _explain(canvas, film)
        canvas.aim(camera)
        for moment, time in enumerate(film.times):
            for update in updates:
                update(moment)
            clock.input = f"{time:.3f} s of {film.times[-1]:.3f} s"
            progress(moment + 1)
            yield canvas.image()


def _explain(canvas: Canvas, film: Film) -> None:
    """Write the meaning of lines and colours; the longest below, as the ruler's numbers come down from the left."""
    notes = []
    if film.vorticity is not None:
        notes.append((f"water: white turns left and dark right, at {STRONG:g}/s or more", INK))
    if film.target is not None:
        notes.append(("target and its path", TARGET))
    notes.append(("centre of mass and its path", PATH))
    for number, (words, colour) in enumerate(notes):
        canvas.text(words, 0.02, 0.02 + 0.04 * number, colour=colour)


def put_active_robot(canvas: Canvas, region: Region, activation: Array) -> Update:
    """The robot in the colours of its activation `[moments, robot_count]`, and the colour bar."""
    for words, y in (("activation", 0.82), ("contracts", 0.77), ("extends", 0.2)):
        canvas.text(words, 0.89, y)
    bar = {
        "title": "", "vertical": True, "position_x": 0.93, "position_y": 0.25, "width": 0.03, "height": 0.5,
        "n_labels": 5, "fmt": "%+.1f", "color": INK,
        "title_font_size": canvas.font_size, "label_font_size": canvas.font_size,
    }  # fmt: skip
    return put_robot(canvas, region, activation, cmap="coolwarm", clim=(-1.0, 1.0), scalar_bar_args=bar)


def sheet_moments(frames: int) -> list[int]:
    """The moments of a sheet, in control frames from the start."""
    return evenly(frames, _TILES)


def sheet(film: Film) -> bytes:
    """All moments side by side without a title, as a small JPEG for a page."""
    imageio: Any = import_module("imageio.v3")
    images = list(film_images(film, "", _SMALL, smooth=True))
    data: bytes = imageio.imwrite("<bytes>", side_by_side(images, _COLUMNS), extension=".jpg", quality=82)
    return data


def clip(film: Film) -> tuple[bytes, bytes]:
    """All moments as a small film without a title for a page (MP4), and the one in the middle (JPEG)."""
    imageio: Any = import_module("imageio.v3")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        _write_pictures(film, Destination(path, FilmFormat.MP4), "", _SMALL[0], CLIP_RATE, lambda _: None, is_clip=True)
        middle = imageio.imread(path, index=len(film.times) // 2)
        return path.read_bytes(), imageio.imwrite("<bytes>", middle, extension=".jpg", quality=_POSTER_QUALITY)


def _write_arrays(film: Film, path: Path) -> None:
    body = film.body
    arrays: dict[str, Any] = {name: value for name, value in vars(film).items() if isinstance(value, np.ndarray)}
    arrays |= {name.replace("-", "_"): places for name, places in film.objects.items()}
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


def _write_series(film: Film, path: Path, progress: Progress) -> None:
    import pyvista

    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    exists = film.solid
    others = [*film.objects.values(), film.medium]
    sizes = [int(exists.sum()), *(places.shape[1] for places in others)]
    bodies = np.repeat(np.arange(len(sizes)), sizes).astype(np.uint8)
    is_robot = (bodies == 0).astype(np.uint8)
    passive = np.zeros(sum(sizes[1:]))
    entries = []
    for moment in range(len(film.times)):
        cloud = pyvista.PolyData(np.vstack([film.robot[moment, exists], *(places[moment] for places in others)]))
        cloud["is_robot"], cloud["body"] = is_robot, bodies
        cloud["activation"] = np.hstack([film.activation[moment, exists], passive])
        name = f"{moment:05d}.vtp"
        cloud.save(folder / name)
        entries.append(f'<DataSet timestep="{film.times[moment]:.6f}" part="0" file="{folder.name}/{name}"/>')
        progress(moment + 1)
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "<Collection>", *entries]
    path.write_text("\n".join([*lines, "</Collection>", "</VTKFile>", ""]), encoding="utf-8")


@contextmanager
def _unfinished(path: Path) -> Iterator[Path]:
    """A temporary name in the folder of `path`: the file is renamed when it is complete, and removed after an error."""
    unfinished = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _even(length: float) -> int:
    """A whole even number: moving pictures need even numbers of pixels."""
    return max(2, 2 * round(length / 2))
