"""Parts of a body that are thinner than a particle: found, kept two particles thick, or missed with a word."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.base import Mask, Shape
from zoobench.errors import SceneError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

Thin = Literal["keep", "drop"]
"""What becomes of parts that are thinner than a particle."""

NEAR = 1.75
"""Distance of neighbours, diagonals of a square included [particle edges]."""

THICK = 1.5
"""Thickness that most of a body needs [particles]: with it, a body has two layers wherever its middle lies."""

_MOST = 0.5  # share of the volume that has to be that thick
_LOST = 0.10  # share of a body's extent whose loss is the loss of an end
_SIDES = (("rear", "front"), ("bottom", "top"), ("left", "right"))
# [particle edges] from a surface to the next particle: in solid matter it is less, since every cube of one edge within
# holds a particle, and is so near to the surface even where that is as curved as a ball of one edge
_MISSED = 1.5
_MEASURING_POINTS = 30_000  # about, from which thickness and symmetry are measured
_FINEST = 1 / 200  # of the longest edge: the least spacing of such points
_SPANS = np.arange(1, 65)  # [voxels] edges of the cubes that are tried


@dataclass(frozen=True)
class Sampler:
    """The particles of a solid at any resolution, with its thin parts or without.

    Attributes:
        name: of the body in messages.
        volume: of the solid [m^3].
        surface: gives points of the solid, no farther apart than a distance [m], that cover all its thin parts.
        pieces: gives the number of its connected pieces.
        thin: `keep` makes what is thinner than a particle two particles thick, `drop` leaves it out.
        thickness: how thick how much of it is; None if it need not be thick.
    """

    name: str
    shape: Shape
    volume: float
    surface: Callable[[float], Array]
    pieces: Callable[[], int]
    thin: Thin
    thickness: "Thickness | None"

    def sample(self, fidelity: Fidelity) -> tuple[Array, Array, tuple[str, ...]]:
        """Positions `[particle_count, 3]` [m], volumes `[particle_count]` [m^3], and what became of thin parts.

        Raises:
            SceneError: most of the body is too thin for the grid, or an end of it is lost.
        """
        if self.thickness is not None:
            self.thickness.check(fidelity, self.name)
        lattice = self.shape.lattice(fidelity)
        inside = self.shape.inside(lattice)
        if not inside.any():
            finer = coarsest(lambda grid: bool(self.shape.inside(self.shape.lattice(grid)).any()))
            raise SceneError(
                f"The body of {self.name!r} holds no particle at a grid spacing of {fidelity.grid_spacing:.4g} m. "
                f"Use {finer}, or a larger length."
            )
        kept = self._kept(lattice, inside, fidelity)
        notes = self._notes(lattice, inside, kept, fidelity)
        # thin parts weigh what they have become: at another density the body would float or sink
        volumes = np.full(kept.sum(), self.volume / min(kept.sum(), inside.sum()))
        return lattice[kept], volumes, notes

    def _kept(self, lattice: Array, inside: Mask, fidelity: Fidelity) -> Mask:
        """The places of particles `[place_count]`, with thin parts or without what hangs on them."""
        distance = reach(fidelity)
        if self.thin == "keep":
            return thickened(lattice, inside, self.surface(distance / 2), distance)
        return largest_piece(lattice, inside, self.pieces(), distance)

    def _notes(self, lattice: Array, inside: Mask, kept: Mask, fidelity: Fidelity) -> tuple[str, ...]:
        """What became of thin parts, as sentences.

        Raises:
            SceneError: an end of the body is lost.
        """
        distance, grid = reach(fidelity), f"at a grid spacing of {fidelity.grid_spacing:.4g} m"
        words, is_end = losses(lattice[kept], self.shape, distance)
        if is_end:
            raise SceneError(
                f"The body of {self.name!r} loses {words} {grid}: what is thinner than {1e3 * distance:.2g} mm holds "
                f"no particle. Use thin=keep, {coarsest(self._has_ends)}, or a larger length."
            )
        if words:
            return (f"The body is smaller than in its file {grid}: it lacks {words}.",)
        if not (added := int((kept & ~inside).sum())):
            return ()
        words, _ = losses(lattice[inside], self.shape, distance)
        without = f"; without, it would lack {words}" if words else ""
        share = 100 * added / kept.sum()
        return (
            f"What is thinner than {1e3 * distance:.2g} mm is two particles thick {grid}, {share:.0f} % of the body's "
            f"mass{without}.",
        )

    def _has_ends(self, fidelity: Fidelity) -> bool:
        """Whether the body has its ends at a fidelity as it is."""
        if self.thickness is not None and not self.thickness.is_enough(fidelity):
            return False
        lattice = self.shape.lattice(fidelity)
        kept = self._kept(lattice, self.shape.inside(lattice), fidelity)
        return bool(kept.any()) and not losses(lattice[kept], self.shape, reach(fidelity))[1]


def lattice_within(shape: Shape, volume: float) -> tuple[Array, float]:
    """Lattice points within a solid `[n, 3]` and their spacing, in its unit, to measure it with."""
    size = np.subtract(shape.upper, shape.lower)
    spacing = float(max((volume / _MEASURING_POINTS) ** (1 / 3), _FINEST * size.max()))
    counts = np.maximum(np.ceil(size / spacing - 1e-9), 1).astype(int)
    cells = np.indices(tuple(counts)).reshape(3, -1).T + 0.5
    points = (np.array(shape.lower) + np.array(shape.upper)) / 2 + (cells - counts / 2) * spacing
    return points[shape.inside(points)], spacing


def reach(fidelity: Fidelity) -> float:
    """Distance of neighbouring particles along an axis [m]: every cube of this edge holds a place for a particle."""
    return float(fidelity.grid_spacing / np.floor(np.cbrt(fidelity.particles_per_cell) + 1e-9))


def distant(points: Array, particles: Array, distance: float) -> Array:
    """The points `[n, 3]` on a body that are farther than this from all of its particles along some axis [m]."""
    from scipy.spatial import KDTree

    if not len(particles):
        return points
    gap = KDTree(particles).query(points, p=np.inf, distance_upper_bound=distance * (1.0 + 1e-6))[0]
    found: Array = points[~np.isfinite(gap)]
    return found


def thickened(lattice: Array, inside: Mask, points: Array, distance: float) -> Mask:
    """The places `[place_count]` of a body with its thin parts, which become two particles thick.

    Args:
        lattice: places for particles `[place_count, 3]` [m].
        inside: which of them lie in the body.
        points: on the surface of the body, no farther apart than half the distance `[n, 3]` [m].
        distance: of neighbouring places along an axis [m].
    """
    from scipy.spatial import KDTree

    thin = distant(points, lattice[inside], _MISSED * distance)
    if not len(thin):
        return inside
    gap = KDTree(thin).query(lattice, p=np.inf, distance_upper_bound=distance)[0]
    found: Mask = inside | np.isfinite(gap)
    return found


def largest_piece(lattice: Array, inside: Mask, pieces: int, distance: float) -> Mask:
    """The places `[place_count]` inside a body of so many pieces; the largest piece alone if there are more."""
    labels = clumps(lattice[inside], NEAR * distance)
    if labels.max() < pieces:
        return inside
    found = np.zeros(len(inside), bool)
    found[np.flatnonzero(inside)[labels == np.bincount(labels).argmax()]] = True
    return found


def clumps(points: Array, near: float) -> NDArray[np.int64]:
    """The number of each point's clump `[n]`, from 0; neighbours in a clump are this near [m]."""
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    tree = KDTree(points)
    labels = connected_components(tree.sparse_distance_matrix(tree, near), directed=False)[1]
    return np.asarray(labels, np.int64)


@dataclass(frozen=True)
class Thickness:
    """How much of a body is how thick, on a fine lattice of its own, so that it does not depend on the fidelity.

    Attributes:
        spacing: of the lattice [m].
        shares: of the volume in which cubes of 1, 2, ... spacings fit; they decrease.
    """

    spacing: float
    shares: Array

    @classmethod
    def of(cls, points: Array, spacing: float) -> "Thickness":
        """Of the lattice points `[n, 3]` [m] in a body, by openings with cubes (Matheron 1975: a granulometry)."""
        from scipy.ndimage import maximum_filter, minimum_filter

        cells = np.round((points - points.min(axis=0)) / spacing).astype(int) + 1
        filled = np.zeros(cells.max(axis=0) + 2, np.uint8)
        filled[tuple(cells.T)] = 1
        shares: list[float] = []
        for span in _SPANS:
            shifted = -1 if span % 2 == 0 else 0  # an even window has no middle
            eroded = minimum_filter(filled, int(span), mode="constant")
            opened = maximum_filter(eroded, int(span), mode="constant", origin=shifted)
            shares.append(float(opened.sum() / filled.sum()))
            if not opened.any():
                break
        return cls(spacing, np.array(shares))

    def share(self, edge: float) -> float:
        """The share of the volume in which a cube of this edge fits [-]; it decreases with the edge [m]."""
        span = max(1, round(edge / self.spacing))
        return float(self.shares[span - 1]) if span <= len(self.shares) else 0.0

    def is_enough(self, fidelity: Fidelity) -> bool:
        """Whether most of the body is thick enough; true at every finer fidelity, too."""
        return self.share(THICK * reach(fidelity)) >= _MOST

    def check(self, fidelity: Fidelity, name: str) -> None:
        """Check that most of the body is thick enough for the grid.

        Raises:
            SceneError: it is not; the message has the fidelity that would do.
        """
        if self.is_enough(fidelity):
            return
        least = THICK * reach(fidelity)
        raise SceneError(
            f"The body of {name!r} is too thin for a grid spacing of {fidelity.grid_spacing:.4g} m: "
            f"{100 * (1 - self.share(least)):.0f} % of its volume is thinner than {1e3 * least:.2g} mm, {THICK:g} "
            f"particles. Use {coarsest(self.is_enough)}, or a larger length."
        )


def coarsest(holds: Callable[[Fidelity], bool]) -> str:
    """The coarsest named fidelity that a test accepts, as an advice."""
    named = [(name, registry.create(Kind.FIDELITY, Ref(name))) for name in registry.names(Kind.FIDELITY)]
    for name, fidelity in sorted(named, key=lambda item: -item[1].grid_spacing):
        if holds(fidelity):
            return f"the fidelity {name!r} or a finer one"
    return "a finer fidelity than those with a name, as in reference[grid_spacing=0.002]"


def losses(positions: Array, shape: Shape, distance: float) -> tuple[str, bool]:
    """What particles lack of the box around a shape, in words, and whether it is a whole end; empty if nothing.

    Less than a particle, whose edge is the distance [m], is not counted.
    """
    low, high = np.array(shape.lower), np.array(shape.upper)
    gaps = np.stack([positions.min(axis=0) - low, high - positions.max(axis=0)], axis=1) - distance / 2
    gaps = np.where(gaps > distance, gaps, 0.0)
    shares = gaps / (high - low)[:, None]
    words = [
        f"{1e3 * gaps[axis, side]:.3g} mm at the {_SIDES[axis][side]}, {100 * shares[axis, side]:.0f} % of its {name}"
        for axis, name in enumerate(("length", "height", "width"))
        for side in (0, 1)
        if gaps[axis, side]
    ]
    return " and ".join(words), bool((shares > _LOST).any())
