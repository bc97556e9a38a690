"""Target paths: horizontal, from rest, of any length."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import count, islice
from typing import TYPE_CHECKING, Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.tasks.quintic import quintic

if TYPE_CHECKING:
    from scipy.interpolate import BPoly

PathShape = Literal["straight", "arc", "s-curve", "random"]

INTERVAL = 0.4
"""Time between two states [s]. The first interval is a straight run-up from rest; the named shape begins after it."""

_TURN_RATE = 0.5  # [rad/s] of the arc: an eighth of a turn in an episode of 200 frames
_PERIOD = 1.6  # [s] of the S-curve: an episode of 200 frames
_SLALOM = 1 / 8  # amplitude of the S-curve per wavelength: its direction deviates by up to atan(pi / 4), 38 degrees
_LARGEST_TURN = math.radians(30.0)  # of the random path, in an interval
_SPEED_RANGE = (0.5, 1.5)  # of the random path, relative to `speed`
_ZERO = np.zeros(3)


@dataclass(frozen=True)
class Path:
    """A path from the origin that begins along x; y is up and left is -z.

    The speed scales the path in space and not in time. Its beginning does not depend on its length.

    * `straight`: ahead.
    * `arc`: a circle to the left, at 0.5 rad/s.
    * `s-curve`: a slalom of period 1.6 s that begins to the left and deviates from its axis by up to 38 degrees.
    * `random`: every 0.4 s another direction, up to 30 degrees from the last, and another speed, 0.5 to 1.5 of `speed`.

    Attributes:
        speed: after the run-up, of the S-curve along its axis [m/s].
        seed: of the random path.

    Raises:
        UsageError: the speed is not positive, or the seed is negative.
    """

    shape: PathShape
    speed: float
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.speed > 0.0 or self.seed < 0:
            raise UsageError(
                f"A path of {self.speed:g} m/s with seed {self.seed} is not possible. "
                "Give a positive speed and a seed from 0 upwards."
            )

    def positions(self, times: Array) -> Array:
        """Positions of the target `[times, 3]` [m] at `times` from 0 [s]."""
        return np.asarray(_course(self, self._state_count(times))(times))

    def velocities(self, times: Array) -> Array:
        """Velocities of the target `[times, 3]` [m/s], the first derivative of `positions`."""
        return np.asarray(_velocity(self, self._state_count(times))(times))

    def states(self, number: int) -> Array:
        """The first states of the path, `INTERVAL` apart `[number, 3, 3]`, as `quintic` takes them."""
        return np.array(list(islice(self._random() if self.shape == "random" else self._curve(), number)))

    @staticmethod
    def _state_count(times: Array) -> int:
        # one more state than needed, so that rounding cannot end the path before the last time
        return math.ceil(float(times.max()) / INTERVAL) + 2

    def _curve(self) -> Iterator[Array]:
        """States of a curve with constant `speed` after the run-up."""
        yield np.zeros((3, 3))
        yield self._run_up()
        for number in count(1):
            state = self.speed * _POINTS[self.shape](number * INTERVAL)
            state[0] += self._run_up()[0]
            yield state

    def _random(self) -> Iterator[Array]:
        rng = np.random.default_rng(self.seed)
        angle = 0.0
        yield np.zeros((3, 3))
        state = self._run_up()
        while True:
            yield state
            angle += rng.uniform(-_LARGEST_TURN, _LARGEST_TURN)
            speed = self.speed * rng.uniform(*_SPEED_RANGE)
            velocity = speed * np.array([math.cos(angle), 0.0, -math.sin(angle)])
            state = np.array([state[0] + INTERVAL * (state[1] + velocity) / 2, velocity, _ZERO])

    def _run_up(self) -> Array:
        """The state after the run-up, whose speed grows symmetrically about its middle: half of the way is done."""
        ahead = np.array([1.0, 0.0, 0.0])
        return self.speed * np.array([INTERVAL / 2 * ahead, ahead, _ZERO])


# kept, because closed loops ask for the target in every frame
@lru_cache(maxsize=64)
def _course(path: Path, number: int) -> "BPoly":
    """The path through its first states."""
    return quintic(INTERVAL * np.arange(float(number)), path.states(number))


@lru_cache(maxsize=64)
def _velocity(path: Path, number: int) -> "BPoly":
    """The derivative of `_course`."""
    return _course(path, number).derivative()


def _straight(seconds: float) -> Array:
    """Position, velocity and acceleration at unit speed."""
    return np.array([[seconds, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def _arc(seconds: float) -> Array:
    rate = _TURN_RATE
    sine, cosine = math.sin(rate * seconds), math.cos(rate * seconds)
    return np.array(
        [
            [sine / rate, 0.0, (cosine - 1.0) / rate],
            [cosine, 0.0, -sine],
            [-rate * sine, 0.0, -rate * cosine],
        ]
    )


def _s_curve(seconds: float) -> Array:
    rate, amplitude = 2.0 * math.pi / _PERIOD, _SLALOM * _PERIOD
    sine, cosine = math.sin(rate * seconds), math.cos(rate * seconds)
    return np.array(
        [
            [seconds, 0.0, amplitude * (cosine - 1.0)],
            [1.0, 0.0, -amplitude * rate * sine],
            [0.0, 0.0, -amplitude * rate**2 * cosine],
        ]
    )


_POINTS = {"straight": _straight, "arc": _arc, "s-curve": _s_curve}
