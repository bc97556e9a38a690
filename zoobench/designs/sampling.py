"""Sampling of solids: the same solid at every resolution, in particles for the solid part of each cube of a lattice."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import cell_points, fill_box, too_small

_MEASURE_CELLS = 100  # along the longest edge when a volume is measured: an error of 0.1 % on rounded shapes
_LEAST_POINTS = 24  # in a cube
_BLOCK = 40_000  # points that are examined at once, which the processor's cache holds

_SLIVER = 1 / 8
"""Share of a cube below which its matter joins that of the next cube: a particle of it would cost as much as a full
one, and change nothing."""

_NEXT = 1.13  # [edges] to the next cubes, those of the face-centred lattice included
_WHOLE = 0.98  # share of a cube that counts as full
_AROUND = 1.8  # [edges] to the cubes around a cube
_THIN = 0.05  # share of a body that is thinner than two particles, above which it is said


@dataclass(frozen=True)
class SolidSample:
    """A solid in particles, and the points by which it was measured.

    Attributes:
        positions: `[particle_count, 3]` centres of the solid parts of the particles' cubes [m].
        volumes: `[particle_count]` of the same [m^3].
        sites: `[particle_count, 3]` centres of the cubes [m].
        edge: of the cubes [m].
        points: `[point_count, 3]` in the solid [m], those of a particle in a row.
        weights: `[point_count]` the share of a cube that each stands for [-].
        first: `[particle_count]` the index of each particle's first point.
        notes: the parts that the resolution cannot represent, as sentences.
    """

    positions: Array
    volumes: Array
    sites: Array
    edge: float
    points: Array
    weights: Array
    first: NDArray[np.int64]
    notes: tuple[str, ...] = ()

    @classmethod
    def filled(cls, sites: Array, edge: float) -> Self:
        """Full cubes at these sites `[particle_count, 3]` [m]."""
        count = len(sites)
        return cls(sites, np.full(count, edge**3), sites, edge, sites, np.ones(count), np.arange(count))

    def of_volume(self, volume: float) -> Self:
        """The same with this volume in all [m^3]: faces along the lattice are measured worst, and are known."""
        return replace(self, volumes=self.volumes * (volume / self.volumes.sum()))

    def mean(self, values: Array) -> Array:
        """Means over the solid in every cube `[particle_count, ...]` of values at the points `[point_count, ...]`."""
        weights = self.weights.reshape(-1, *[1] * (values.ndim - 1))
        total = np.add.reduceat(weights * values, self.first, axis=0)
        found: Array = total / np.add.reduceat(weights, self.first, axis=0)
        return found

    def mostly(self, mask: Mask) -> Mask:
        """Whether more than half of the solid in every cube `[particle_count]` has a mark `[point_count]`."""
        return np.asarray(self.mean(mask.astype(float)) > 0.5 + 1e-9)

    def ends(self, distance: float) -> dict[str, Mask]:
        """`head` and `tail` `[particle_count]`: particles mostly farther ahead of x = 0, or behind, than this [m]."""
        along = self.points[:, 0]
        return {"head": self.mostly(along > distance), "tail": self.mostly(along < -distance)}

    def direction(self, fibres: Array, shares: Array) -> Array:
        """Unit directions `[particle_count, 3]`: means of fibres `[point_count, 3]` by their share of muscle.

        Where fibres of opposite signs cancel out, as on the middle plane of an animal, it is the first principal axis
        of their outer products, which does not depend on signs.

        Args:
            fibres: unit vectors.
            shares: of all muscles together `[point_count]` [-]; passive tissue counts where there is nothing else.
        """
        shares = shares + 1e-6
        found = self.mean(fibres * shares[:, None]) / self.mean(shares)[:, None]
        bounds = np.append(self.first, len(fibres))
        for particle in np.flatnonzero(np.linalg.norm(found, axis=1) < 0.5):
            own = slice(bounds[particle], bounds[particle + 1])
            lines = (fibres[own] * (self.weights * shares)[own, None]).T @ fibres[own]
            axis = np.linalg.eigh(lines)[1][:, 2]
            found[particle] = -axis if axis @ found[particle] < 0.0 else axis
        unit: Array = found / np.linalg.norm(found, axis=1, keepdims=True)
        return unit


@dataclass(frozen=True)
class Shape:
    """A solid within the box `lower` to `upper` [m].

    Attributes:
        inside: maps points `[n, 3]` [m] to a mask `[n]`, or to the share of space that is solid there.
            It is asked for points beyond the box, too, where nothing is solid.
        points: about, in the box, by which it is sampled: 300 000 give muscles of a tenth of it to 1 %.
        level: height of the plane about which a swimmer is drawn [m], None for what stands. In its rest frame its
            points are alike above and below: by 1 % of a cube's volume a shark that turns pitches.
    """

    inside: Callable[[Array], Mask | Array]
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    points: int = 300_000
    level: float | None = None

    @classmethod
    def standing(cls, inside: Callable[[Array], Mask | Array], length: float, height: float, width: float) -> "Shape":
        """A solid in a box of this size [m] that stands on y = 0, centred in x and z."""
        return cls(inside, (-length / 2, 0.0, -width / 2), (length / 2, height, width / 2))

    def volume(self) -> float:
        """The volume [m^3], measured once on a fine lattice."""
        return self._volume

    @cached_property
    def _volume(self) -> float:
        lower, upper = np.array(self.lower), np.array(self.upper)
        spacing = float((upper - lower).max()) / _MEASURE_CELLS
        points = fill_box(lower, upper, spacing, 1)
        return float(self.inside(points).sum()) * spacing**3

    def sample(self, fidelity: Fidelity) -> SolidSample:
        """The particles of a resolution.

        Each stands for a cube of a lattice that starts at the lower y and is centred in x and z, so that a symmetric
        solid stays symmetric, and has the volume and the centre of its solid part. So mass, muscles, length and
        clearance are those of the solid at every resolution. Slivers join the next cube.

        Raises:
            SceneError: the solid is shorter than a cell, or nothing of it was found.
        """
        size = np.subtract(self.upper, self.lower)
        if size.max() < (1.0 - 1e-9) * fidelity.grid_spacing:
            edges = " x ".join(f"{edge:.3g}" for edge in size)
            raise SceneError(
                f"A body of {edges} m is shorter than a cell of {fidelity.grid_spacing:.4g} m. Use a finer fidelity or "
                "a larger body."
            )
        sites, edge = self.lattice(fidelity), fidelity.particle_edge
        points, weights, owner = self._points(sites, fidelity)
        if not len(points):
            raise too_small("body", np.subtract(self.upper, self.lower), fidelity.grid_spacing)
        fill: Array = np.bincount(owner, weights, len(sites)).astype(np.float64)
        owner = _without_slivers(sites, edge, points, owner, fill)
        order = np.argsort(owner, kind="stable")
        points, weights = points[order], weights[order]
        own, first = np.unique(owner[order], return_index=True)
        fill = np.add.reduceat(weights, first)
        centres = np.add.reduceat(weights[:, None] * (points - sites[owner[order]]), first) / fill[:, None]
        volumes, sites = fill * edge**3, sites[own]
        notes = _notes(sites, fill, fidelity)
        return SolidSample(sites + centres, volumes, sites, edge, points, weights, first, notes)

    def _points(self, sites: Array, fidelity: Fidelity) -> tuple[Array, Array, NDArray[np.int64]]:
        """Points in the solid `[n, 3]` [m], the share of a cube that each stands for, and its site `[n]`."""
        middle, count = (np.array(self.lower) + self.upper) / 2, max(_LEAST_POINTS, self.points // len(sites))
        spacing, per_cell, step = fidelity.grid_spacing, fidelity.particles_per_cell, max(1, _BLOCK // count)
        upside_down = self.level is not None and fidelity.robot == "lagrangian"
        if upside_down:
            middle[1] = self.level
        found: list[tuple[Array, Array, NDArray[np.int64]]] = []
        for n in range(0, len(sites), step):
            block = cell_points(sites[n : n + step], middle, spacing, per_cell, count, upside_down=upside_down)
            own = np.isfinite(block[..., 0])
            points, counts = block[own], own.sum(axis=1)
            weights = np.asarray(self.inside(points), float) / np.repeat(counts, counts)
            solid = np.flatnonzero(weights > 0.0)
            owner = np.repeat(np.arange(n, n + len(block)), counts)
            found.append((points[solid], weights[solid], owner[solid]))
        points, weights, owners = (np.concatenate(column) for column in zip(*found, strict=True))
        return points, weights, owners

    def lattice(self, fidelity: Fidelity) -> Array:
        """The sites of the cubes that cover the box `[site_count, 3]` [m], rounded up to whole cells."""
        lower, upper = np.array(self.lower), np.array(self.upper)
        cells = whole_cells(upper - lower, fidelity)
        # the cells of a face-centred lattice have matter whose site is in the next one
        rim = fidelity.grid_spacing if fidelity.particles_per_cell == 4 else 0.0
        start = (lower + upper) / 2 - cells * fidelity.grid_spacing / 2
        start[1] = lower[1]
        end = start + cells * fidelity.grid_spacing
        return fill_box(start - rim, end + rim, fidelity.grid_spacing, fidelity.particles_per_cell)


def whole_cells(extent: Array, fidelity: Fidelity) -> Array:
    """Cells `[3]` along the edges of a box `[3]` [m], rounded up, in which no particle is on both sides of a body."""
    cells: Array = np.ceil(extent / fidelity.grid_spacing - 1e-9)
    if fidelity.particles_per_cell == 27:  # three in a row: a cube on the middle plane would be of both sides
        cells[2] += cells[2] % 2
    return cells


def _without_slivers(
    sites: Array, edge: float, points: Array, owner: NDArray[np.int64], fill: Array
) -> NDArray[np.int64]:
    """The site of every point `[point_count]` when slivers have joined the fuller cube that they touch, if any.

    Args:
        sites: `[site_count, 3]` [m].
        edge: of a cube [m].
        points: in the solid `[point_count, 3]` [m].
        owner: the site of each `[point_count]`.
        fill: the share of every cube that is solid `[site_count]`.
    """
    from scipy.spatial import KDTree

    slivers, hosts = np.flatnonzero((fill > 0.0) & (fill < _SLIVER)), np.flatnonzero(fill >= _SLIVER)
    if not len(slivers) or not len(hosts):
        return owner
    counts = np.maximum(np.bincount(owner, minlength=len(sites)), 1)[slivers, None]
    sums = np.stack([np.bincount(owner, column, len(sites)) for column in points.T], axis=1)
    gaps, found = KDTree(sites[hosts]).query(sums[slivers] / counts, k=2)
    nearest = hosts[found[:, 0]]
    touches = np.linalg.norm(sites[nearest] - sites[slivers], axis=1) < _NEXT * edge
    joins = touches & (gaps[:, 1] - gaps[:, 0] > 1e-6 * edge)  # in the middle of two, it would break the symmetry
    host = np.arange(len(sites))
    host[slivers[joins]] = nearest[joins]
    return host[owner]


def _notes(sites: Array, fill: Array, fidelity: Fidelity) -> tuple[str, ...]:
    """A note on thin parts of a body with these sites `[n, 3]` [m] and shares of cubes `[n]`; empty without them."""
    from scipy.spatial import KDTree

    whole, edge = fill > _WHOLE, fidelity.particle_edge
    share = 1.0
    if whole.any():
        gaps = KDTree(sites[whole]).query(sites, distance_upper_bound=_AROUND * edge)[0]
        share = float(fill[~np.isfinite(gaps)].sum() / fill.sum())
    if share <= _THIN:
        return ()
    return (
        f"At a grid spacing of {fidelity.grid_spacing:.4g} m, {100 * share:.0f} % of the body is thinner than two "
        f"particles, {2e3 * edge:.2g} mm: it has its mass, but how it bends is not resolved.",
    )
