"""Where a film plays: what part of the world is seen, and from where."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.render.colours import camera_axes

if TYPE_CHECKING:
    from zoobench.render.film import Film

_ELEVATION, _AZIMUTH = 30.0, 72.0  # of the camera [degrees]: azimuth 0 looks at the robot's face, 90 at its right flank
_LEAST = (0.2, 0.15)  # length and width of the ground that is drawn where nothing bounds it [m]
_MARGIN = 0.03  # [m] of ground around what moves
_HEADROOM = 0.01  # [m]
_APRON = 0.02  # [m] of ground that is drawn around a bed
_ROOM = (0.86, 0.84)  # of the picture's width and height, for the stage
_ASIDE, _ABOVE = 0.7, 0.15  # by how much of half of the rest the stage is moved to the left and down

GRID = 0.05
"""[m] between two lines on the ground."""


@dataclass(frozen=True)
class Stage:
    """What is seen of a film.

    Attributes:
        low, high: corners of the part of the world that is drawn `[3]` [m].
        immersed: whether the medium hides the robot, so that the half of it before the robot is left away.
        level: height of the medium's surface at the start [m]; 0 on bare ground.
        apron: how much further the ground is drawn on every side [m].
    """

    film: "Film"
    low: Array
    high: Array
    immersed: bool
    level: float
    apron: float

    def ground(self, x: Array, z: Array) -> Array:
        """Height of the rigid ground at points `[n]` [m]."""
        ground = self.film.scene.ground
        if ground is None or ground.terrain is None:
            return np.zeros(len(x))
        return ground.terrain.heights_below(np.stack([x, np.zeros_like(x), z], axis=1))


def stage_of(film: "Film") -> Stage:
    """The whole bed of a medium, or as much of the bare ground as the robot and its target come near to."""
    lower, upper = np.array(film.scene.lower), np.array(film.scene.upper)
    robot = film.robot[:, film.solid]
    tallest = float(robot[..., 1].max())
    level, immersed, apron = 0.0, False, 0.0
    if film.medium.shape[1]:
        ground = film.scene.ground
        heights = film.medium[0, :, 1].astype(float)
        if ground is not None and ground.terrain is not None:
            heights = heights - ground.terrain.heights_below(film.medium[0].astype(float))
        apron = _APRON
        level = float(np.quantile(heights, 0.99)) + film.particle_edge / 2  # splashes are no surface
        immersed = bool(film.medium[0, :, 1].max() > robot[0, :, 1].max())
        tallest = max(tallest, float(film.medium[0, :, 1].max()))
    else:
        ways = [robot.reshape(-1, 3)] + ([] if film.target is None else [film.target])
        least = np.array([_LEAST[0], 0.0, _LEAST[1]]) / 2
        seen_low = np.min([way.min(axis=0) for way in ways], axis=0) - _MARGIN
        seen_high = np.max([way.max(axis=0) for way in ways], axis=0) + _MARGIN
        middle, half = (seen_low + seen_high) / 2, np.maximum((seen_high - seen_low) / 2, least)
        lower, upper = np.maximum(lower, middle - half), np.minimum(upper, middle + half)
    lower[1], upper[1] = film.scene.lower[1], tallest + _HEADROOM
    return Stage(film, lower, upper, immersed, level, apron)


@dataclass(frozen=True)
class Camera:
    """A view of parallel projection.

    Attributes:
        focus: what is in the middle of the picture `[3]` [m].
        towards: unit vector from there to the camera `[3]`.
        right, up: unit vectors in the picture `[3]`.
        half_height: of the picture [m].
    """

    focus: Array
    towards: Array
    right: Array
    up: Array
    half_height: float


def camera_for(stage: Stage, aspect: float) -> Camera:
    """A view from the robot's right, before it and above, that holds the whole stage.

    Args:
        aspect: width of the picture by its height; a part at the top and on the right is left to writing.
    """
    right, up, towards = camera_axes(_ELEVATION, _AZIMUTH)
    wider = np.array([stage.apron, 0.0, stage.apron])
    box = (stage.low - wider, stage.high + wider)
    corners = np.array([[box[bit >> d & 1][d] for d in range(3)] for bit in range(8)])
    across, along = corners @ right, corners @ up
    half = max(np.ptp(along) / 2 / _ROOM[1], np.ptp(across) / 2 / aspect / _ROOM[0])
    middle_across = (across.min() + across.max()) / 2 + (1 - _ROOM[0]) * half * aspect * _ASIDE
    middle_along = (along.min() + along.max()) / 2 + (1 - _ROOM[1]) * half * _ABOVE
    centre = (stage.low + stage.high) / 2
    focus = centre + (middle_across - centre @ right) * right + (middle_along - centre @ up) * up
    return Camera(focus, towards, right, up, float(half))
