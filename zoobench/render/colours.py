"""Colour and light of drawn particles, and of what they stand on."""

import colorsys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array

if TYPE_CHECKING:
    from zoobench.sim.model.scene import Scene

Colour = tuple[float, float, float]

LIGHT = np.array([0.35, 0.85, 0.4]) / np.linalg.norm([0.35, 0.85, 0.4])
"""Where the light comes from: above, before and to the right."""

AMBIENT = 0.6
"""Share of the light that comes from everywhere."""

PASSIVE = 0.66
"""Grey of matter without muscle."""

_MEDIA: dict[str, Colour] = {
    "sand": (0.88, 0.74, 0.48),
    "clay": (0.72, 0.45, 0.34),
    "mud": (0.46, 0.38, 0.27),
    "snow": (0.97, 0.98, 1.0),
    "water": (0.36, 0.62, 0.88),
}
_ROUGH: Colour = (0.62, 0.59, 0.54)
_SLIPPERY: Colour = (0.74, 0.88, 0.96)
_LOW_FRICTION = 0.2  # bare ground with less is drawn as ice


def camera_axes(elevation: float, azimuth: float) -> Array:
    """Rows: the directions to the right and up in the picture, and towards the camera, in (x, y, z).

    Both angles are in degrees; azimuth 0 looks at a robot's face, 90 at its right flank.
    """
    rise, turn = np.radians(elevation), np.radians(azimuth)
    towards = np.array([np.cos(rise) * np.cos(turn), np.sin(rise), np.cos(rise) * np.sin(turn)])
    right = np.array([np.sin(turn), 0.0, -np.cos(turn)])
    return np.stack([right, np.cross(towards, right), towards])


def medium_colour(scene: "Scene") -> Colour:
    """Of the medium of a scene that has one."""
    assert scene.medium is not None
    return _MEDIA[scene.medium.material.law.name.lower()]


def ground_colour(scene: "Scene") -> Colour:
    """Of the ground of a scene that has one."""
    assert scene.ground is not None
    return _SLIPPERY if scene.ground.friction < _LOW_FRICTION and scene.medium is None else _ROUGH


def palette(names: Sequence[str]) -> list[Colour]:
    """A colour for each muscle: hues around the circle, a pair of left and right lighter and darker."""
    groups = list(dict.fromkeys(name.removesuffix("-left").removesuffix("-right") for name in names))
    colours = []
    for name in names:
        group = groups.index(name.removesuffix("-left").removesuffix("-right"))
        value = 0.72 if name.endswith("-right") else 0.95
        colours.append(colorsys.hsv_to_rgb((0.97 + group / len(groups)) % 1.0, 0.72, value))
    return colours


def tints(membership: Array, muscles: Sequence[str]) -> Array:
    """Colour of each particle `[n, 3]` by its share of each muscle `[n, muscle_count]`; grey is passive."""
    passive = 1.0 - membership.sum(axis=1, keepdims=True)
    colours = np.array(palette(muscles)).reshape(-1, 3)
    found: Array = membership @ colours + PASSIVE * np.maximum(passive, 0.0)
    return found


def outward(points: Array, radius: float, *, upward: float = 0.0) -> Array:
    """Unit normals of the surface `[n, 3]`: away from the mean of the neighbours; of no meaning inside.

    `upward` [m] decides where the neighbours do not, as in a single layer, and little elsewhere.
    """
    from scipy.spatial import KDTree

    pairs = KDTree(points).query_pairs(radius, output_type="ndarray")
    offset = np.zeros_like(points)
    gap = points[pairs[:, 0]] - points[pairs[:, 1]]
    np.add.at(offset, pairs[:, 0], gap)
    np.add.at(offset, pairs[:, 1], -gap)
    offset[:, 1] += upward
    normal: Array = offset / np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-12)
    return normal


def covered(points: Array, robot: Array, radius: float) -> NDArray[np.bool_]:
    """Whether a robot particle stands above a point within a horizontal distance: there its shadow falls `[n]`."""
    from scipy.spatial import KDTree

    if not len(points):
        return np.zeros(0, bool)
    distance, _ = KDTree(robot[:, [0, 2]]).query(points[:, [0, 2]])
    shadow: NDArray[np.bool_] = distance < radius
    return shadow


def brightness(points: Array, radius: float, *, upward: float = 0.0) -> Array:
    """Diffuse light from above and some from everywhere `[n, 1]`; `upward` as in `outward`."""
    lit: Array = np.maximum(outward(points, radius, upward=upward) @ LIGHT, 0.0)
    return np.asarray(AMBIENT + (1.0 - AMBIENT) * lit)[:, None]
