"""How far a deforming body reaches along an axis, and the area that it covers: by the bulk of its matter."""

from typing import TYPE_CHECKING

from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from torch import Tensor

_STRAY = 0.01  # share of the matter at either end that does not count: what hangs loose decides nothing
_END = 0.05  # share up to which it does; their mean is an end
_MIDDLE = (_STRAY + _END) / 2  # where the mean of an end lies in a body of uniform section

_REACH = 4.0
"""Distance from the centre, relative to its root mean square at the start, at which matter counts no further; the
corners of a rectangle are at 1.7."""

_SHARPNESS = 8


def edges(motion: Motion, axis: int) -> tuple["Tensor", "Tensor"]:
    """Lower and upper edge of the body along x, y or z in every state, `[frames + 1, worlds]` each [m]; differentiable.

    Matter is put in order along the axis. The mean place of what lies between 1 and 5 % of it, weighted by occupancy,
    is one end, that between 95 and 99 % the other. The edges are as far beyond the ends as in a body of uniform
    section, so that they are exact for a box, however it is stretched. A particle moves an edge by its share of the
    end at most, and matter of less than 1 % not at all.
    """
    import torch

    found = motion.once(f"edges {axis}", lambda: torch.stack(_edges(motion, axis)))
    return found[0], found[1]


def extent(motion: Motion, axis: int) -> "Tensor":
    """Distance between the edges in every state `[frames + 1, worlds]` [m]."""
    lower, upper = edges(motion, axis)
    return upper - lower


def _edges(motion: Motion, axis: int) -> tuple["Tensor", "Tensor"]:
    """See `edges`."""
    import torch

    places, order = torch.sort(motion.positions[..., axis], dim=2, stable=True)
    share = motion.existing / motion.existing.sum(dim=1, keepdim=True)
    share = share.expand(places.shape).gather(2, order)
    above = share.cumsum(dim=2)
    below = above - share

    def end(first: float, last: float) -> "Tensor":
        counted = (above.clamp(max=last) - below.clamp(min=first)).clamp(min=0.0)
        return (places * counted).sum(dim=2) / counted.sum(dim=2)

    low, high = end(_STRAY, _END), end(1.0 - _END, 1.0 - _STRAY)
    beyond = (high - low) * (_MIDDLE / (1.0 - 2.0 * _MIDDLE))
    return low - beyond, high + beyond


def covered_area(motion: Motion) -> "Tensor":
    """Horizontal area that the body covers in every state `[frames + 1, worlds]` [m^2]; smooth.

    12 times the root of the determinant of the covariance of x and z, weighted by occupancy: the area of a rectangle
    with these moments. Distances from the centre saturate at four times their root mean square at the start, so that
    no stray particle makes an area.
    """
    return motion.once("covered_area", lambda: _covered_area(motion))


def _covered_area(motion: Motion) -> "Tensor":
    """See `covered_area`."""
    level = motion.positions[..., [0, 2]]
    relative = level - motion.mean_over_existing(level)[:, :, None]
    squared = (relative**2).sum(dim=-1)
    reach = _REACH**2 * motion.mean_over_existing(squared[:1, ..., None])  # [1, worlds, 1]
    kept = (1.0 + (squared / reach) ** (_SHARPNESS // 2)) ** (-1.0 / _SHARPNESS)
    relative = relative * kept[..., None]
    relative = relative - motion.mean_over_existing(relative)[:, :, None]
    x, z = relative[..., 0], relative[..., 1]
    xx, xz, zz = (motion.mean_over_existing(product[..., None])[..., 0] for product in (x * x, x * z, z * z))
    return 12.0 * (xx * zz - xz * xz).sqrt()
