"""The gait of a robot: one period of its muscles' activity, and the body in it, as a picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.render import figures
from zoobench.render.actors import put_skin
from zoobench.render.canvas import Canvas, Image
from zoobench.render.colours import ground_colour
from zoobench.render.film import Film, evenly
from zoobench.render.skin import Skin, skin
from zoobench.render.viewpoint import Camera, camera_at
from zoobench.spec import FRAME_SECONDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BODIES = 8
"""Bodies in a picture of a gait."""

_TILE = (300, 225)  # of a body [pixels]
_VIEW = (14.0, 72.0)  # elevation and azimuth, see `camera_at` [degrees]
_ALIKE = 0.8  # correlation of an activity with itself a period later
_FLOOR = 0.005  # [m] below the lowest particle, within which a ground is drawn
_REACH = 0.7  # of the ground before and behind the body, by the body's length
_LOOK = {"cmap": "coolwarm", "clim": (-1.0, 1.0), "show_scalar_bar": False}


def period_of(activity: Array) -> int | None:
    """The period of an activity `[frames, muscle_count]` in control frames; None if it does not repeat itself.

    The shortest lag at which the correlation of the activity with itself has a peak that is nearly the highest, and
    that covers at most two thirds of the frames.
    """
    varied = activity - activity.mean(axis=0)
    lags = range(1, 2 * len(activity) // 3 + 1)
    found = [_correlation(varied[:-lag], varied[lag:]) for lag in lags]
    peaks = [
        (lag, here)
        for lag, before, here, after in zip(lags[1:], found, found[1:], [*found[2:], -1.0], strict=False)
        if here > before and here >= after and here >= _ALIKE
    ]
    highest = max((height for _, height in peaks), default=0.0)
    return next((lag for lag, height in peaks if height >= highest - 0.05), None)


def draw_gait(film: Film, path: Path, *, title: str) -> None:
    """Draw the last period of an episode: the body at moments of it, and below them the activity of every muscle.

    Where the activity does not repeat itself, the whole episode.

    Args:
        film: with all moments of the episode.
        title: above the picture.

    Raises:
        UsageError: the extras `render` and `plots` are not installed, or the file cannot be written.
    """
    frames = len(film.kept) - 1
    period = period_of(film.activity[1:])
    first = frames - (period or frames)
    shown = [first + moment for moment in evenly(frames - first, BODIES)]
    images = body_images(film, shown)
    count = len(images)
    figure = figures.blank((1.55 * count, 3.4))
    grid = figure.add_gridspec(2, count, height_ratios=[1.0, 0.9])
    for place, (moment, image) in enumerate(zip(shown, images, strict=True)):
        axes = figure.add_subplot(grid[0, place])
        axes.imshow(image)
        axes.set_axis_off()
        ahead = 1e3 * (film.centre[film.kept[moment]] - film.centre[film.kept[first]])[0]
        passed = 1e3 * (film.times[moment] - film.times[first])
        axes.set_title(f"{passed:.0f} ms\n{ahead:+.1f} mm ahead", fontsize=8)
    _put_activity(figure.add_subplot(grid[1, :]), film, first, shown)
    what = f"a period of {1e3 * period * FRAME_SECONDS:.0f} ms" if period else "the whole episode, without a period"
    base = "; red moves the base ahead, up and right, blue back" if film.body.base_channels else ""
    figure.suptitle(f"{title}\n{what}; red contracts, blue extends{base}", fontsize=9)
    figures.save(figure, path)


def body_images(film: Film, moments: Sequence[int]) -> list[Image]:
    """The body at these moments, from its right flank and a little above, each about its own centre of mass."""
    cover = skin(film.body)
    flat = np.array([1.0, 0.0, 1.0])
    places = {moment: film.robot[moment] - flat * film.centre[film.kept[moment]] for moment in moments}
    points = np.vstack([place[film.solid] for place in places.values()])
    camera = camera_at(points, *_VIEW, _TILE[0] / _TILE[1], room=(0.9, 0.8), shift=(0.0, 0.0))
    return [_body_image(film, cover, places[moment], moment, camera, points) for moment in moments]


def _body_image(film: Film, cover: Skin, place: Array, moment: int, camera: Camera, points: Array) -> Image:
    with Canvas(*_TILE, smooth=True) as canvas:
        lowest = points[:, 1].min() - film.particle_edge / 2
        if film.scene.ground is not None and film.scene.ground.terrain is None and lowest < _FLOOR:
            across = 10 * camera.half_height * camera.right
            away = np.cross(camera.right, [0.0, 1.0, 0.0]) * _REACH * np.ptp(points[:, [0, 2]], axis=0).max()
            corners = np.array([-across - away, across - away, across + away, -across + away])
            corners[:, 1] = min(lowest, 0.0)
            pane = canvas.pyvista.PolyData(corners, [4, 0, 1, 2, 3])
            canvas.plotter.add_mesh(pane, color=ground_colour(film.scene), lighting=False)
        put_skin(canvas, cover, place, film.activation[moment], **_LOOK)
        canvas.aim(camera)
        return canvas.image()


def _put_activity(axes: "Axes", film: Film, first: int, shown: Sequence[int]) -> None:
    """A row for each muscle, a column for each control frame, and a line at each body that is drawn above.

    Channels that move a base are below a line.
    """
    rows = film.activity[first + 1 :].T
    end = 1e3 * FRAME_SECONDS * rows.shape[1]
    names = film.body.muscles
    axes.imshow(
        rows, cmap="coolwarm", vmin=-1.0, vmax=1.0, aspect="auto", interpolation="nearest",
        extent=(0.0, end, len(names) - 0.5, -0.5),
    )  # fmt: skip
    for moment in shown:
        axes.axvline(1e3 * FRAME_SECONDS * (moment - first), color="black", linewidth=0.6, linestyle=":")
    if film.body.base_channels:
        axes.axhline(len(names) - film.body.base_channels - 0.5, color="black", linewidth=0.6)
    axes.set_yticks(range(len(names)), names, fontsize=7)
    axes.tick_params(axis="x", labelsize=7)
    axes.set_xlabel("ms", fontsize=8)


def _correlation(one: Array, other: Array) -> float:
    size = float(np.sqrt((one**2).sum() * (other**2).sum()))
    return float((one * other).sum()) / size if size > 0.0 else 0.0
