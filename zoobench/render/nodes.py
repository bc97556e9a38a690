"""Parts of the page on which a robot is watched. Each is put into its scene once, and moved by the update it returns.

All lie in a frame, `FRAME`, that the page moves so that the robot stays before the camera.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.render.actors import BALL, EDGES, GRID, PATH, TARGET, shown_grains
from zoobench.render.colours import OBJECT, Colour, activation_colour, ground_colour, medium_colour
from zoobench.render.present import LiveWorld
from zoobench.render.skin import object_skin, skin
from zoobench.render.viewpoint import Region
from zoobench.render.vortices import water_colours

if TYPE_CHECKING:
    from viser import SceneApi

Update = Callable[[LiveWorld], None]
"""Shows the present moment of a world of the same problem."""

FRAME = "/world"

_FAR = 200.0  # [m] of level ground
_FADE = 3.0  # [m] from the camera, where its lines end
_MESH, _MOST = 0.01, 400  # [m] between the points of a height field, and how many there are across it, at most
_GRAINS = (0.85, 1.05)  # brightness of its particles, by which they are told apart
_MARK = 0.004  # [m] radius of the balls that mark positions
_STROKE = 0.0012  # [m] width of a path
_STRETCHES = 250  # of a path, at most
_FLAT = (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0)  # a quaternion that lays an image on its back, its rows along z


def put_ground(scene: "SceneApi", region: Region) -> Update:
    """The ground: level and without end, with a grid on it, or all hills of the arena."""
    matter = region.recording.scene
    if matter.ground is None:
        return _still
    colour = _bytes(ground_colour(matter))
    if matter.ground.terrain is None:
        scene.add_grid(
            f"{FRAME}/ground", _FAR, _FAR, plane="xz", cell_size=GRID, cell_color=(255, 255, 255), cell_thickness=1.0,
            section_size=10 * GRID, section_color=(255, 255, 255), section_thickness=2.0, fade_distance=_FADE,
            plane_color=colour, plane_opacity=1.0, shadow_opacity=0.35,
        )  # fmt: skip
        return _still
    x, z = (_across(matter.lower[d], matter.upper[d]) for d in (0, 2))
    over_x, over_z = (places.ravel() for places in np.meshgrid(x, z, indexing="ij"))
    places = np.stack([over_x, region.ground(over_x, over_z), over_z], axis=1)
    corner = (np.arange(len(x) - 1)[:, None] * len(z) + np.arange(len(z) - 1)).ravel()[:, None]
    faces = np.vstack([corner + np.array(triangle) for triangle in ([0, 1, len(z)], [1, len(z) + 1, len(z)])])
    scene.add_mesh_simple(f"{FRAME}/ground", places, faces, color=colour, side="double")
    return _still


def put_medium(scene: "SceneApi", region: Region) -> Update:
    """The medium's particles; if it hides the robot, those behind the robot."""
    recording = region.recording
    if not recording.medium.shape[1]:
        return _still
    shown = shown_grains(region)
    grains = np.random.default_rng(0).uniform(*_GRAINS, (int(shown.sum()), 1)) * medium_colour(recording.scene)
    cloud = scene.add_point_cloud(
        f"{FRAME}/medium", recording.medium[0, shown], np.clip(grains, 0.0, 1.0),
        point_size=BALL * recording.particle_edge, point_shape="circle",
    )  # fmt: skip

    def update(world: LiveWorld) -> None:
        # counted from the arena, whose size the half precision of the page resolves to a quarter of a millimetre
        cloud.points = (world.recording.medium[0, shown] - world.offset).astype(np.float16)
        cloud.position = tuple(world.offset)

    return update


def put_water(scene: "SceneApi", region: Region) -> Update:
    """A layer of water on a grid and the edges of its box; lighter where it turns to the left, darker to the right."""
    recording = region.recording
    if recording.vorticity is None:
        return _still
    low, high = np.array(recording.scene.lower), np.array(recording.scene.upper)
    (length, height, width), middle = high - low, (low + high) / 2
    layer = scene.add_image(
        f"{FRAME}/water", _picture(recording.vorticity[0], medium_colour(recording.scene)), length, width,
        format="png", wxyz=_FLAT, cast_shadow=False, receive_shadow=False,
    )  # fmt: skip
    corners = np.array([[x, y, z] for x in (0, length) for y in (0, height) for z in (0, width)]) + low
    edges = [(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in (1, 2, 4)]
    box = scene.add_line_segments(f"{FRAME}/box", corners[np.array(edges)], _hex(EDGES), thickness=_STROKE)

    def update(world: LiveWorld) -> None:
        assert world.recording.vorticity is not None
        layer.image = _picture(world.recording.vorticity[0], medium_colour(world.recording.scene))
        layer.position, box.position = tuple(middle + world.offset), tuple(world.offset)

    return update


def put_robot(scene: "SceneApi", region: Region) -> Update:
    """The robot's skin, in pieces of one muscle or between muscles, each in the colour of its activation."""
    recording = region.recording
    cover = skin(recording.body)
    pieces = []
    for number, faces in enumerate(muscle_faces(cover.faces, cover.shares @ recording.body.muscle_membership)):
        rows, corners = np.unique(faces, return_inverse=True)
        places, shares = cover.places[rows], (cover.shares[rows].sum(axis=0) / len(rows))
        piece = scene.add_mesh_simple(f"{FRAME}/robot/{number}", places @ recording.robot[0], corners.reshape(-1, 3))
        pieces.append((piece, places, shares))

    def update(world: LiveWorld) -> None:
        robot = world.recording.robot[0].astype(float)
        for piece, places, shares in pieces:
            piece.vertices = (places @ robot).astype(np.float32)
            piece.color = _bytes(activation_colour(float(shares @ world.activation)))

    return update


def put_objects(scene: "SceneApi", region: Region) -> Update:
    """The objects' skins."""
    recording, pieces = region.recording, []
    for thing in recording.scene.objects:
        cover = object_skin(thing, recording.particle_edge)
        vertices = (cover.places @ recording.objects[thing.name][0]).astype(np.float32)
        mesh = scene.add_mesh_simple(f"{FRAME}/{thing.name}", vertices, cover.faces, color=_bytes(OBJECT))
        pieces.append((mesh, cover.places, thing.name))

    def update(world: LiveWorld) -> None:
        for mesh, places, name in pieces:
            mesh.vertices = (places @ world.recording.objects[name][0]).astype(np.float32)

    return update


def put_paths(scene: "SceneApi", region: Region) -> Update:
    """The path of the robot's centre of mass so far, the whole path of the target, and a ball where that is now."""
    recording = region.recording
    kept = np.unique(np.linspace(0, len(recording.centre) - 1, _STRETCHES + 1).round().astype(int))
    line = _put_path(scene, "path", recording.centre[kept], PATH)
    goal, ball = None, None
    if recording.target is not None:
        goal = _put_path(scene, "target", recording.target[kept], TARGET)
        ball = scene.add_icosphere(f"{FRAME}/target-now", _MARK, _hex(TARGET))

    def update(world: LiveWorld) -> None:
        line.points = _stretches(world.recording.centre[np.minimum(kept, world.frame)])
        if goal is not None and ball is not None:
            assert world.recording.target is not None
            goal.points = _stretches(world.recording.target[kept])
            ball.position = tuple(world.recording.target[world.frame])

    return update


def muscle_faces(faces: NDArray[np.int64], shares: Array) -> list[NDArray[np.int64]]:
    """Faces `[face_count, 3]` in pieces, none empty, in each of which the corners belong to the same muscles.

    Args:
        shares: of each muscle in every vertex `[vertex_count, muscle_count]`.
    """
    passive = np.maximum(1.0 - shares.sum(axis=1, keepdims=True), 0.0)
    owners = np.sort(np.hstack([passive, shares]).argmax(axis=1)[faces], axis=1)
    _, piece = np.unique(owners, axis=0, return_inverse=True)
    return [faces[piece.ravel() == number] for number in range(piece.max() + 1)]


def _across(low: float, high: float) -> Array:
    """The points of a height field along one axis `[n]` [m]."""
    return np.linspace(low, high, min(round((high - low) / _MESH) + 1, _MOST))


def _still(_: LiveWorld) -> None:
    """The update of a node that does not move."""


def _put_path(scene: "SceneApi", name: str, places: Array, colour: str) -> Any:
    return scene.add_line_segments(f"{FRAME}/{name}", _stretches(places), _hex(colour), thickness=_STROKE)


def _stretches(places: Array) -> Array:
    """A path through `places` `[n, 3]` as its stretches `[n - 1, 2, 3]`."""
    return np.stack([places[:-1], places[1:]], axis=1)


def _picture(vorticity: Array, still: Colour) -> NDArray[np.uint8]:
    """Water as an image with opacity, a row for each place along z `[nz, nx, 4]`."""
    return (255.0 * water_colours(vorticity, still)).astype(np.uint8).swapaxes(0, 1)


def _bytes(colour: Colour) -> tuple[int, int, int]:
    red, green, blue = (round(255.0 * part) for part in colour)
    return red, green, blue


def _hex(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
