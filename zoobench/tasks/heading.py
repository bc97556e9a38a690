"""The heading of a deforming robot (SoftZoo's paper, A.3): its heading at rest, rotated with its head and tail."""

import math
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.tasks.base import Motion, constant
from zoobench.tasks.products import matmul, symmetric_eigen

if TYPE_CHECKING:
    import torch
    from torch import Tensor


def heading(motion: Motion, first: int = 0) -> "Tensor":
    """Unit vector of the heading in every state from the `first` on `[frames + 1 - first, worlds, 3]`; differentiable.

    At rest it is the horizontal direction from the centre of the tail to that of the head. It turns by the rotation of
    the head and tail particles from material to present space, which is the orthogonal factor of
    sum m (x - x_mean)(X - X_mean)^T over these particles, with present positions x and positions at rest X (Kabsch
    1976). For a rigid motion this is the rotation of every particle's deformation gradient F. For a deforming body it
    is a single best fit and not a mean of local rotations, so that bending a neck or compressing a foot does not count
    as turning, and the integration error that F accumulates does not enter.

    NaN in a world in which no labelled particle exists.
    """
    import torch

    labelled = motion.of_bodies("labelled", lambda: torch.nonzero((motion.head + motion.tail) > 0)[:, 0])
    weights = motion.of_bodies("labelled masses", lambda: motion.masses[:, labelled])  # [worlds, labelled]
    total = motion.of_bodies("labelled mass", lambda: weights.sum(dim=1))

    def shares() -> "Tensor":
        return (weights / torch.where(total > 0, total, 1.0)[:, None])[..., None]

    share = motion.of_bodies("shares of labelled mass", shares)
    positions = motion.positions[first:, :, labelled]
    rest = motion.of_bodies("labelled at rest", lambda: motion.rest[labelled])
    now = share * (positions - (share * positions).sum(dim=2, keepdim=True))
    moments = torch.stack([(now * rest[:, axis, None]).sum(dim=2) for axis in range(3)], dim=-1)
    turned = (rotation(moments) * motion.of_bodies("rest_heading", lambda: _rest_heading(motion))).sum(dim=-1)
    return torch.where((total > 0)[:, None], turned, torch.nan)


def direction(degrees: float, dtype: "torch.dtype") -> "Tensor":
    """The horizontal unit vector `[3]` at an angle from x, counter-clockwise seen from above [degrees]."""
    angle = math.radians(degrees)
    return constant((math.cos(angle), 0.0, -math.sin(angle)), dtype)


def heading_error(motion: Motion, directions: "Tensor") -> "Tensor":
    """Horizontal angle between the heading and a direction, averaged over the ends of all frames `[worlds]` [rad].

    Args:
        motion: the robot's motion.
        directions: `[frames, 3]` or `[3]`, of any length but zero.
    """
    import torch

    ahead = heading(motion, first=1)
    wanted = directions.expand(len(ahead), 3)[:, None]
    sine = ahead[..., 2] * wanted[..., 0] - ahead[..., 0] * wanted[..., 2]
    cosine = ahead[..., 0] * wanted[..., 0] + ahead[..., 2] * wanted[..., 2]
    return torch.atan2(sine.abs(), cosine).mean(dim=0)


def rotation(moments: "Tensor") -> "Tensor":
    """The rotation R nearest to each A `[..., 3, 3]`: R^T A is symmetric with the largest trace.

    R is the rotation of the unit quaternion q = (w, v) that maximises tr(R^T A), a quadratic form in q (Horn 1987): the
    eigenvector of its largest eigenvalue.

    The derivative is that of the polar decomposition. It contains 1/(s_i + s_j) only and is regular where singular
    values s coincide, unlike that of the singular value decomposition. With A = R S, a change dA rotates R by R [w],
    where (tr(S) 1 - S) w is the axial vector of R^T dA. R is computed without gradient; a Newton step from it, whose
    value is zero, adds the gradient. Where the labelled particles lie on a line, the derivative about it is zero.
    """
    import torch

    nearest = torch.as_tensor(_nearest_rotation(moments.detach().numpy()))
    if not moments.requires_grad:
        return nearest
    residual = matmul(nearest.mT, moments)
    inverse = torch.as_tensor(_inverse_inertia(residual.detach().numpy()))
    twist = (inverse * _axial(residual - residual.mT)[..., None, :]).sum(dim=-1)
    return nearest + matmul(nearest, _cross(twist))


def _nearest_rotation(moments: Array) -> Array:
    """The rotation R nearest to each A `[..., 3, 3]`."""
    skew = moments - moments.swapaxes(-1, -2)
    trace = moments[..., 0, 0] + moments[..., 1, 1] + moments[..., 2, 2]
    form = np.empty((*moments.shape[:-2], 4, 4))
    form[..., 0, 0] = trace
    form[..., 0, 1:] = form[..., 1:, 0] = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    form[..., 1:, 1:] = moments + moments.swapaxes(-1, -2) - trace[..., None, None] * np.eye(3)
    best = symmetric_eigen(form)[1][..., -1]
    # plain numbers are faster than arrays of one
    w, x, y, z = best.reshape(4).tolist() if best.size == 4 else np.moveaxis(best, -1, 0)
    rows = (
        (w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    return np.ascontiguousarray(np.moveaxis(np.array(rows), (0, 1), (-2, -1))).reshape(moments.shape)


def _inverse_inertia(stretch: Array) -> Array:
    """The pseudo-inverse of tr(S) 1 - S `[..., 3, 3]` for the symmetric part of each S."""
    values, axes = symmetric_eigen((stretch + stretch.swapaxes(-1, -2)) / 2.0)
    # the eigenvalue of an axis is the sum of the other two of S
    inertia = np.stack([values[..., i] + values[..., j] for i, j in ((1, 2), (0, 2), (0, 1))], axis=-1)
    is_free = inertia <= 3.0 * np.finfo(inertia.dtype).eps * np.abs(inertia).max(axis=-1, keepdims=True)
    inverse = np.where(is_free, 0.0, 1.0 / np.where(is_free, 1.0, inertia))
    scaled = axes * inverse[..., None, :]
    return np.asarray((scaled[..., :, None, :] * axes[..., None, :, :]).sum(axis=-1))


def _rest_heading(motion: Motion) -> "Tensor":
    """The heading at rest `[3]`, from the labels without weighting by mass."""
    import torch

    ends = [(label[:, None] * motion.rest).sum(dim=0) / label.sum() for label in (motion.head, motion.tail)]
    level = (ends[0] - ends[1]) * motion.rest.new_tensor([1.0, 0.0, 1.0])
    unit: Tensor = level / torch.linalg.vector_norm(level)
    return unit


def _axial(skew: "Tensor") -> "Tensor":
    """The vector w of a skew matrix `[..., 3, 3]` that maps r to w x r."""
    import torch

    return torch.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], dim=-1)


def _cross(vector: "Tensor") -> "Tensor":
    """The skew matrix of w `[..., 3]`, the inverse of `_axial`."""
    import torch

    x, y, z = vector.unbind(dim=-1)
    zero = torch.zeros_like(x)
    rows = [torch.stack(row, dim=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))]
    return torch.stack(rows, dim=-2)
