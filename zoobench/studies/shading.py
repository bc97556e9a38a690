"""Colour and light of drawn particles."""

import colorsys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Colour = tuple[float, float, float]

LIGHT = np.array([0.35, 0.85, 0.4]) / np.linalg.norm([0.35, 0.85, 0.4])
"""Where the light comes from: above, before and to the right."""

AMBIENT = 0.6
"""Share of the light that comes from everywhere."""


PASSIVE = 0.66
"""Grey of matter without muscle."""


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


def outward(points: Array, radius: float) -> Array:
    """Unit normals of the surface `[n, 3]`: away from the mean of the neighbours; of no meaning inside."""
    from scipy.spatial import KDTree

    pairs = KDTree(points).query_pairs(radius, output_type="ndarray")
    offset = np.zeros_like(points)
    gap = points[pairs[:, 0]] - points[pairs[:, 1]]
    np.add.at(offset, pairs[:, 0], gap)
    np.add.at(offset, pairs[:, 1], -gap)
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


def brightness(points: Array, radius: float) -> Array:
    """Diffuse light from above and some from everywhere `[n, 1]`."""
    lit: Array = np.maximum(outward(points, radius) @ LIGHT, 0.0)
    return np.asarray(AMBIENT + (1.0 - AMBIENT) * lit)[:, None]
