"""How a world is drawn: particles as shaded balls in a three-dimensional view, the robot's muscles by colour."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench.arrays import Array
from zoobench.render import figures
from zoobench.render.colours import (
    AMBIENT,
    LIGHT,
    Colour,
    brightness,
    covered,
    ground_colour,
    medium_colour,
    palette,
    tints,
)

if TYPE_CHECKING:
    from zoobench.render.picture import Snapshot

_BACKDROP = "#eceef1"

_PATCH = (0.3125, 0.1875)
"""Length and width of the ground that is drawn where nothing bounds it [m]: those of the default beds."""

_ELEVATION, _AZIMUTH = 24.0, -62.0  # of the camera [degrees]
_RIM = 0.88  # brightness of a ball's outline
_SHEET_COLOURS = 224
_MESH = 60  # points across a drawn height field
_BALL = 1.35  # a ball's diameter by the particles' spacing: no gaps between neighbours on a surface


def draw_one(shot: "Snapshot", path: Path) -> None:
    """One picture with axes and the muscles' names."""
    figure = figures.blank((10, 6), constrained=False, colour=_BACKDROP)
    axes = figure.add_axes((0.0, 0.0, 0.8, 0.94), projection="3d", computed_zorder=False)
    _draw(axes, shot)
    handles = [_dot(colour, name) for name, colour in zip(shot.muscles, palette(shot.muscles), strict=True)]
    figure.legend(handles=handles, loc="center right", title="muscles", frameon=False, fontsize=8)
    figure.suptitle(title(shot), y=0.97)
    figures.save(figure, path)


def draw_sheet(shots: Sequence["Snapshot"], path: Path, columns: int = 2) -> None:
    """All pictures on one small sheet."""
    rows = -(-len(shots) // columns)
    figure = figures.blank((4.4 * columns, 2.7 * rows), dpi=90, constrained=False, colour=_BACKDROP)
    for number, shot in enumerate(shots):
        left, top = number % columns / columns, 1.0 - number // columns / rows
        box = (left + 0.01, top - 0.93 / rows, 0.98 / columns, 0.9 / rows)
        axes = figure.add_axes(box, projection="3d", computed_zorder=False)
        _draw(axes, shot, small=True)
        figure.text(
            left + 0.5 / columns, top - 0.07 / rows, title(shot, small=True), ha="center", va="center", fontsize=9
        )
    figures.save(figure, path)
    _shrink(path)


def title(shot: "Snapshot", *, small: bool = False) -> str:
    """Environment, fidelity, particles and moment in words."""
    count = f"{len(shot.robot) + len(shot.medium):,} particles"
    medium = shot.scene.medium
    below = "bare ground" if medium is None else medium.material.law.name.lower()
    if small:
        name, bracket, params = shot.env.partition("[")
        return f"{name} ({below}), {shot.fidelity}, {count}" + (f"\n{bracket}{params}" if params else "")
    moment = "at rest, before the first frame" if not shot.seconds else f"after {shot.seconds:.3g} s"
    return f"{shot.env} ({below})\nfidelity {shot.fidelity}, {count}, {moment}"


def _draw(axes: Any, shot: "Snapshot", *, small: bool = False) -> None:
    low, high = _box(shot)
    _frame(axes, low, high, small)
    _ground(axes, shot, low, high)
    points, colours = _particles(shot)
    seen = ((points >= low - shot.particle_edge) & (points <= high + shot.particle_edge)).all(axis=1)
    axes.scatter(
        points[seen, 0], points[seen, 2], points[seen, 1], c=colours[seen], s=_area(axes, _BALL * shot.particle_edge),
        edgecolors=_RIM * colours[seen], depthshade=False, linewidths=0.3, zorder=3,
    )  # fmt: skip
    if _is_immersed(shot):
        _tank(axes, shot, low, high)
    for artist in axes.get_children():
        artist.set_clip_on(False)  # the view is a square within the axes' rectangle


def _is_immersed(shot: "Snapshot") -> bool:
    """Whether the medium hides the robot, so that it has to be cut open."""
    return bool(len(shot.medium)) and shot.medium[:, 1].max() > shot.robot[:, 1].max()


def _box(shot: "Snapshot") -> tuple[Array, Array]:
    """Corners of what is drawn [m]: the bed, or a patch of the ground around the robot."""
    lower, upper = np.array(shot.scene.lower), np.array(shot.scene.upper)
    if not len(shot.medium):
        middle = (shot.robot.min(axis=0) + shot.robot.max(axis=0)) / 2
        half = np.maximum(np.array([_PATCH[0], 0.0, _PATCH[1]]), np.ptp(shot.robot, axis=0) * 1.1) / 2
        lower, upper = np.maximum(lower, middle - half), np.minimum(upper, middle + half)
    tallest = max(shot.robot[:, 1].max(), shot.medium[:, 1].max(initial=0.0))
    lower[1], upper[1] = shot.scene.lower[1], tallest + 0.02
    return lower, upper


def _frame(axes: Any, low: Array, high: Array, small: bool) -> None:
    """Axes in metres of equal scale; depth runs against the drawing library's handedness."""
    from matplotlib.ticker import MultipleLocator

    axes.set_proj_type("ortho")
    axes.patch.set_visible(False)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(high[2], low[2])
    axes.set_zlim(low[1], high[1])
    axes.set_box_aspect((high - low)[[0, 2, 1]], zoom=_zoom(high - low, (1.65, 0.98) if small else (1.2, 0.8)))
    axes.view_init(_ELEVATION, _AZIMUTH)
    axes.grid(False)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.0, 0.0, 0.0, 0.0))
        axis.set_major_locator(MultipleLocator(0.05))
    if small:
        axes.tick_params(labelsize=5, pad=-3)
        for axis in (axes.yaxis, axes.zaxis):
            axis.set_ticklabels([])
        return
    axes.tick_params(labelsize=7)
    axes.set_xlabel("x, ahead [m]", fontsize=8, labelpad=12)
    axes.set_ylabel("z, right [m]", fontsize=8, labelpad=6)
    axes.set_zlabel("y, up [m]", fontsize=8)


def _zoom(size: Array, room: tuple[float, float]) -> float:
    """What makes a box of this size `[3]` [m] fill the width or the height of its share `room` of the view."""
    sine, cosine = abs(np.sin(np.radians(_AZIMUTH))), abs(np.cos(np.radians(_AZIMUTH)))
    rise, run = np.sin(np.radians(_ELEVATION)), np.cos(np.radians(_ELEVATION))
    wide = size[0] * sine + size[2] * cosine
    tall = size[1] * run + (size[0] * cosine + size[2] * sine) * rise
    return float(np.linalg.norm(size) * min(room[0] / wide, room[1] / tall))


def _ground(axes: Any, shot: "Snapshot", low: Array, high: Array) -> None:
    """The ground, a grid of 5 cm on it and, if it is bare, the robot's shadow."""
    ground = shot.scene.ground
    if ground is None:
        return
    colour = ground_colour(shot.scene)
    if ground.terrain is None:
        _sheet(axes, low, high, 0.0, colour, 1.0, 0)
    else:
        x, z = (np.linspace(low[d], high[d], _MESH) for d in (0, 2))
        heights = ground.terrain.heights_at(x, z)
        lit = (
            np.array(colour)
            * (AMBIENT + (1.0 - AMBIENT) * np.maximum(ground.terrain.normals_at(x, z) @ LIGHT, 0.0))[..., None]
        )
        x, z = np.meshgrid(x, z, indexing="ij")
        axes.plot_surface(
            x, z, heights, facecolors=lit, shade=False, rcount=_MESH, ccount=_MESH, antialiased=False, zorder=0
        )
    for x in _marks(low[0], high[0]):
        _line(axes, shot, np.array([x]), np.linspace(low[2], high[2], _MESH))
    for z in _marks(low[2], high[2]):
        _line(axes, shot, np.linspace(low[0], high[0], _MESH), np.array([z]))
    if not len(shot.medium):
        size, dark = _area(axes, 1.6 * shot.particle_edge), tuple(0.6 * np.array(colour))
        foot = _level(shot, shot.robot[:, 0], shot.robot[:, 2])
        axes.scatter(
            shot.robot[:, 0], shot.robot[:, 2], foot, color=dark, s=size, depthshade=False, linewidths=0, zorder=2
        )


def _level(shot: "Snapshot", x: Array, z: Array) -> Array:
    """Height of the ground at points `[n]` [m]."""
    ground = shot.scene.ground
    if ground is None or ground.terrain is None:
        return np.zeros(len(x))
    return ground.terrain.heights_below(np.stack([x, np.zeros_like(x), z], axis=1))


def _marks(low: float, high: float) -> Array:
    """Multiples of 5 cm between two bounds [m]."""
    marks: Array = np.arange(np.ceil(low / 0.05), high / 0.05) * 0.05
    return marks


def _line(axes: Any, shot: "Snapshot", x: Array, z: Array) -> None:
    """A line of the grid on the ground."""
    x, z = np.broadcast_arrays(x, z)
    axes.plot(x, z, _level(shot, x, z), color="white", linewidth=0.6, alpha=0.6, zorder=1)


def _tank(axes: Any, shot: "Snapshot", low: Array, high: Array) -> None:
    """The surface of a medium that was cut open, and the outline of the part in front."""
    level = float(np.quantile(shot.medium[:, 1], 0.99)) + shot.particle_edge / 2  # splashes are no surface
    cut = np.array([low[0], 0.0, shot.robot[:, 2].mean()])
    _sheet(axes, cut, high, level, medium_colour(shot.scene), 0.35, 4)
    corners = [(low[0], high[2]), (high[0], high[2])]
    for x, z in corners:
        axes.plot([x, x], [z, z], [0.0, level], color="0.35", linewidth=0.8, zorder=5)
        axes.plot([x, x], [cut[2], z], [level, level], color="0.35", linewidth=0.8, zorder=5)
    axes.plot([low[0], high[0]], [high[2]] * 2, [level] * 2, color="0.35", linewidth=0.8, zorder=5)
    axes.plot([low[0], high[0]], [high[2]] * 2, [0.0] * 2, color="0.35", linewidth=0.8, zorder=5)


def _sheet(axes: Any, low: Array, high: Array, level: float, colour: Colour, alpha: float, order: int) -> None:
    """A horizontal rectangle."""
    x, z = np.meshgrid([low[0], high[0]], [low[2], high[2]])
    axes.plot_surface(x, z, np.full((2, 2), level), color=(*colour, alpha), shade=False, linewidth=0, zorder=order)


def _particles(shot: "Snapshot") -> tuple[Array, Array]:
    """Where all that is drawn lies `[n, 3]`, and its shaded colours `[n, 3]`."""
    exists = shot.scene.robot.occupancy > 0
    robot, members = shot.robot[exists], shot.membership[exists]
    reach = 1.8 * shot.particle_edge
    colours = tints(members, shot.muscles) * brightness(robot, reach)
    if not len(shot.medium):
        return robot, colours
    medium = shot.medium
    if _is_immersed(shot):
        medium = medium[medium[:, 2] < robot[:, 2].mean()]
        bright = brightness(medium, reach)
    else:
        bright = brightness(medium, reach)
        bright = np.where(covered(medium, robot, 0.8 * shot.particle_edge)[:, None], 0.7 * bright, bright)
    return np.vstack([medium, robot]), np.vstack([np.array(medium_colour(shot.scene)) * bright, colours])


def _area(axes: Any, diameter: float) -> float:
    """The marker size [points^2] of a ball of this diameter [m] in a view of parallel projection."""
    axes.apply_aspect()
    foot = np.array([axes.get_xlim()[0], axes.get_ylim()[0], axes.get_zlim()[0], 1.0])
    head = np.array([*foot[:2], axes.get_zlim()[1], 1.0])
    screen = [
        axes.transData.transform((point / point[3])[:2]) for point in (axes.get_proj() @ foot, axes.get_proj() @ head)
    ]
    tall = (head[2] - foot[2]) * np.cos(np.radians(_ELEVATION))
    pixels = float(np.linalg.norm(screen[1] - screen[0]) / tall * diameter)
    return (pixels * 72.0 / float(axes.figure.dpi)) ** 2


def _shrink(path: Path) -> None:
    """Fewer colours, so that the file is small enough for a page."""
    from PIL import Image

    with Image.open(path) as image:
        small = image.convert("RGB").quantize(_SHEET_COLOURS)
    small.save(path, optimize=True)


def _dot(colour: Colour, name: str) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], marker="o", linestyle="", color=colour, label=name)
