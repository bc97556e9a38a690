"""The points of a cloud with their columns: checked, cleaned, and with muscles from their colours."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array, Mask
from zoobench.designs.grouping import main_axis
from zoobench.designs.point_matter import Matter, matter_of
from zoobench.designs.shells import CRUMB
from zoobench.errors import UsageError

_MOST_COLOURS = 64
_MOST_FILL = 3.0  # a full cell may have taken over the slivers of its neighbours


@dataclass(frozen=True)
class Points:
    """The checked columns of a file; see `CloudDesign`.

    Attributes:
        shares: of every muscle at each point `[point_count, muscle_count]`; None if the file has neither muscles nor
            colours.
        muscles: their names.
        fill: the share of each point's cell that is solid.
        notes: the points that were left out, and how colours were used, as sentences.
    """

    positions: Array
    shares: Array | None
    muscles: tuple[str, ...]
    fibres: Array
    stiffness: Array
    density_ratio: Array
    fill: Array
    notes: tuple[str, ...] = ()

    @cached_property
    def _matter(self) -> tuple[Matter, NDArray[np.int64]]:
        return matter_of(self.positions)

    @property
    def matter(self) -> Matter:
        """The matter that the points represent."""
        return self._matter[0]

    @property
    def clumps(self) -> NDArray[np.int64]:
        """The number of each point's clump."""
        return self._matter[1]

    def only(self, kept: Mask, note: str) -> "Points":
        """These points alone, with a note."""
        columns: dict[str, Any] = {
            name: value[kept] for name, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        return replace(self, **columns, notes=(*self.notes, note))


def placed(points: Points, name: str) -> Points:
    """Points that have a place, each once, with a note on others.

    Raises:
        UsageError: hardly any are left.
    """
    count = len(points.positions)
    finite: Mask = np.asarray(np.isfinite(points.positions).all(axis=1))
    if not finite.all():
        points = points.only(finite, f"{count - int(finite.sum()):,} of {count:,} points have no place: left out.")
    count = len(points.positions)
    first = np.sort(np.unique(points.positions, axis=0, return_index=True)[1])
    if len(first) < max(2, 0.5 * count):
        raise UsageError(f"Most points of {name!r} lie on each other. Give each of them once, two at least.")
    if len(first) < count:
        once = np.zeros(count, bool)
        once[first] = True
        points = points.only(once, f"{count - len(first):,} of {count:,} points lie on others: left out.")
    return points


def without_crumbs(points: Points) -> Points:
    """Points without clumps that touch nothing and are hardly any, with a note on them."""
    sizes = np.bincount(points.clumps)
    order = np.argsort(sizes)
    crumbs = order[np.cumsum(sizes[order]) <= CRUMB * sizes.sum()]
    kept = ~np.isin(points.clumps, crumbs)
    if kept.all():
        return points
    left_out = f"{int((~kept).sum()):,} of {len(kept):,} points are far from all others: left out."
    return points.only(kept, left_out)


def check_columns(points: Points, name: str) -> None:
    """Check the columns of a file; points without a place are allowed.

    Raises:
        UsageError: there are no points with a place, or a column has another shape or values out of range.
    """
    count = len(points.positions)
    if count < 2:
        raise UsageError(f"The column 'positions' of {name!r} has {count} points. Give those of a body, two at least.")
    has_place = np.isfinite(points.positions.reshape(count, -1)).all(axis=1)
    if not has_place.any():
        raise UsageError(f"The column 'positions' of {name!r} has no finite values. Give the places of the points.")
    shapes = {"positions": (count, 3), "fibres": (count, 3), "stiffness": (count,), "density_ratio": (count,)}
    shapes["fill"] = (count,)
    shapes |= {} if points.shares is None else {"shares": (count, len(points.muscles))}
    for column, shape in shapes.items():
        values = getattr(points, column)
        if values.shape != shape or not np.isfinite(values[has_place]).all():
            raise UsageError(
                f"The column {column!r} of {name!r} has shape {values.shape}; {shape} and finite values were expected."
            )
    if min(points.stiffness.min(), points.density_ratio.min()) <= 0.0:
        raise UsageError(f"{name!r} has a stiffness or density_ratio that is not positive. Give positive ones.")
    if not 0.0 < points.fill.min() <= points.fill.max() <= _MOST_FILL:
        raise UsageError(f"{name!r} has a fill that is not a share of a cell. Give numbers above 0, up to 1.")
    if points.shares is not None:
        _check_shares(points.shares, name)


def _check_shares(shares: Array, name: str) -> None:
    if shares.min(initial=0.0) < 0.0 or (shares.sum(axis=1) > 1.0 + 1e-5).any():
        raise UsageError(f"{name!r} has shares of muscles below 0, or above 1 together. Give shares of the whole.")
    if not shares.any():
        raise UsageError(f"{name!r} has no muscle. Give some points a muscle from 0 on.")
    if not shares.any(axis=0).all():
        raise UsageError(f"A muscle of {name!r} has no point. Number those that have one 0, 1, 2, ...")


def painted(points: Points, colours: NDArray[np.int64], name: str) -> Points:
    """Points with a muscle for every colour `[n, 3]` but black, which is passive, and fibres along it.

    The convention of the published benchmark (SoftZoo's `AnnotatedPCD`): colours in the order of red, green and blue;
    the fibres of a colour are the first principal axis of the largest clump of its points.

    Raises:
        UsageError: there is no colour but black, or more than a few.
    """
    found, own = np.unique(colours, axis=0, return_inverse=True)
    own = own.ravel()
    active = found.any(axis=1)
    if not active.any() or active.sum() > _MOST_COLOURS:
        raise UsageError(
            f"{name!r} has points of {active.sum()} colours other than black; 1 to {_MOST_COLOURS} were expected, one "
            "for each muscle. Paint the parts, or leave the colours out and give grouping=paired."
        )
    muscle = np.where(active, np.cumsum(active) - 1, -1)[own]
    fibres = points.fibres.copy()
    for number in range(int(active.sum())):
        part = points.positions[muscle == number]
        part = part[np.isfinite(part).all(axis=1)]
        labels = matter_of(part)[1] if len(part) > 1 else np.zeros(len(part), np.int64)
        fibres[muscle == number], _ = main_axis(part[labels == np.bincount(labels).argmax()])
    passive = f", {100 * (muscle < 0).mean():.0f} % of the points are black and passive" if (muscle < 0).any() else ""
    note = f"The muscles are the {active.sum()} colours of the points, in the order of red, green, blue{passive}."
    names = tuple(f"muscle-{number + 1}" for number in range(int(active.sum())))
    return replace(points, shares=one_each(muscle), muscles=names, fibres=fibres, notes=(*points.notes, note))


def one_each(numbers: NDArray[np.int64]) -> Array:
    """Shares `[n, muscle_count]` of muscles by the number of each point's muscle, -1 for none.

    Raises:
        ValueError: they are not numbered from 0 on.
    """
    known = np.unique(numbers)
    if len(known) and (known[0] < -1 or not np.array_equal(known[known >= 0], np.arange((known >= 0).sum()))):
        raise ValueError("its muscles are not numbered 0, 1, 2, ... with -1 for none")
    count = int(known[-1]) + 1 if len(known) else 0
    return np.eye(count + 1)[numbers, :count]  # -1 selects the last row, which is zero
