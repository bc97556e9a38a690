"""Colours of matter: media, ground and muscles."""

import colorsys
from collections.abc import Sequence

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.scene import Scene

Colour = tuple[float, float, float]
"""Red, green and blue in [0, 1]."""

PASSIVE: Colour = (0.66, 0.66, 0.66)
"""Colour of matter without muscle."""

NO_MUSCLE: tuple[str, str | Colour] = ("no muscle", PASSIVE)
"""Its entry in a legend."""

OBJECT: Colour = (0.24, 0.55, 0.47)
"""Colour of objects: no muscle, medium or ground has it."""

_ROUGH: Colour = (0.62, 0.59, 0.54)
_SLIPPERY: Colour = (0.74, 0.88, 0.96)
_LOW_FRICTION = 0.2  # bare ground with less is drawn as ice


def medium_colour(scene: Scene) -> Colour:
    """Colour of the medium of a scene that has one."""
    if scene.water is not None:
        return WaterMaterial.colour
    assert scene.medium is not None
    return scene.medium.material.colour


def ground_colour(scene: Scene) -> Colour:
    """Colour of the ground of a scene that has one."""
    assert scene.ground is not None
    return _SLIPPERY if scene.ground.friction < _LOW_FRICTION and scene.is_bare else _ROUGH


def palette(names: Sequence[str]) -> list[Colour]:
    """A colour for each muscle: hues around the circle, a pair of left and right lighter and darker."""
    groups = list(dict.fromkeys(name.removesuffix("-left").removesuffix("-right") for name in names))
    colours = []
    for name in names:
        group = groups.index(name.removesuffix("-left").removesuffix("-right"))
        value = 0.72 if name.endswith("-right") else 0.95
        colours.append(colorsys.hsv_to_rgb((0.97 + group / len(groups)) % 1.0, 0.72, value))
    return colours


def named(muscles: Sequence[str]) -> list[tuple[str, str | Colour]]:
    """The entries of muscles in a legend."""
    return list(zip(muscles, palette(muscles), strict=True))


def tints(membership: Array, muscles: Sequence[str]) -> Array:
    """Colour of each particle `[n, 3]` by its share of each muscle `[n, muscle_count]`; the rest is passive."""
    passive = np.maximum(1.0 - membership.sum(axis=1, keepdims=True), 0.0)
    found: Array = membership @ np.array(palette(muscles)).reshape(-1, 3) + passive * np.array(PASSIVE)
    return found


_EXTENDS, _RESTS, _CONTRACTS = (0.23, 0.30, 0.75), (0.865, 0.865, 0.865), (0.71, 0.016, 0.15)


def activation_colour(activation: float) -> Colour:
    """Colour of a contracting (1), resting (0) or extending (-1) muscle in films: red, grey, blue (Moreland 2009)."""
    end, share = (_CONTRACTS if activation > 0.0 else _EXTENDS), min(abs(activation), 1.0)
    red, green, blue = (rest + share * (full - rest) for rest, full in zip(_RESTS, end, strict=True))
    return red, green, blue
