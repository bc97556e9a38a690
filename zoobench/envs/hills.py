"""Hills: seeded gradient noise (Perlin 1985, with the smooth fade of Perlin 2002) as a height field."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.sim.model.terrain import Terrain

Hashes = NDArray[np.uint64]

OCTAVES = 2
POINTS_PER_WAVE = 8
"""Points of the height field along the shortest wavelength, interpolated by a bicubic spline."""

_LARGEST_NOISE = np.sqrt(0.5)
"""Bound of one octave in two dimensions: attained in the middle of a cell whose four gradients point there."""

_FEWEST_POINTS = 4

_HOME = 1.0  # [m] of the start in the noise, which is 0 at its own origin whatever the seed


def _check(relief: float, wavelength: float, seed: int, octaves: int = OCTAVES) -> None:
    if not 0.0 <= relief < np.inf or not 0.0 < wavelength < np.inf or octaves < 1 or not 0 <= seed < 2**63:
        raise UsageError(
            f"Hills of {relief:g} m, a wavelength of {wavelength:g} m, {octaves} octaves and seed {seed} are not "
            "possible. Give a relief of 0 or more, a positive wavelength, at least 1 octave and a seed from 0 to "
            f"{2**63 - 1}."
        )


@dataclass(frozen=True, kw_only=True)
class Hills:
    """Hills of the ground.

    * `relief`: height of the highest hill [m]; 0 is level.
    * `wavelength`: of the widest hills [m].
    * `terrain_seed`: which hills.
    """

    relief: float = 0.0
    wavelength: float = 0.1
    terrain_seed: int = 0

    def __post_init__(self) -> None:
        _check(self.relief, self.wavelength, self.terrain_seed)

    def terrain(self, size: tuple[float, float], start: tuple[float, float]) -> Terrain | None:
        """The terrain of an arena of this size along x and z, with the robot's start there [m]; None if it is level."""
        return hills(size, start, relief=self.relief, wavelength=self.wavelength, seed=self.terrain_seed)


LEVEL = Hills()


def hills(
    size: tuple[float, float],
    start: tuple[float, float],
    *,
    relief: float,
    wavelength: float,
    seed: int,
    octaves: int = OCTAVES,
) -> Terrain | None:
    """A terrain over an arena of this size along x and z, with the robot's start there [m]; None if it has no relief.

    A seed gives the same hills around the start in an arena of any size.

    Args:
        relief: heights are between 0 and this [m].
        wavelength: of the widest hills [m]; each octave has half the wavelength and height of the one before.
        seed: of the noise.
        octaves: number of octaves.

    Raises:
        UsageError: a negative relief, a wavelength that is not positive, no octave, or a seed that is negative or
            needs more than 63 bits.
    """
    _check(relief, wavelength, seed, octaves)
    if not relief:
        return None
    spacing = wavelength / 2.0 ** (octaves - 1) / POINTS_PER_WAVE
    counts = [max(_FEWEST_POINTS, int(np.ceil(length / spacing)) + 1) for length in size]
    x, z = (
        (spacing * np.arange(count, dtype=np.float64) - place + _HOME) / wavelength
        for count, place in zip(counts, start, strict=True)
    )
    noise = perlin(x[:, None], z[None, :], seed=seed, octaves=octaves)
    return Terrain(relief * (1.0 + noise) / 2.0, spacing)


def perlin(x: Array, z: Array, *, seed: int, octaves: int = 1) -> Array:
    """Gradient noise in [-1, 1] at points in units of the longest wavelength, of the arrays' common shape.

    Its mean over many waves is 0; a single octave is 0 at all points with whole coordinates.
    """
    x, z = np.broadcast_arrays(np.asarray(x, float), np.asarray(z, float))
    total, bound = np.zeros(x.shape), 0.0
    for octave in range(octaves):
        share, scale = 0.5**octave, 2.0**octave
        total += share * _octave(scale * x, scale * z, seed, octave)
        bound += share * _LARGEST_NOISE
    return total / bound


def _octave(x: Array, z: Array, seed: int, octave: int) -> Array:
    """One octave: for each corner a plane through 0 with its gradient, blended between the corners."""
    column, row = np.floor(x), np.floor(z)
    u, w = x - column, z - row
    planes = [
        _plane(column + i, row + k, u - i, w - k, seed, octave) for i in (0, 1) for k in (0, 1)
    ]  # fmt: skip
    along_x, along_z = _fade(u), _fade(w)
    near = planes[0] + along_z * (planes[1] - planes[0])
    far = planes[2] + along_z * (planes[3] - planes[2])
    return near + along_x * (far - near)


def _plane(column: Array, row: Array, u: Array, w: Array, seed: int, octave: int) -> Array:
    """The corner's unit gradient times the distance vector from the corner."""
    angle = 2.0 * np.pi * _uniform(column, row, seed, octave)
    return np.cos(angle) * u + np.sin(angle) * w


def _fade(t: Array) -> Array:
    """6 t^5 - 15 t^4 + 10 t^3, whose first and second derivatives vanish at both ends."""
    return t**3 * (t * (6.0 * t - 15.0) + 10.0)


def _uniform(column: Array, row: Array, seed: int, octave: int) -> Array:
    """A pseudorandom number in [0, 1) for each corner, by integer arithmetic that no library version can change."""
    key = _mix(np.full(column.shape, seed, np.uint64))
    for part in (np.full(column.shape, octave, np.uint64), column.astype(np.int64), row.astype(np.int64)):
        key = _mix(key ^ part.astype(np.uint64))
    return (key >> np.uint64(11)).astype(np.float64) * 2.0**-53


def _mix(key: Hashes) -> Hashes:
    """The finaliser of SplitMix64 (Steele et al. 2014); arithmetic is modulo 2^64."""
    key = key + np.uint64(0x9E3779B97F4A7C15)
    key = (key ^ (key >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    key = (key ^ (key >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return key ^ (key >> np.uint64(31))
