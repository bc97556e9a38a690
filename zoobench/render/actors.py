"""What is seen in a film: ground, medium, robot, ways. Each is put on a plotter once and gives what moves it on."""

from collections.abc import Callable
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.render.colours import AMBIENT, LIGHT, Colour, brightness, covered, ground_colour, medium_colour
from zoobench.render.skin import normals, skin
from zoobench.render.viewpoint import GRID, Stage

Update = Callable[[int], None]
"""Shows a moment, counted in those of the film."""

ACTIVATION = "activation"

INK = "#222222"
WAY = "#111111"
TARGET = "#c2188f"

_COLOURS = "coolwarm"
_BALL = 1.45  # a ball's diameter by the particles' spacing: no gaps between neighbours on a surface
_MESH = 80  # points across a drawn height field
_SHADOW = 0.65  # of the ground's colour
_NEARER = 1.0  # [m] to the camera
_MARK = 0.003  # [m] radius of the balls that mark places
_GAP = 0.004  # [m] between the ground's edge and the ruler's figures
_HAIR = 2e-4  # [m] between what lies on each other


def put_ground(pyvista: Any, plotter: Any, stage: Stage, letters: int) -> None:
    """The ground, a grid on it that begins where the robot does, and a ruler along its front."""
    if stage.film.scene.ground is None:
        return
    colour = np.array(ground_colour(stage.film.scene))
    low, high = stage.low - stage.apron, stage.high + stage.apron
    x, z = (np.linspace(low[d], high[d], _MESH) for d in (0, 2))
    over_x, over_z = np.meshgrid(x, z, indexing="ij")
    heights = stage.ground(over_x.ravel(), over_z.ravel()).reshape(over_x.shape)
    steps = np.gradient(heights, x, z)
    up = np.stack([-steps[0], np.ones_like(heights), -steps[1]], axis=-1)
    light = np.maximum((up / np.linalg.norm(up, axis=-1, keepdims=True)) @ LIGHT, 0.0) / LIGHT[1]
    sheet = pyvista.StructuredGrid(over_x, heights, over_z)
    sheet["colour"] = _bytes(colour * (AMBIENT + (1.0 - AMBIENT) * light).ravel(order="F")[:, None])
    plotter.add_mesh(sheet, scalars="colour", rgb=True, lighting=False)
    start = stage.film.centre[0]
    marks = [_marks(low[d], high[d], start[d]) for d in (0, 2)]
    lines = [_line(stage, np.full(_MESH, mark), z) for mark in marks[0]]
    lines += [_line(stage, x, np.full(_MESH, mark)) for mark in marks[1]]
    for line in lines:
        plotter.add_mesh(pyvista.lines_from_points(line), color="white", opacity=0.7, line_width=1.5, lighting=False)
    front = _line(stage, marks[0], np.full(len(marks[0]), high[2])) + np.array([0.0, 0.0, _GAP])
    side = _line(stage, np.full(len(marks[1]), high[0]), marks[1]) + np.array([_GAP, 0.0, 0.0])
    for places, axis in ((front, 0), (side, 2)):
        plotter.add_point_labels(
            places,
            [f"{100 * (mark - start[axis]):.0f} cm" for mark in marks[axis // 2]],
            show_points=False, shape=None, always_visible=True, font_size=letters, text_color=INK, bold=False,
            justification_horizontal="center" if axis == 0 else "left", justification_vertical="top",
        )  # fmt: skip


def put_medium(pyvista: Any, plotter: Any, stage: Stage, pixels_per_metre: float) -> Update:
    """The medium's particles; of one that hides the robot those behind it, and its surface as a pane."""
    film = stage.film
    if not film.medium.shape[1]:
        return _still
    shown = np.ones(film.medium.shape[1], bool)
    if stage.immersed:
        shown = film.medium[0, :, 2] < film.centre[0, 2]
        _put_tank(pyvista, plotter, stage)
    colour, reach = np.array(medium_colour(film.scene)), 1.8 * film.particle_edge
    cloud = pyvista.PolyData(film.medium[0, shown])
    cloud["colour"] = np.zeros((cloud.n_points, 3), np.uint8)
    plotter.add_mesh(
        cloud, scalars="colour", rgb=True, style="points", render_points_as_spheres=True, ambient=0.55, diffuse=0.5,
        point_size=_BALL * film.particle_edge * pixels_per_metre,
    )  # fmt: skip

    def update(moment: int) -> None:
        places = film.medium[moment, shown].astype(float)
        bright = brightness(places, reach, upward=reach)
        if not stage.immersed:
            robot = film.robot[moment, film.solid].astype(float)
            bright = np.where(covered(places, robot, 0.8 * film.particle_edge)[:, None], _SHADOW * bright, bright)
        cloud.points = places
        cloud["colour"] = _bytes(colour * bright)

    return update


def put_robot(pyvista: Any, plotter: Any, stage: Stage, lattice: float, letters: int) -> Update:
    """The robot's skin, coloured by the activation of its muscles, with a bar that explains it, and its shadow."""
    film = stage.film
    cover = skin(film.body, lattice)
    triangles = np.hstack([np.full((len(cover.faces), 1), 3), cover.faces]).ravel()
    vertices = cover.places @ film.robot[0].astype(float)
    mesh = pyvista.PolyData(vertices, triangles)
    mesh[ACTIVATION] = np.zeros(len(vertices))
    mesh.point_data["Normals"] = np.zeros((len(vertices), 3))
    mesh.point_data.active_normals_name = "Normals"
    plotter.add_mesh(
        mesh, scalars=ACTIVATION, cmap=_COLOURS, clim=(-1.0, 1.0), show_scalar_bar=False, interpolation="Phong",
        ambient=0.35, diffuse=0.75, specular=0.15, specular_power=20,
    )  # fmt: skip
    plotter.add_scalar_bar(
        title="", vertical=True, position_x=0.93, position_y=0.25, width=0.03, height=0.5, n_labels=5, fmt="%+.1f",
        color=INK, title_font_size=letters, label_font_size=letters,
    )  # fmt: skip
    shadow = _put_shadow(pyvista, plotter, stage, triangles, vertices)

    def update(moment: int) -> None:
        places = cover.places @ film.robot[moment].astype(float)
        mesh.points = places
        mesh.point_data["Normals"] = normals(places, cover.faces)
        mesh[ACTIVATION] = cover.shares @ film.activation[moment]
        shadow(places)

    return update


def put_ways(pyvista: Any, plotter: Any, stage: Stage, towards: Array) -> Update:
    """Where the robot's centre of mass has been and is, and where the target will go and is.

    They are seen through the robot: drawn nearer to the camera, which changes nothing else in a parallel view.

    Args:
        towards: unit vector to the camera `[3]`.
    """
    film, nearer = stage.film, _NEARER * towards
    updates = []
    if film.target is not None:
        _put_line(pyvista, plotter, film.target + nearer, TARGET)
        updates.append(_put_ball(pyvista, plotter, film.target[film.kept] + 1.1 * nearer, TARGET))
    line = _put_line(pyvista, plotter, film.centre + nearer, WAY)
    updates.append(_put_ball(pyvista, plotter, film.centre[film.kept] + 1.2 * nearer, WAY))

    def update(moment: int) -> None:
        line.points = film.centre[np.minimum(np.arange(len(film.centre)), film.kept[moment])] + nearer
        for each in updates:
            each(moment)

    return update


def _put_line(pyvista: Any, plotter: Any, places: Array, colour: str) -> Any:
    line = pyvista.lines_from_points(places)
    plotter.add_mesh(line, color=colour, line_width=3, lighting=False)
    return line


def _put_ball(pyvista: Any, plotter: Any, places: Array, colour: str) -> Update:
    """A ball that is at `places` `[moments, 3]` [m]."""
    ball = pyvista.Sphere(radius=_MARK)
    around = ball.points.copy()
    plotter.add_mesh(ball, color=colour, ambient=0.5, diffuse=0.6, smooth_shading=True)

    def update(moment: int) -> None:
        ball.points = around + places[moment]

    return update


def _put_shadow(pyvista: Any, plotter: Any, stage: Stage, triangles: Any, vertices: Array) -> Callable[[Array], None]:
    """On bare ground: the skin pressed flat."""
    if stage.film.scene.ground is None or stage.film.medium.shape[1]:
        return lambda _: None
    mesh = pyvista.PolyData(vertices.copy(), triangles)
    colour = tuple(_SHADOW * np.array(ground_colour(stage.film.scene)))
    plotter.add_mesh(mesh, color=colour, lighting=False)

    def update(places: Array) -> None:
        flat = places.copy()
        flat[:, 1] = stage.ground(places[:, 0], places[:, 2]) + 2 * _HAIR
        mesh.points = flat

    return update


def _put_tank(pyvista: Any, plotter: Any, stage: Stage) -> None:
    """The surface of a medium that is cut open, and the edges of the part in front."""
    low, high, level, cut = stage.low, stage.high, stage.level, stage.film.centre[0, 2]
    colour: Colour = medium_colour(stage.film.scene)
    corners = np.array(
        [[low[0], level, cut], [high[0], level, cut], [high[0], level, high[2]], [low[0], level, high[2]]]
    )
    pane = pyvista.PolyData(corners, [4, 0, 1, 2, 3])
    plotter.add_mesh(pane, color=colour, opacity=0.2, lighting=False)
    floor = corners * np.array([1.0, 0.0, 1.0]) + np.array([0.0, 2 * _HAIR, 0.0])
    for line in ([*corners, corners[0]], [floor[2], corners[2]], [floor[3], corners[3]]):
        plotter.add_mesh(pyvista.lines_from_points(np.array(line)), color="#555555", line_width=1.5, lighting=False)
    front = np.array([floor[1], floor[2], floor[3], floor[0]])
    plotter.add_mesh(pyvista.lines_from_points(front), color="#555555", line_width=1.5, lighting=False)


def _line(stage: Stage, x: Array, z: Array) -> Array:
    """A line on the ground `[n, 3]` [m]."""
    return np.stack([x, stage.ground(x, z) + _HAIR, z], axis=1)


def _marks(low: float, high: float, start: float) -> Array:
    """Places at multiples of `GRID` from the start, between two bounds [m]."""
    first = np.ceil((low - start) / GRID - 1e-9)
    marks: Array = start + GRID * np.arange(first, np.floor((high - start) / GRID + 1e-9) + 1)
    return marks


def _bytes(colours: Array) -> Any:
    return np.clip(255.0 * colours, 0.0, 255.0).astype(np.uint8)


def _still(_: int) -> None:
    return
