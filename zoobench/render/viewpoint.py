"""The part of a world that is drawn, and the camera that looks at it."""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.render.recording import Recording

CameraName = Literal["film", "follow", "side", "top"]

_ANGLES: dict[CameraName, tuple[float, float]] = {
    "film": (30.0, 72.0),
    "follow": (30.0, 72.0),
    "side": (8.0, 90.0),
    "top": (90.0, 90.0),
}
"""Elevation and azimuth of every camera [degrees], see `camera_at`."""

_SMALLEST_SIDE, _LARGEST_SIDE = 16, 4096  # of a picture [pixels]
_NEAR = 0.5  # [body lengths] around the robot that a camera sees which follows it
_SMALLEST = (0.2, 0.15)  # length and width of the ground that is drawn where nothing bounds it [m]
_MARGIN = 0.03  # [m] of ground around the moving parts
_HEADROOM = 0.01  # [m]
_APRON = 0.02  # [m] of ground that is drawn around a bed
_ROOM = (0.86, 0.84)  # share of the picture's width and height for the world; the rest is for text
_SHIFT = (0.7, 0.15)  # how far the world is moved to the left and down, by half of the rest


@dataclass(frozen=True)
class Region:
    """The part of a recorded world that is drawn.

    Attributes:
        recording: the world.
        low, high: corners of the part `[3]` [m].
        immersed: whether the medium hides most of the robot, so that the half in front of the robot is not drawn.
        level: height of the medium's surface at the start [m]; 0 on bare ground.
        apron: how much further the ground is drawn on every side [m].
    """

    recording: Recording
    low: Array
    high: Array
    immersed: bool
    level: float
    apron: float

    def ground(self, x: Array, z: Array) -> Array:
        """Height of the rigid ground at points `[n]` [m]."""
        ground = self.recording.scene.ground
        if ground is None or ground.terrain is None:
            return np.zeros(len(x))
        return ground.terrain.heights_below(np.stack([x, np.zeros_like(x), z], axis=1))


def region_of(recording: Recording) -> Region:
    """The whole bed of a medium or box of water, or as much of bare ground as robot and target come near to."""
    scene = recording.scene
    lower, upper = recording.corners
    robot = recording.robot[:, recording.solid].astype(float)
    solid = np.vstack(
        [robot.reshape(-1, 3), *(each.reshape(-1, 3).astype(float) for each in recording.objects.values())]
    )
    tallest = float(solid[:, 1].max())
    level, immersed, apron = 0.0, False, 0.0
    if recording.medium.shape[1]:
        medium = recording.medium[0].astype(float)
        heights = scene.heights_above_ground(medium)
        apron = _APRON
        level = float(np.quantile(heights, 0.99)) + recording.particle_edge / 2  # splashes do not count
        immersed = level > float(np.median(scene.heights_above_ground(robot[0])))
        tallest = max(tallest, float(medium[:, 1].max()))
    elif scene.water is not None:
        apron, tallest = _APRON, float(upper[1]) - _HEADROOM
    else:
        seen = solid
        if recording.target is not None:
            seen = np.vstack([seen, recording.target])
        seen_low, seen_high = seen.min(axis=0) - _MARGIN, seen.max(axis=0) + _MARGIN
        smallest = np.array([_SMALLEST[0], 0.0, _SMALLEST[1]]) / 2
        middle, half = (seen_low + seen_high) / 2, np.maximum((seen_high - seen_low) / 2, smallest)
        lower, upper = np.maximum(lower, middle - half), np.minimum(upper, middle + half)
    floor = scene.lower[1] if scene.surface_water is None else float(solid[:, 1].min()) - _MARGIN
    lower[1], upper[1] = floor, tallest + _HEADROOM
    return Region(recording, lower, upper, immersed, level, apron)


@dataclass(frozen=True)
class Camera:
    """A view in parallel projection.

    Attributes:
        focus: the point in the middle of the picture `[3]` [m].
        right, up, towards: unit vectors to the right and up in the picture, and to the camera `[3]`.
        half_height: of the picture [m].
    """

    focus: Array
    right: Array
    up: Array
    towards: Array
    half_height: float


@dataclass(frozen=True)
class View:
    """How a world is to be looked at.

    Attributes:
        width, height: of the picture [pixels].
        camera: `film` and `follow` look from the right of the robot, in front of it and above, `side` from its right,
            `top` from above, where ahead is to the right. `follow` is near the robot and goes with it; the others hold
            all that is drawn.

    Raises:
        UsageError: there is no such camera, or no picture of this size.
    """

    width: int = 640
    height: int = 360
    camera: CameraName = "film"

    def __post_init__(self) -> None:
        for side in (self.width, self.height):
            if not isinstance(side, int) or not _SMALLEST_SIDE <= side <= _LARGEST_SIDE:
                raise UsageError(
                    f"A picture of {self.width!r} x {self.height!r} pixels cannot be drawn. Give whole numbers from "
                    f"{_SMALLEST_SIDE} to {_LARGEST_SIDE}."
                )
        if self.camera not in _ANGLES:
            *others, last = get_args(CameraName)
            raise UsageError(f"A camera {self.camera!r} is not offered. Choose {', '.join(others)} or {last}.")


def camera_for(region: Region, aspect: float, name: CameraName = "film") -> Camera:
    """A camera that holds the whole region, or the part near the robot at its start, see `View`.

    Args:
        aspect: width of the picture by its height; a part at the top and on the right is left to text.
        name: of the camera.
    """
    if name == "follow":
        region = _near(region)
    wider = np.array([region.apron, 0.0, region.apron])
    box = (region.low - wider, region.high + wider)
    corners = np.array([[box[bit >> d & 1][d] for d in range(3)] for bit in range(8)])
    return camera_at(corners, *_ANGLES[name], aspect, room=_ROOM, shift=_SHIFT)


def _near(region: Region) -> Region:
    """The part of a region that is near the robot at its start."""
    robot = region.recording.robot[0, region.recording.solid].astype(float)
    around = np.array([1.0, 0.0, 1.0]) * _NEAR * np.ptp(robot[:, 0])
    low, high = robot.min(axis=0) - around, robot.max(axis=0) + around
    return replace(region, low=low, high=high, apron=0.0)


def camera_at(
    points: Array,
    elevation: float,
    azimuth: float,
    aspect: float,
    *,
    room: tuple[float, float],
    shift: tuple[float, float],
) -> Camera:
    """A view that holds points `[n, 3]` [m].

    Args:
        elevation, azimuth: of the camera [degrees]; azimuth 0 looks at a robot's face, 90 at its right flank.
        aspect: width of the picture by its height.
        room: share of the width and height that the points fill.
        shift: how far the points are moved to the left and down, by half of the rest.
    """
    rise, turn = np.radians(elevation), np.radians(azimuth)
    towards = np.array([np.cos(rise) * np.cos(turn), np.sin(rise), np.cos(rise) * np.sin(turn)])
    right = np.array([np.sin(turn), 0.0, -np.cos(turn)])
    up = np.cross(towards, right)
    across, along = points @ right, points @ up
    half = max(np.ptp(along) / 2 / room[1], np.ptp(across) / 2 / aspect / room[0])
    middle_across = (across.min() + across.max()) / 2 + (1 - room[0]) * half * aspect * shift[0]
    middle_along = (along.min() + along.max()) / 2 + (1 - room[1]) * half * shift[1]
    depth = (points @ towards).mean()
    return Camera(middle_across * right + middle_along * up + depth * towards, right, up, towards, float(half))
