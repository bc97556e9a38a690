"""Muscle groups and fibres derived from the shape of a body."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.sampling import Shape
from zoobench.errors import SceneError, UsageError
from zoobench.sim.model.fidelity import Fidelity

_POINTS = 4000  # about, from which the groups of a body are computed
_ROUNDS = 100  # limit of k-means iterations; it converges earlier
_ELONGATED = 1.3  # least ratio of the longest to the second longest spread for an axis of its own


Scheme = Literal["paired", "k-means", "axis"]

MOST = 32
"""Largest number of groups; a file may name more muscles."""

_QUARTERS = ("left-bottom", "left-top", "right-bottom", "right-top")
_MIDDLE = 0.02  # of the width: a row whose middle is this close to the body's middle plane is divided there


def check_count(scheme: Scheme, count: int) -> None:
    """Check the number of muscles of a scheme.

    Raises:
        UsageError: it is none, too many, or cannot be divided into quarters.
    """
    if not 1 <= count <= MOST:
        raise UsageError(f"A body with {count} muscles cannot be. Give 1 to {MOST} muscles.")
    if scheme == "paired" and count % len(_QUARTERS):
        raise UsageError(
            f"{count} muscles cannot be paired: each row has four, left and right, bottom and top. Give a multiple of "
            "4, such as muscles=12, or grouping=k-means."
        )


def check_used(membership: Array, names: tuple[str, ...], fidelity: Fidelity, design: str) -> None:
    """Check that every muscle has a particle.

    Raises:
        SceneError: one has none.
    """
    if empty := [name for name, share in zip(names, membership.T, strict=True) if not share.any()]:
        raise SceneError(
            f"The body of {design!r} has no particle for {', '.join(empty)} at a grid spacing of "
            f"{fidelity.grid_spacing:.4g} m. Use fewer muscles, a finer fidelity or a larger length."
        )


@dataclass(frozen=True)
class PairedGroups:
    """Rows from the tail to the head, each divided into left and right, bottom and top: they bend and twist the body.

    Attributes:
        edges: between rows along x `[row_count - 1]` [m].
        middles: of every row along y and z `[row_count, 2]` [m].
    """

    edges: Array
    middles: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names such as `row-1-left-bottom`, row by row from the tail."""
        return tuple(f"row-{row + 1}-{quarter}" for row in range(len(self.middles)) for quarter in _QUARTERS)

    def membership(self, points: Array) -> Array:
        """The share of each muscle `[n, muscle_count]`; points between two belong to both, so that no body turns."""
        row = np.searchsorted(self.edges, points[:, 0])
        up, right = ((1.0 + np.sign(np.round(points[:, 1:] - self.middles[row], 9))) / 2).T
        sides, heights = np.stack([1.0 - right, right], axis=1), np.stack([1.0 - up, up], axis=1)
        rows = np.eye(len(self.middles))[row]
        found: Array = np.einsum("nr,ns,nh->nrsh", rows, sides, heights)
        return found.reshape(len(points), -1)

    def fibres(self, points: Array) -> Array:
        """Along the body `[n, 3]`."""
        return np.tile([1.0, 0.0, 0.0], (len(points), 1))


def paired(points: Array, count: int) -> PairedGroups:
    """Rows of equal volume along x of points `[n, 3]`, the quarters of each of equal volume.

    Raises:
        SceneError: a row has no point.
    """
    rows = count // len(_QUARTERS)
    edges = np.quantile(points[:, 0], np.arange(1, rows) / rows)
    row = np.searchsorted(edges, points[:, 0])
    if len(np.unique(row)) < rows:
        raise SceneError(
            f"The body is too short along `ahead` for {rows} rows of muscles. Give fewer muscles, such as muscles=4, "
            "another direction, or grouping=k-means."
        )
    middles = np.array([np.median(points[row == n, 1:], axis=0) for n in range(rows)])
    low, high = points[:, 2].min(), points[:, 2].max()
    is_central = np.abs(middles[:, 1] - (low + high) / 2) < _MIDDLE * (high - low)
    middles[:, 1] = np.where(is_central, (low + high) / 2, middles[:, 1])
    return PairedGroups(edges, middles)


@dataclass(frozen=True)
class CentredGroups:
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


def k_means(points: Array, count: int) -> CentredGroups:
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
        groups = [points[owner == n] for n in range(count)]
        # a group may be left without points, as where there are fewer than groups
        centres = np.stack([own.mean(axis=0) if len(own) else centres[n] for n, own in enumerate(groups)])
    order = np.lexsort(np.round(centres, 9).T[::-1])
    own = [points[owner == n] for n in order]
    return CentredGroups(centres[order], _directions(points, own), np.eye(3))


def slices(points: Array, count: int) -> CentredGroups:
    """Slices of equal length along the longest principal axis of points `[n, 3]`."""
    axis = _body_axis(points)
    middle = points.mean(axis=0)
    along = (points - middle) @ axis
    edges = np.linspace(along.min(), along.max(), count + 1)
    centres = middle + ((edges[:-1] + edges[1:]) / 2)[:, None] * axis
    return CentredGroups(centres, np.tile(axis, (count, 1)), np.outer(axis, axis))


Grouping = PairedGroups | CentredGroups
"""Muscle groups and fibres as functions of place."""


def group(scheme: Scheme, shape: Shape, volume: float, count: int) -> Grouping:
    """The groups of a scheme for a solid of this volume [m^3].

    They are computed on a lattice of their own, so that they do not depend on the fidelity.
    """
    lattice = shape.lattice(Fidelity((volume / _POINTS) ** (1 / 3), particles_per_cell=1))
    points = lattice[np.asarray(shape.inside(lattice), float) > 0.0]
    if scheme == "paired":
        return paired(points, count)
    return (k_means if scheme == "k-means" else slices)(points, count)


def _directions(points: Array, groups: list[Array]) -> Array:
    """Unit vectors `[group_count, 3]`: a long group's own axis, or that of the body, with agreeing signs."""
    body = _body_axis(points)
    found = []
    for group in groups:
        axis, elongation = main_axis(group)
        axis = axis if elongation >= _ELONGATED else body
        found.append(axis if axis @ body >= 0.0 else -axis)
    return np.array(found)


def _body_axis(points: Array) -> Array:
    """The long axis of a body `[3]`, or ahead if it has none."""
    axis, elongation = main_axis(points)
    return axis if elongation >= _ELONGATED else np.array([1.0, 0.0, 0.0])


def main_axis(points: Array) -> tuple[Array, float]:
    """The direction of the largest spread of points `[n, 3]`, pointing ahead `[3]`, and its ratio to the second."""
    spreads, axes = np.linalg.eigh(np.cov(points.T) if len(points) > 1 else np.eye(3))
    axis: Array = axes[:, 2]
    sign = axis[np.abs(axis).argmax()] if abs(axis[0]) < 1e-6 else axis[0]
    return (axis if sign > 0.0 else -axis), float(np.sqrt(spreads[2] / max(spreads[1], 1e-30)))
