"""Muscle groups and fibres derived from the shape of a body."""

from dataclasses import dataclass

import numpy as np

from zoobench.arrays import Array

_ROUNDS = 100  # limit of k-means iterations; it converges earlier
_ELONGATED = 1.3  # least ratio of the longest to the second longest spread for an axis of its own


@dataclass(frozen=True)
class Grouping:
    """Groups around centres: a point belongs to the nearest centre.

    Attributes:
        centres: `[group_count, 3]` [m], from the tail.
        directions: unit vectors of the fibres `[group_count, 3]`.
        metric: linear map of points before distances are measured `[3, 3]`; of rank one for slices.
    """

    centres: Array
    directions: Array
    metric: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the muscles, numbered from the tail."""
        return tuple(f"muscle-{number + 1}" for number in range(len(self.centres)))

    def distances(self, points: Array) -> Array:
        """Distances of points `[n, 3]` from every centre `[n, group_count]` [m]."""
        gap = (points[:, None, :] - self.centres) @ self.metric
        found: Array = np.linalg.norm(gap, axis=2)
        return found

    def membership(self, points: Array) -> Array:
        """The share of each muscle `[n, group_count]`: 1 for the nearest centre."""
        found: Array = np.eye(len(self.centres))[self.distances(points).argmin(axis=1)]
        return found

    def fibres(self, points: Array) -> Array:
        """Unit directions `[n, 3]`, means of the groups' directions weighted by 1 / distance^2.

        The mean of lines is the first principal axis of the sum of the directions' outer products, which does not
        depend on their signs.
        """
        weights = 1.0 / (self.distances(points) ** 2 + 1e-12)
        outer = self.directions[:, :, None] * self.directions[:, None, :]
        found: Array = np.linalg.eigh(np.einsum("ng,gij->nij", weights, outer))[1][:, :, 2]
        return np.where(found @ self.directions.sum(axis=0) < 0.0, -1.0, 1.0)[:, None] * found


def k_means(points: Array, count: int) -> Grouping:
    """Compact groups of points `[n, 3]` by Lloyd's algorithm, deterministic.

    The initial centres are the rearmost point and then, one by one, the point farthest from the centres so far.
    """
    centres = points[[np.lexsort(points.T[::-1])[0]]]
    while len(centres) < count:
        gap = np.linalg.norm(points[:, None] - centres, axis=2).min(axis=1)
        centres = np.vstack([centres, points[gap.argmax()]])
    owner = np.full(len(points), -1)
    for _ in range(_ROUNDS):
        nearest = np.linalg.norm(points[:, None] - centres, axis=2).argmin(axis=1)
        if (nearest == owner).all():
            break
        owner = nearest
        centres = np.stack([points[owner == n].mean(axis=0) for n in range(count)])
    order = np.lexsort(np.round(centres, 9).T[::-1])
    own = [points[owner == n] for n in order]
    return Grouping(centres[order], _directions(points, own), np.eye(3))


def slices(points: Array, count: int) -> Grouping:
    """Slices of equal length along the longest principal axis of points `[n, 3]`."""
    axis = _body_axis(points)
    middle = points.mean(axis=0)
    along = (points - middle) @ axis
    edges = np.linspace(along.min(), along.max(), count + 1)
    centres = middle + ((edges[:-1] + edges[1:]) / 2)[:, None] * axis
    return Grouping(centres, np.tile(axis, (count, 1)), np.outer(axis, axis))


def _directions(points: Array, groups: list[Array]) -> Array:
    """Unit vectors `[group_count, 3]`: a long group's own axis, or that of the body, with agreeing signs."""
    body = _body_axis(points)
    found = []
    for group in groups:
        axis, elongation = _main_axis(group)
        axis = axis if elongation >= _ELONGATED else body
        found.append(axis if axis @ body >= 0.0 else -axis)
    return np.array(found)


def _body_axis(points: Array) -> Array:
    """The long axis of a body `[3]`, or ahead if it has none."""
    axis, elongation = _main_axis(points)
    return axis if elongation >= _ELONGATED else np.array([1.0, 0.0, 0.0])


def _main_axis(points: Array) -> tuple[Array, float]:
    """The direction of the largest spread `[3]`, pointing ahead, and its ratio to the second largest."""
    spreads, axes = np.linalg.eigh(np.cov(points.T) if len(points) > 1 else np.eye(3))
    axis: Array = axes[:, 2]
    sign = axis[np.abs(axis).argmax()] if abs(axis[0]) < 1e-6 else axis[0]
    return (axis if sign > 0.0 else -axis), float(np.sqrt(spreads[2] / max(spreads[1], 1e-30)))
