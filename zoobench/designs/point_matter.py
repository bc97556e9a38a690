"""The matter of a cloud's points: the cells of their lattice or, of scattered points, the space between them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask

Indices = NDArray[np.int64]

_OFF = 0.1  # [steps] by which points of a lattice may lie off it
_GAP = 0.05  # [distances of neighbours] from which coordinates differ
_NEIGHBOURS = 0.5  # least share of the next sites that is taken in a lattice
_MOST_CELLS = 50_000_000
_MOST_VOXELS = 2_000_000
_NEAREST = 8  # neighbours from whose distance the spacing of scattered points is known
_ALONE = 3.0  # [spacings] to the next point of a clump
_BRIDGE = 1.5  # [spacings] half the width of a gap between scattered points that is solid: few are wider
_BEYOND = 0.55  # [spacings] by which a solid reaches beyond its outermost points, so that its volume is right


@dataclass(frozen=True)
class Lattice:
    """Points on a lattice along the axes: each stands for a box with the steps as edges.

    On a face-centred lattice, which has every other site of that of its steps, it is a rhombic dodecahedron.

    Attributes:
        start: the site of lowest coordinates `[3]`.
        steps: between sites along each axis `[3]`.
        numbers: of the point at every site `[i, j, k]`, -1 where there is none.
        parity: of the sum of a point's i, j and k on a face-centred lattice; -1 on others.
    """

    start: Array
    steps: Array
    numbers: NDArray[np.int32]
    parity: int

    @classmethod
    def of(cls, points: Array, gap: float) -> Self | None:
        """The lattice of points `[n, 3]`, or None if they are on none.

        Args:
            gap: the usual distance of neighbours.
        """
        start, steps = points.min(axis=0), np.full(3, gap)
        for axis in range(3):
            jumps = np.diff(np.unique(points[:, axis]))
            jumps = jumps[jumps > _GAP * gap]
            if len(jumps):
                extent = float(np.ptp(points[:, axis]))
                steps[axis] = extent / max(1, round(extent / float(np.median(jumps))))
        places = (points - start) / steps
        sites = np.round(places).astype(np.int64)
        counts = sites.max(axis=0) + 1
        if np.abs(places - sites).max() > _OFF or np.prod(counts.astype(float)) > _MOST_CELLS:
            return None
        numbers = np.full(tuple(counts), -1, np.int32)
        numbers[tuple(sites.T)] = np.arange(len(points))
        if (numbers >= 0).sum() < len(points):  # two at one site
            return None
        if (counts == 1).any():  # of a flat one, nothing is known about its thickness
            return None
        sums = sites.sum(axis=1) % 2
        if _taken(numbers >= 0, _FACES) >= _NEIGHBOURS:
            return cls(start, steps, numbers, -1)
        if (sums == sums[0]).all() and _taken(numbers >= 0, _DIAGONALS) >= _NEIGHBOURS:
            return cls(start, steps, numbers, int(sums[0]))
        return None

    @property
    def cell(self) -> float:
        """Volume of a cell."""
        return float(np.prod(self.steps)) * (1.0 if self.parity < 0 else 2.0)

    @property
    def reach(self) -> Array:
        """How far the matter reaches beyond its outermost points `[3]`."""
        return self.steps / 2 if self.parity < 0 else self.steps

    def solid(self, places: Array) -> tuple[Indices, Mask]:
        """The point whose cell each of the places `[n, 3]` is in, and whether it is in one."""
        unit = (places - self.start) / self.steps
        sites = np.round(unit).astype(np.int64)
        if self.parity >= 0:
            odd = np.flatnonzero(sites.sum(axis=1) % 2 != self.parity)
            off = unit[odd] - sites[odd]
            axis = np.abs(off).argmax(axis=1)
            sites[odd, axis] += np.where(off[np.arange(len(odd)), axis] > 0.0, 1, -1)
        within = ((sites >= 0) & (sites < self.numbers.shape)).all(axis=1)
        found = np.full(len(places), -1, np.int64)
        found[within] = self.numbers[tuple(sites[within].T)]
        return np.maximum(found, 0), found >= 0

    def clumps(self) -> Indices:
        """The number of each point's clump `[n]`; sites that share a corner are in one."""
        from scipy.ndimage import label

        labels, _ = label(self.numbers >= 0, np.ones((3, 3, 3)))
        found = np.zeros(int(self.numbers.max()) + 1, np.int64)
        found[self.numbers[self.numbers >= 0]] = labels[self.numbers >= 0]
        return found


_FACES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
_DIAGONALS = ((1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1))


def _taken(sites: Mask, steps: tuple[tuple[int, int, int], ...]) -> float:
    """The mean share of the next sites, in these directions and opposite ones, that is taken."""
    padded = np.pad(sites, 1)
    pairs = sum(int((padded & np.roll(padded, step, axis=(0, 1, 2))).sum()) for step in steps)
    return pairs / (len(steps) * int(sites.sum()))


@dataclass(frozen=True)
class Scattered:
    """Points without a lattice: the solid lies between them and hardly beyond the outermost.

    Balls around the points that leave no hole, whose union is then worn off to near the points (a morphological
    closing, Serra 1982).

    Attributes:
        points: `[n, 3]`.
        spacing: the edge of a cube that holds as much as each of them.
    """

    points: Array
    spacing: float

    @property
    def reach(self) -> Array:
        """How far the matter reaches beyond its outermost points `[3]`."""
        return np.full(3, _BEYOND * self.spacing)

    @cached_property
    def _field(self) -> tuple[Array, Array, float]:
        """How deep voxels lie in the solid, negative outside `[i, j, k]`; the middle of the first, and their edge."""
        from scipy.ndimage import distance_transform_edt

        low, size = self.points.min(axis=0), np.ptp(self.points, axis=0)
        rim = (_BRIDGE + 1.0) * self.spacing
        pitch = max(self.spacing / 2, float(np.prod(size + 2 * rim) / _MOST_VOXELS) ** (1 / 3))
        start = low - rim
        free = np.ones(tuple(np.ceil((size + 2 * rim) / pitch).astype(int) + 1), bool)
        free[tuple(np.round((self.points - start) / pitch).astype(int).T)] = False
        bridge = _BRIDGE * max(self.spacing, pitch)
        away = distance_transform_edt(free, sampling=pitch)
        depth = distance_transform_edt(away <= bridge, sampling=pitch) - pitch / 2
        return depth - (bridge - _BEYOND * self.spacing), start, pitch

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import KDTree

        return KDTree(self.points)

    def solid(self, places: Array) -> tuple[Indices, Mask]:
        """The nearest point to each of the places `[n, 3]`, 0 for those outside, and whether it is in the solid."""
        from scipy.ndimage import map_coordinates

        field, start, pitch = self._field
        within = map_coordinates(field, ((places - start) / pitch).T, order=1, cval=-1.0) > 0.0
        found = np.zeros(len(places), np.int64)
        found[within] = self._tree.query(places[within])[1]
        return found, within


Matter = Lattice | Scattered


def matter_of(points: Array) -> tuple[Matter, Indices]:
    """The matter that points `[n, 3]` represent, and the number of each point's clump `[n]`."""
    labels, spacing, gap = _clumps(points)
    lattice = Lattice.of(points, gap)
    return (Scattered(points, spacing), labels) if lattice is None else (lattice, lattice.clumps())


def _clumps(points: Array) -> tuple[Indices, float, float]:
    """The number of each point's clump `[n]`, the spacing of the points, and the usual distance of neighbours."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    gaps, others = KDTree(points).query(points, k=min(_NEAREST + 1, len(points)))
    # as many lie in a ball of that radius
    spacing = float(np.median(gaps[:, -1])) * (4.0 / 3.0 * np.pi / (gaps.shape[1] - 1)) ** (1 / 3)
    own, near = np.nonzero(gaps <= _ALONE * spacing)
    graph = coo_array((np.ones(len(own), bool), (own, others[own, near])), shape=(len(points), len(points)))
    labels = connected_components(graph, directed=False)[1]
    return np.asarray(labels, np.int64), spacing, float(np.median(gaps[:, 1]))
