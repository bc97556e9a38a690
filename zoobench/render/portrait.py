"""A portrait of a body: its muscles in colour and their fibres as strokes, from three sides."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench.arrays import Array
from zoobench.render import figures
from zoobench.render.bodies import DENSITY, Sampled
from zoobench.render.colours import PASSIVE, brightness, camera_axes, palette, tints

if TYPE_CHECKING:
    from zoobench.designs.base import Body

_VIEWS = (("", 24.0, 62.0), ("from the right", 0.0, 90.0), ("from above", 90.0, 90.0))
"""Caption, elevation and azimuth of the camera [degrees]: 0 looks at the face, 90 at the right flank."""

_BALL = 1.3  # a ball's diameter by the particles' spacing: no gaps on a surface
_STROKE = 2.5  # a stroke's length by the particles' spacing
_EVERY = 4  # surface particles to a stroke
_BACKDROP = "#eceef1"


def portrait(sampled: Sampled, title: str, path: Path) -> None:
    """Draw a body into a PNG.

    Raises:
        UsageError: matplotlib is missing, or the file cannot be written.
    """
    body, edge = sampled.body, sampled.grid.particle_edge
    figure = figures.blank((11, 6.2), constrained=False, colour=_BACKDROP)
    rooms = ((0.01, 0.02, 0.53, 0.86), (0.55, 0.46, 0.27, 0.42), (0.55, 0.02, 0.27, 0.42))
    for (caption, elevation, azimuth), room in zip(_VIEWS, rooms, strict=True):
        axes = figure.add_axes(room)
        _draw(axes, body, edge, camera_axes(elevation, azimuth))
        axes.set_title(caption, fontsize=8)
    _legend(figure, body)
    size, mass = np.ptp(body.positions, axis=0) + edge, body.masses(DENSITY).sum()
    figure.suptitle(
        f"{title}: {' x '.join(f'{1e3 * length:.0f}' for length in size)} mm, {1e3 * mass:.0f} g, "
        f"{body.particle_count:,} particles at 1/{1 / sampled.grid.grid_spacing:.0f} m",
        fontsize=11,
    )
    figures.save(figure, path)


def _draw(axes: Any, body: "Body", edge: float, camera: Array) -> None:
    """All particles as balls, the nearest last, and strokes on those that are seen."""
    from matplotlib.collections import LineCollection

    colours = tints(body.muscle_membership, body.muscles) * brightness(body.positions, 2.2 * edge)
    place = body.positions @ camera.T
    low, high = place[:, :2].min(axis=0) - edge, place[:, :2].max(axis=0) + edge
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.apply_aspect()
    points_per_metre = 72.0 / axes.figure.dpi * axes.get_window_extent().width / (high[0] - low[0])
    order = np.argsort(place[:, 2])
    axes.scatter(
        *place[order, :2].T, c=np.clip(colours[order], 0.0, 1.0), s=(_BALL * edge * points_per_metre) ** 2, linewidths=0
    )
    marked = np.flatnonzero(_seen(place, edge) & (body.muscle_membership.sum(axis=1) > 0.5))[::_EVERY]
    half = _STROKE / 2 * edge * (body.fibres[marked] @ camera.T)[:, :2]
    strokes = np.stack([place[marked, :2] - half, place[marked, :2] + half], axis=1)
    axes.add_collection(LineCollection(list(strokes), colors="0.1", linewidths=0.9))


def _seen(place: Array, edge: float) -> Any:
    """Whether no other particle hides it: none is nearer to the camera on its line of sight `[n]`."""
    from scipy.spatial import KDTree

    pairs = KDTree(place[:, :2]).query_pairs(0.7 * edge, output_type="ndarray")
    gap = place[pairs[:, 0], 2] - place[pairs[:, 1], 2]
    hidden = np.zeros(len(place), bool)
    hidden[pairs[gap < -0.5 * edge, 0]] = True
    hidden[pairs[gap > 0.5 * edge, 1]] = True
    return ~hidden


def _legend(figure: Any, body: "Body") -> None:
    from matplotlib.lines import Line2D

    entries = [*zip(body.muscles, palette(body.muscles), strict=True), ("no muscle", (PASSIVE,) * 3)]
    handles = [Line2D([], [], marker="o", linestyle="", color=colour, label=name) for name, colour in entries]
    handles.append(Line2D([], [], color="0.1", linewidth=0.9, label="fibres"))
    figure.legend(handles=handles, loc="center right", frameon=False, fontsize=8)
