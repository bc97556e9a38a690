"""The ground's profile along the way: a slope, steps and gaps, with or without hills."""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array
from zoobench.envs.hills import Hills
from zoobench.errors import UsageError
from zoobench.sim.model.terrain import Terrain

_POINTS_PER_EDGE = 6
"""Points of the height field along an edge: the spline between them overshoots by less than 1 % of the height."""

_STEEPEST = 45.0
_FEWEST_POINTS = 4


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Slope, steps and gaps of the ground; they run along z, and the robot starts halfway between two of each.

    * `slope`: angle at which the ground rises along x [degrees], up to 45; negative falls.
    * `step_height`: rise of each step of a staircase along x [m]; negative falls, 0 is no steps.
    * `step_length`: from one step to the next [m].
    * `gap_depth`: of gaps in the ground [m]; 0 is no gaps.
    * `gap_width`: of each gap, at half its depth [m].
    * `gap_distance`: from the middle of one gap to that of the next [m].
    * `edge`: length over which a step or a side of a gap rises [m]; a grid that is coarser is refused.
    """

    slope: float = 0.0
    step_height: float = 0.0
    step_length: float = 0.2
    gap_depth: float = 0.0
    gap_width: float = 0.05
    gap_distance: float = 0.25
    edge: float = 0.02

    def __post_init__(self) -> None:
        if not abs(self.slope) <= _STEEPEST:
            raise UsageError(f"A slope of {self.slope:g} degrees is too steep. Give -{_STEEPEST:g} to {_STEEPEST:g}.")
        if self.gap_depth < 0.0:
            raise UsageError(f"A gap_depth of {self.gap_depth:g} m would be a ridge. Give 0 or more.")
        if not 0.0 < self.edge <= min(self.step_length, self.gap_width, self.gap_distance - self.gap_width):
            raise UsageError(
                f"Steps every {self.step_length:g} m and gaps of {self.gap_width:g} m every {self.gap_distance:g} m "
                f"have no room for edges of {self.edge:g} m. Give a positive edge that is not longer than step_length, "
                "gap_width, and the ground between two gaps."
            )

    @property
    def is_level(self) -> bool:
        """Whether there is neither slope nor step nor gap."""
        return not (self.slope or self._has_edges)

    @property
    def _has_edges(self) -> bool:
        return bool(self.step_height or self.gap_depth)

    def heights(self, ahead: Array) -> Array:
        """Height [m] at distances `ahead` of the start along x `[n]` [m], 0 at the start."""
        rise = np.tan(np.radians(self.slope)) * ahead
        step = np.round(ahead / self.step_length - 0.5)
        past = ahead - (step + 0.5) * self.step_length
        steps = self.step_height * (step + _ramp(past / self.edge))
        gap = np.abs(ahead - (np.round(ahead / self.gap_distance - 0.5) + 0.5) * self.gap_distance)
        gaps = -self.gap_depth * (1.0 - _ramp((gap - self.gap_width / 2) / self.edge))
        total: Array = rise + steps + gaps
        return total

    def terrain(self, size: tuple[float, float], start: tuple[float, float], hills: Hills) -> Terrain | None:
        """The terrain of an arena of this size along x and z [m]; None if it is level.

        Args:
            start: place of the robot's start along x and z [m].
            hills: on top of the profile.
        """
        bare = hills.terrain(size, start)
        if self.is_level:
            return bare
        spacings = [bare.spacing] if bare else []
        spacing = min([*spacings, self.edge / _POINTS_PER_EDGE if self._has_edges else max(size) / _FEWEST_POINTS])
        counts = [max(_FEWEST_POINTS, int(np.ceil(length / spacing - 1e-9)) + 1) for length in size]
        x, z = (spacing * np.arange(count, dtype=np.float64) for count in counts)
        heights = np.repeat(self.heights(x - start[0])[:, None], len(z), axis=1)
        if bare:
            heights = heights + bare.heights_at(x, z)
        return Terrain(heights - heights.min(), spacing, self.edge if self._has_edges else np.inf)


LEVEL_WAY = Profile()


def _ramp(place: Array) -> Array:
    """A smooth rise from 0 to 1 between places -1/2 and 1/2 [edges]."""
    t = np.clip(place + 0.5, 0.0, 1.0)
    rise: Array = t * t * (3.0 - 2.0 * t)
    return rise
