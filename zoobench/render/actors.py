"""Parts of a picture: ground, medium, robot and paths. Each is put on a canvas once; moving ones return an update."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body
from zoobench.render.canvas import INK, Canvas
from zoobench.render.colours import OBJECT, ground_colour, medium_colour
from zoobench.render.marks import put_marks
from zoobench.render.recording import Recording
from zoobench.render.skin import Skin, normals, object_skin, skin
from zoobench.render.viewpoint import Region

Update = Callable[[int], None]
"""Shows a moment, counted in those of the recording."""

GRID = 0.05
"""[m] between two lines on the ground."""

PATH = "#111111"
TARGET = "#c2188f"
BALL = 1.45
"""A ball's diameter by the particles' spacing: no gaps between neighbours on a surface."""

EDGES = "#555555"
"""Colour of the edges of a box or a cut of water."""

_MESH = 80  # points across a drawn height field
_SHADOW = 0.65  # of the ground's colour
_NEARER = 1.0  # [m] to the camera
_MARK = 0.003  # [m] radius of the balls that mark positions
_GAP = 0.004  # [m] between the ground's edge and the ruler's numbers
_LABELS = 7  # of a ruler, at most
_ABOVE = 2e-3  # [m] from the ground to the lines on it, towards the camera
_HAIR = 2e-4  # [m] between surfaces that lie on each other
_STROKE, _APART = 2.0, 3.0  # length of the fibres' strokes and distance between them [particle edges]


def put_ground(canvas: Canvas, region: Region, towards: Array) -> None:
    """The ground, a grid on it that begins at the robot's start, and a ruler along its edges.

    Args:
        towards: unit vector to the camera `[3]`.
    """
    recording = region.recording
    if recording.scene.ground is None:
        return
    low, high = region.low - region.apron, region.high + region.apron
    x, z = (np.linspace(low[d], high[d], _MESH) for d in (0, 2))
    over_x, over_z = np.meshgrid(x, z, indexing="ij")
    heights = region.ground(over_x.ravel(), over_z.ravel()).reshape(over_x.shape)
    sheet = canvas.pyvista.StructuredGrid(over_x, heights, over_z).extract_surface(algorithm="dataset_surface")
    canvas.plotter.add_mesh(
        sheet, color=ground_colour(recording.scene), smooth_shading=True, ambient=0.6, diffuse=0.52
    )  # fmt: skip
    start = recording.centre[0]
    marks = [_marks(low[d], high[d], start[d]) for d in (0, 2)]
    lines = [_line(region, np.full(_MESH, mark), z) for mark in marks[0]]
    lines += [_line(region, x, np.full(_MESH, mark)) for mark in marks[1]]
    for line in lines:
        canvas.line(line + _ABOVE * towards, "white", opacity=0.7, line_width=1.5)
    front = _line(region, marks[0], np.full(len(marks[0]), high[2])) + np.array([0.0, 0.0, _GAP])
    side = _line(region, np.full(len(marks[1]), high[0]), marks[1]) + np.array([_GAP, 0.0, 0.0])
    for places, axis in ((front, 0), (side, 2)):
        numbers = np.round(100 * (places[:, axis] - start[axis])).astype(int)
        labelled = numbers % (round(100 * GRID) * -(-len(numbers) // _LABELS)) == 0
        canvas.plotter.add_point_labels(
            places[labelled], [f"{number} cm" for number in numbers[labelled]],
            show_points=False, shape=None, always_visible=True, font_size=canvas.font_size, text_color=INK, bold=False,
            justification_horizontal="center" if axis == 0 else "left", justification_vertical="top",
        )  # fmt: skip


def put_medium(canvas: Canvas, region: Region, pixels_per_metre: float, *, from_above: bool = False) -> Update:
    """The medium's particles; if it hides the robot, those behind or, seen `from_above`, below it and an outline."""
    recording = region.recording
    if not recording.medium.shape[1]:
        return lambda _: None
    shown = shown_grains(region, axis=1 if from_above else 2)
    if region.immersed:
        _put_tank(canvas, region)
    colour = np.array(medium_colour(recording.scene))
    cloud = canvas.pyvista.PolyData(recording.medium[0, shown])
    cloud["colour"] = np.zeros((cloud.n_points, 3), np.uint8)
    canvas.plotter.add_mesh(
        cloud, scalars="colour", rgb=True, style="points", render_points_as_spheres=True, ambient=0.4, diffuse=0.65,
        point_size=BALL * recording.particle_edge * pixels_per_metre,
    )  # fmt: skip

    def update(moment: int) -> None:
        places = recording.medium[moment, shown]
        bright = np.ones((len(places), 1))
        if not region.immersed:
            robot = recording.robot[moment, recording.solid]
            bright[covered(places, robot, 0.8 * recording.particle_edge)] = _SHADOW
        cloud.points = places
        cloud["colour"] = _bytes(colour * bright)

    return update


def shown_grains(region: Region, axis: int = 2) -> Mask:
    """Which of the medium's particles are drawn: all, or where they hide the robot those behind it along an axis."""
    places = region.recording.medium[0]
    if not region.immersed:
        return np.ones(len(places), bool)
    behind: Mask = places[:, axis] < region.recording.centre[0, axis]
    return behind


def put_robot(canvas: Canvas, region: Region, values: Array, **look: Any) -> Update:
    """The robot's skin and its shadow.

    Args:
        values: of every particle at every moment `[moments, robot_count, ...]`: scalars, or colours with `rgb=True`.
        look: how the values are shown.
    """
    recording = region.recording
    cover = skin(recording.body)
    mesh = put_skin(canvas, cover, recording.robot[0], values[0], **look)
    shadow, marks = _put_shadow(canvas, region, mesh), put_marks(canvas, mesh, cover, recording.body)

    def update(moment: int) -> None:
        _update_skin(mesh, cover, recording.robot[moment], values[moment])
        shadow()
        marks()

    return update


def put_objects(canvas: Canvas, region: Region) -> Update:
    """The objects and their shadows."""
    recording, updates = region.recording, []
    for thing in recording.scene.objects:
        cover, places = object_skin(thing, recording.particle_edge), recording.objects[thing.name]
        tints = np.tile(OBJECT, (thing.body.particle_count, 1))
        mesh = put_skin(canvas, cover, places[0], tints, rgb=True)
        updates.append((mesh, cover, places, tints, _put_shadow(canvas, region, mesh)))

    def update(moment: int) -> None:
        for mesh, cover, places, tints, shadow in updates:
            _update_skin(mesh, cover, places[moment], tints)
            shadow()

    return update


def put_skin(canvas: Canvas, cover: Skin, positions: Any, values: Array, **look: Any) -> Any:
    """A skin around particles at `positions` `[particle_count, 3]` [m]; the mesh. The rest as in `put_robot`."""
    mesh = canvas.pyvista.PolyData.from_regular_faces(cover.places @ positions.astype(float), cover.faces)
    _update_skin(mesh, cover, positions, values)
    canvas.plotter.add_mesh(
        mesh, scalars="values", interpolation="Phong",
        ambient=0.6, diffuse=0.5, specular=0.08, specular_power=20, **look,
    )  # fmt: skip
    return mesh


def put_fibres(canvas: Canvas, cover: Skin, body: Body) -> None:
    """Strokes on the skin of a body at rest: the parts of its muscles' fibres that lie in the surface."""
    vertices, edge = cover.places @ body.positions, body.edge
    active = cover.shares @ body.muscle_membership.sum(axis=1) > 0.5
    _, first = np.unique(np.round(vertices / (_APART * edge)), axis=0, return_index=True)
    chosen = first[active[first]]
    outward = normals(vertices, cover.faces)[chosen]
    fibres = (cover.shares @ body.fibres)[chosen]
    fibres -= (fibres * outward).sum(axis=1, keepdims=True) * outward
    middle = vertices[chosen] + 0.3 * edge * outward
    half = 0.5 * _STROKE * edge * fibres
    ends = np.hstack([middle - half, middle + half])[np.linalg.norm(fibres, axis=1) > 0.5]
    if len(ends):
        strokes = canvas.pyvista.line_segments_from_points(ends.reshape(-1, 3))
        canvas.plotter.add_mesh(strokes, color=INK, line_width=1.5, lighting=False)


def put_paths(canvas: Canvas, recording: Recording, kept: NDArray[np.int64], towards: Array) -> Update:
    """The path of the robot's centre of mass so far and the whole path of the target, a ball at the present of each.

    They are seen through the robot: drawn nearer to the camera, which changes nothing else in a parallel projection.

    Args:
        recording: with `centre` and `target` in every control frame.
        kept: the frames that are its moments `[moments]`.
        towards: unit vector to the camera `[3]`.
    """
    nearer = _NEARER * towards
    balls = []
    if recording.target is not None:
        canvas.line(recording.target + nearer, TARGET, line_width=3)
        balls.append(_put_ball(canvas, recording.target, 1.1 * nearer, TARGET))
    line = canvas.line(recording.centre + nearer, PATH, line_width=3)
    balls.append(_put_ball(canvas, recording.centre, 1.2 * nearer, PATH))

    def update(moment: int) -> None:
        line.points = recording.centre[np.minimum(np.arange(len(recording.centre)), kept[moment])] + nearer
        for ball in balls:
            ball(int(kept[moment]))

    return update


def covered(points: Any, robot: Any, radius: float) -> NDArray[np.bool_]:
    """Whether a point `[n, 3]` is in the robot's shadow: a particle above or below it within `radius` [m] `[n]`."""
    from scipy.spatial import KDTree

    if not len(points):
        return np.zeros(0, bool)
    distance, _ = KDTree(robot[:, [0, 2]]).query(points[:, [0, 2]])
    shadow: NDArray[np.bool_] = distance < radius
    return shadow


def _update_skin(mesh: Any, cover: Skin, positions: Any, values: Array) -> None:
    """Move a mesh to the skin of particles at `positions` and give its vertices the particles' values."""
    places = cover.places @ positions.astype(float)
    mesh.points = places
    mesh.point_data["Normals"] = normals(places, cover.faces)
    mesh.point_data.active_normals_name = "Normals"
    found = cover.shares @ values
    mesh["values"] = found if found.ndim == 1 else _bytes(found)


def _put_ball(canvas: Canvas, places: Array, away: Array, colour: str) -> Update:
    """A ball that is `away` `[3]` from one of the `places` `[n, 3]` [m], which may be changed meanwhile."""
    ball = canvas.pyvista.Sphere(radius=_MARK)
    around = ball.points.copy()
    canvas.plotter.add_mesh(ball, color=colour, ambient=0.5, diffuse=0.6, smooth_shading=True)

    def update(place: int) -> None:
        ball.points = around + places[place] + away

    return update


def _put_shadow(canvas: Canvas, region: Region, robot: Any) -> Callable[[], None]:
    """The mesh of the robot or an object projected onto bare ground."""
    recording = region.recording
    if recording.scene.ground is None or not recording.scene.is_bare:
        return lambda: None
    mesh = canvas.pyvista.PolyData.from_regular_faces(robot.points.copy(), robot.regular_faces)
    colour = tuple(_SHADOW * np.array(ground_colour(recording.scene)))
    canvas.plotter.add_mesh(mesh, color=colour, lighting=False)

    def update() -> None:
        flat = robot.points.copy()
        flat[:, 1] = region.ground(flat[:, 0], flat[:, 2]) + 2 * _HAIR
        mesh.points = flat

    return update


def _put_tank(canvas: Canvas, region: Region) -> None:
    """The surface of a medium that is cut open, and the edges of the part in front."""
    low, high, level, cut = region.low, region.high, region.level, region.recording.centre[0, 2]
    corners = np.array(
        [[low[0], level, cut], [high[0], level, cut], [high[0], level, high[2]], [low[0], level, high[2]]]
    )
    pane = canvas.pyvista.PolyData(corners, [4, 0, 1, 2, 3])
    canvas.plotter.add_mesh(pane, color=medium_colour(region.recording.scene), opacity=0.2, lighting=False)
    floor = corners * np.array([1.0, 0.0, 1.0]) + np.array([0.0, 2 * _HAIR, 0.0])
    for line in ([*corners, corners[0]], [floor[2], corners[2]], [floor[3], corners[3]], floor[[1, 2, 3, 0]]):
        canvas.line(np.array(line), EDGES, line_width=1.5)


def _line(region: Region, x: Array, z: Array) -> Array:
    """A line on the ground `[n, 3]` [m]."""
    return np.stack([x, region.ground(x, z) + _HAIR, z], axis=1)


def _marks(low: float, high: float, start: float) -> Array:
    """Positions at multiples of `GRID` from the start, between two bounds [m]."""
    first = np.ceil((low - start) / GRID - 1e-9)
    return start + GRID * np.arange(first, np.floor((high - start) / GRID + 1e-9) + 1)


def _bytes(colours: Array) -> Any:
    return np.clip(255.0 * colours, 0.0, 255.0).astype(np.uint8)
