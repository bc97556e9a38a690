"""Target paths from a user's file: points in time, joined smoothly."""

import csv
import io
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.inputs import path_of, read
from zoobench.tasks.quintic import quintic

if TYPE_CHECKING:
    from scipy.interpolate import BPoly

_COLUMNS = ("t", "x", "z")
_FORM = "Write a header `t,x,z` and below it a line for each point: time [s] from 0 upwards, x and z [m]."


@dataclass(frozen=True)
class FilePath:
    """A path through the points of a file, moved so that it begins at the origin; x is ahead, z to the right.

    Position, velocity and acceleration are continuous. At each point they are those of the parabola through it and its
    neighbours, at the ends those of the last parabola; between two points runs a polynomial of degree five.

    Attributes:
        file: a CSV file with the columns t [s], x and z [m], with or without digest.

    Raises:
        UsageError: the file cannot be read, has changed, or holds no path.
    """

    file: str

    def __post_init__(self) -> None:
        _ = self._curve  # reads the file

    @property
    def seconds(self) -> float:
        """Duration of the path [s]."""
        return float(self._curve.x[-1])

    def positions(self, times: Array) -> Array:
        """Positions of the target `[times, 3]` [m] at `times` from 0 [s]."""
        return np.asarray(self._curve(self._within(times)))

    def velocities(self, times: Array) -> Array:
        """Velocities of the target `[times, 3]` [m/s], the first derivative of `positions`."""
        return np.asarray(self._curve.derivative()(self._within(times)))

    @cached_property
    def _curve(self) -> "BPoly":
        name = path_of(self.file).name
        times, places = _points(read(self.file), name)
        with np.errstate(over="ignore", invalid="ignore"):
            states = _states(times, places - places[0])
        if not np.isfinite(states).all():
            raise UsageError(
                f"The path in {name!r} has velocities that are no finite numbers. Check its units. {_FORM}"
            )
        return quintic(times, states)

    def _within(self, times: Array) -> Array:
        """The times, the last of them not later than the path's end for rounding.

        Raises:
            UsageError: the path ends before the last time.
        """
        if times.max() > self.seconds * (1.0 + 1e-9):
            raise UsageError(
                f"The path in {path_of(self.file).name!r} ends at {self.seconds:g} s, and the episode takes "
                f"{times.max():g} s. Add points to it, or give fewer frames."
            )
        return np.minimum(times, self.seconds)


def _points(content: bytes, name: str) -> tuple[Array, Array]:
    """Times `[points]` and places `[points, 3]` from a file's content.

    Raises:
        UsageError: the content is no such table.
    """
    try:
        header, *lines = csv.reader(io.StringIO(content.decode("utf-8-sig")), strict=True)
    except (UnicodeDecodeError, csv.Error, ValueError):
        raise UsageError(f"The file {name!r} is no table in CSV. {_FORM}") from None
    columns = [title.strip() for title in header]
    if sorted(columns) != sorted(_COLUMNS):
        raise UsageError(f"The file {name!r} has the columns {', '.join(columns)}. {_FORM}")
    rows = [(number, line) for number, line in enumerate(lines, 2) if any(cell.strip() for cell in line)]
    table = np.array([_numbers(line, number, name) for number, line in rows]).reshape(-1, len(_COLUMNS))
    times, x, z = (table[:, columns.index(title)] for title in _COLUMNS)
    if len(times) < 2:
        raise UsageError(f"The file {name!r} has {len(times)} points, and a path needs two. {_FORM}")
    if times[0] != 0.0:
        raise UsageError(f"The path in {name!r} begins at {times[0]:g} s. Its first time must be 0.")
    if (late := np.flatnonzero(np.diff(times) <= 0.0)).size:
        number, before, time = rows[late[0] + 1][0], times[late[0]], times[late[0] + 1]
        raise UsageError(f"Line {number} of {name!r}: {time:g} s is not later than {before:g} s before it. Sort them.")
    return times, np.stack([x, np.zeros_like(x), z], axis=1)


def _numbers(line: list[str], number: int, name: str) -> list[float]:
    """The three finite numbers of a line.

    Raises:
        UsageError: it holds something else.
    """
    try:
        values = [float(cell) for cell in line]
    except ValueError:
        values = []
    if len(values) != len(_COLUMNS) or not all(math.isfinite(value) for value in values):
        raise UsageError(
            f"Line {number} of {name!r} is {','.join(line)!r}. Three finite numbers were expected. {_FORM}"
        )
    return values


def _states(times: Array, places: Array) -> Array:
    """Position, velocity and acceleration at all points `[points, 3, 3]`, as `quintic` takes them."""
    slopes = np.diff(places, axis=0) / np.diff(times)[:, None]
    if len(times) == 2:
        velocity = np.repeat(slopes, 2, axis=0)
        return np.stack([places, velocity, np.zeros_like(places)], axis=1)
    before, after = np.diff(times)[:-1, None], np.diff(times)[1:, None]
    acceleration = 2.0 * np.diff(slopes, axis=0) / (before + after)
    inner = (slopes[:-1] * after + slopes[1:] * before) / (before + after)
    first, last = inner[:1] - acceleration[:1] * before[0], inner[-1:] + acceleration[-1:] * after[-1]
    velocity = np.concatenate([first, inner, last])
    return np.stack([places, velocity, np.concatenate([acceleration[:1], acceleration, acceleration[-1:]])], axis=1)
