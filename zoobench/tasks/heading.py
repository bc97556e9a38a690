"""The heading of a deforming robot (specification A.3): its heading at rest, rotated with its head and tail."""

from typing import TYPE_CHECKING

from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from torch import Tensor


def heading(motion: Motion) -> "Tensor":
    """Unit vector of the heading in every state `[frames + 1, worlds, 3]`; differentiable.

    At rest it is the horizontal direction from the centre of the tail to that of the head. It turns by the rotation of
    the head and tail particles from material to present space, which is the orthogonal factor of
    sum m (x - x_mean)(X - X_mean)^T over these particles, with present positions x and positions at rest X (Kabsch
    1976). For a rigid motion this is the rotation of every particle's deformation gradient F. For a deforming body it
    is a single best fit and not a mean of local rotations, so that bending a neck or compressing a foot does not count
    as turning, and the integration error that F accumulates does not enter.

    NaN in a world in which no labelled particle exists.
    """
    import torch

    weights = motion.masses * (motion.head + motion.tail)  # [worlds, particle_count]
    total = weights.sum(dim=1)
    share = weights / torch.where(total > 0, total, 1.0)[:, None]
    now = motion.positions - torch.einsum("wp,fwpi->fwi", share, motion.positions)[:, :, None]
    turned = rotation(torch.einsum("wp,fwpi,pj->fwij", share, now, motion.rest)) @ _rest_heading(motion)
    return torch.where((total > 0)[:, None], turned, torch.nan)


def heading_error(motion: Motion, directions: "Tensor") -> "Tensor":
    """Horizontal angle between the heading and a direction, averaged over the ends of all frames `[worlds]` [rad].

    Args:
        motion: the robot's motion.
        directions: `[frames, 3]` or `[3]`, of any length but zero.
    """
    import torch

    ahead = heading(motion)[1:]
    wanted = directions.expand(len(ahead), 3)[:, None]
    sine = ahead[..., 2] * wanted[..., 0] - ahead[..., 0] * wanted[..., 2]
    cosine = ahead[..., 0] * wanted[..., 0] + ahead[..., 2] * wanted[..., 2]
    return torch.atan2(sine.abs(), cosine).mean(dim=0)


def rotation(moments: "Tensor") -> "Tensor":
    """The rotation R nearest to each A `[..., 3, 3]`: R^T A is symmetric with the largest trace.

    The derivative is that of the polar decomposition. It contains 1/(s_i + s_j) only and is regular where singular
    values s coincide, unlike that of the singular value decomposition. With A = R S, a change dA rotates R by R [w],
    where (tr(S) 1 - S) w is the axial vector of R^T dA. R is computed without gradient; a Newton step from it, whose
    value is zero, adds the gradient. Where the labelled particles lie on a line, the derivative about it is zero.
    """
    import torch

    with torch.no_grad():
        left, _, right = torch.linalg.svd(moments)
        signs = torch.ones_like(moments[..., 0])
        signs[..., 2] = torch.linalg.det(left @ right).sign()
        nearest = left * signs[..., None, :] @ right
        stretch = nearest.mT @ moments
        trace = stretch.diagonal(dim1=-2, dim2=-1).sum(dim=-1)[..., None, None]
        inverse = torch.linalg.pinv(trace * torch.eye(3, dtype=moments.dtype) - (stretch + stretch.mT) / 2)
    residual = nearest.mT @ moments
    twist = (inverse @ _axial(residual - residual.mT)[..., None])[..., 0]
    result: Tensor = nearest + nearest @ _cross(twist)
    return result


def _rest_heading(motion: Motion) -> "Tensor":
    """The heading at rest `[3]`, from the labels without weighting by mass."""
    import torch

    ends = [label @ motion.rest / label.sum() for label in (motion.head, motion.tail)]
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
