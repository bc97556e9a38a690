"""Bodies that are thin for a grid: the distribution of their thickness, their soles, and ends that are lost."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.sampling import Shape, SolidSample
from zoobench.errors import SceneError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.ground_skin import SKIN
from zoobench.spec import Ref

NEAR = 1.75
"""Distance of neighbours, diagonals of a square included [particle edges]."""

THICK = 1.5
"""Thickness that most of a body needs [particles]: with it, a body has two layers wherever its middle lies."""

_MOST = 0.5  # share of the volume that has to be that thick
_SOLE = 2.0  # [cells] of the level, which a body's soles need in every direction: docs/accuracy.md
_STANDS = 0.5  # share of the soles that has to be so wide
_PIXELS = 16  # in a cell, by which that is measured,
_MOST_PIXELS = 400  # and along the longest edge, for a large body
_LOST = 0.10  # share of a body's extent whose loss is the loss of an end
_SIDES = (("rear", "front"), ("bottom", "top"), ("left", "right"))
_MEASURING_POINTS = 30_000  # about, from which thickness and symmetry are measured
_FINEST = 1 / 200  # of the longest edge: the least spacing of such points
_NAMED = 4  # pieces whose shares are said
_SPANS = range(1, 65)  # [voxels] edges of the cubes that are tried


def whole_sample(name: str, shape: Shape, fidelity: Fidelity) -> SolidSample:
    """The sample of a solid from a file, with notes on ends and soles that the resolution does not represent.

    Args:
        name: of the body in messages.
        shape: the solid.
        fidelity: the resolution.

    Raises:
        SceneError: an end of the body is lost.
    """
    sample, grid = shape.sample(fidelity), f"at a grid spacing of {fidelity.grid_spacing:.4g} m"
    words, is_end = losses(sample, shape)
    if is_end:
        raise SceneError(
            f"The body of {name!r} loses {words} {grid}: it is too thin there to be found. Give it some thickness, a "
            "finer fidelity or a larger length."
        )
    notes = sample.notes
    if words:
        notes = (*notes, f"The body is smaller than in its file {grid}: it lacks {words}.")
    if (narrow := narrow_share(shape, fidelity)) > _STANDS:
        width = f"{_SOLE:g} cells of {1e3 * fidelity.grid_spacing:.3g} mm"
        words = f"{100 * narrow:.0f} % of the body's contact area is narrower than {width}"
        notes = (*notes, f"{words}: on land its scores will differ on a finer grid.")
    return replace(sample, notes=notes)


def narrow_share(shape: Shape, fidelity: Fidelity) -> float:
    """The share of a solid's soles, its section amid the ground's skin, in which no disc of two cells fits [-].

    By a lattice of its own, so that it does not depend on where the particles lie.
    """
    from scipy.ndimage import distance_transform_edt

    longest = max(np.subtract(shape.upper, shape.lower))
    spacing = max(fidelity.grid_spacing / _PIXELS, longest / _MOST_PIXELS)
    radius = _SOLE * fidelity.grid_spacing / 2 / spacing
    axes = [np.arange(shape.lower[axis] - spacing, shape.upper[axis] + 2 * spacing, spacing) for axis in (0, 2)]
    x, z = np.meshgrid(*axes, indexing="ij")
    section = np.stack([x, np.full_like(x, shape.lower[1] + SKIN.thickness / 2), z], axis=-1)
    stands = np.asarray(shape.inside(section.reshape(-1, 3)), float).reshape(x.shape) > 0.5
    if not stands.any():
        return 0.0
    holds = distance_transform_edt(stands) > radius  # the centres of discs that fit
    covered = distance_transform_edt(~holds) <= radius if holds.any() else holds
    return 1.0 - float(np.mean(covered[stands]))


def lattice_within(shape: Shape, volume: float) -> tuple[Array, float]:
    """Lattice points within a solid `[n, 3]` and their spacing, in its unit, to measure it with."""
    size = np.subtract(shape.upper, shape.lower)
    spacing = float(max((volume / _MEASURING_POINTS) ** (1 / 3), _FINEST * size.max()))
    counts = np.maximum(np.ceil(size / spacing - 1e-9), 1).astype(int)
    cells = np.indices(tuple(counts)).reshape(3, -1).T + 0.5
    points = (np.array(shape.lower) + np.array(shape.upper)) / 2 + (cells - counts / 2) * spacing
    return points[np.asarray(shape.inside(points), float) > 0.0], spacing


def pieces_note(shape: Shape, volume: float) -> tuple[str, ...]:
    """That a solid of this volume [m^3] is in several pieces, as a sentence; none if it is in one."""
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    points, spacing = lattice_within(shape, volume)
    if len(points) < 2:
        return ()
    tree = KDTree(points)
    # the default, a dictionary, is slow
    gaps = tree.sparse_distance_matrix(tree, NEAR * spacing, output_type="coo_matrix")
    sizes = np.sort(np.bincount(connected_components(gaps, directed=False)[1]))[::-1]
    shares = [f"{100.0 * size / sizes.sum():.2g} %" for size in sizes[1:_NAMED]]
    if not shares:
        return ()
    more = " and less" if len(sizes) > _NAMED else ""
    return (f"The body is in {len(sizes)} pieces that do not touch, the smaller ones of {', '.join(shares)}{more}.",)


def reach(fidelity: Fidelity) -> float:
    """Distance of neighbouring particles along an axis [m]: every cube of this edge holds a place for a particle."""
    return float(fidelity.grid_spacing / np.floor(np.cbrt(fidelity.particles_per_cell) + 1e-9))


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
        """Thickness of a body with these lattice points `[n, 3]` [m], by cubes that fit (granulometry, Matheron 1975).

        A body so thin that there are none has no thickness.
        """
        from scipy.ndimage import maximum_filter, minimum_filter

        if not len(points):
            return cls(spacing, np.zeros(0))
        cells = np.round((points - points.min(axis=0)) / spacing).astype(int) + 1
        filled = np.zeros(cells.max(axis=0) + 2, np.uint8)
        filled[tuple(cells.T)] = 1
        shares: list[float] = []
        for span in _SPANS:
            shifted = -1 if span % 2 == 0 else 0  # an even window has no middle
            eroded = minimum_filter(filled, span, mode="constant")
            opened = maximum_filter(eroded, span, mode="constant", origin=shifted)
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


def named_fidelities() -> dict[str, Fidelity]:
    """The registered fidelities by name, from coarse to fine."""
    found: dict[str, Fidelity] = {
        name: registry.create(Kind.FIDELITY, Ref(name)) for name in registry.names(Kind.FIDELITY)
    }
    return dict(sorted(found.items(), key=lambda item: (-item[1].grid_spacing, item[0])))


def coarsest(holds: Callable[[Fidelity], bool]) -> str:
    """The coarsest named fidelity that a test accepts, as an advice."""
    for name, fidelity in named_fidelities().items():
        if holds(fidelity):
            return f"the fidelity {name!r} or a finer one"
    return "a finer fidelity than those with a name, as in reference[grid_spacing=0.002]"


def losses(sample: SolidSample, shape: Shape) -> tuple[str, bool]:
    """The gaps of a sample at the sides of a shape's box, in words, and whether a whole end is lost; empty without any.

    Less than a particle is not counted.
    """
    low, high = np.array(shape.lower), np.array(shape.upper)
    gaps = np.stack([sample.points.min(axis=0) - low, high - sample.points.max(axis=0)], axis=1)
    gaps = np.where(gaps > sample.edge, gaps, 0.0)
    shares = gaps / (high - low)[:, None]
    words = [
        f"{1e3 * gaps[axis, side]:.3g} mm at the {_SIDES[axis][side]}, {100 * shares[axis, side]:.0f} % of its {name}"
        for axis, name in enumerate(("length", "height", "width"))
        for side in (0, 1)
        if gaps[axis, side]
    ]
    return " and ".join(words), bool((shares > _LOST).any())
