"""The SDF-Lerp design space (SoftZoo's paper, H.5): zero level of the weighted mean of the signed distances."""

from typing import TYPE_CHECKING

import numpy as np

from zoobench.designs.anatomy import SWIMMER_LENGTH
from zoobench.designs.base import Body
from zoobench.designs.mixture import Mixture
from zoobench.designs.parts import EVERYTHING, Optimised
from zoobench.designs.primitives import DEFAULT_PRIMITIVES, Primitives, mean
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor

_TEMPERATURE = 0.15  # of the sigmoid [particle spacings]: occupancy 0.1 % one spacing outside the surface


@register(Kind.DESIGN, "sdf-lerp", version=8, tags=("space",))
def sdf_lerp(
    *,
    primitives: str = DEFAULT_PRIMITIVES,
    length: float = SWIMMER_LENGTH,
    connected: bool = True,
    optimise: Optimised = EVERYTHING,
) -> Mixture:
    """Bodies between animals, where the weighted mean of the signed distances to their surfaces is negative.

    Geometry, stiffness and muscles (shares and directions) have one coefficient for each animal; a softmax turns them
    into weights. Stiffness and muscle shares are weighted means; fibres are means of rotations. 100 steps of 0.01
    exchange a quarter of the matter.

    * `primitives`: names of animals, joined by +.
    * `length`: of every animal [m].
    * `connected`: whether only the largest connected piece is built.
    * `optimise`: the parts with coefficients, joined by +; the others are those of the first animal.
    """
    mixed = Primitives(primitives, length)
    return Mixture(primitives=mixed, connected=connected, optimise=optimise, occupancy=_occupancy, fibres=_fibres)


def _occupancy(primitives: Primitives, weights: "Tensor", body: Body) -> "Tensor":
    """Occupancy where the mean distance is negative `[particle_count]`."""
    import torch

    temperature = _TEMPERATURE * torch.as_tensor(np.cbrt(body.volumes))
    return torch.sigmoid(-mean(weights, primitives.tissues(body).distances) / temperature)


def _fibres(primitives: Primitives, weights: "Tensor", body: Body) -> "Tensor":
    """The mean direction of the primitives' fibres `[particle_count, 3]`."""
    return mean_line(weights, primitives.tissues(body).fibres)


def mean_line(weights: "Tensor", directions: "Tensor") -> "Tensor":
    """The weighted mean `[n, 3]` of lines given by unit vectors of arbitrary sign `[count, n, 3]`.

    A line is the rotation by half a turn about it, R = 2 d d^T - 1, the same for d and -d. Rotations are averaged by
    projecting their weighted sum on the rotations (Brégier, "Deep Regression on Manifolds: A 3D Rotation Case Study",
    3DV 2021). The projection of 2 sum w d d^T - 1 is a half-turn again, about the first principal axis of the lines.
    No line is nearest where the two largest principal values agree (two lines at right angles, of equal weight); the
    gradient is bounded there.
    """
    import torch
    from roma import special_procrustes

    half_turns = 2.0 * directions[..., :, None] * directions[..., None, :] - torch.eye(3, dtype=directions.dtype)
    projector = (special_procrustes(mean(weights, half_turns)) + torch.eye(3, dtype=directions.dtype)) / 2.0
    # every column of u u^T is parallel to u; the longest has the least rounding error
    longest = torch.diagonal(projector, dim1=-2, dim2=-1).argmax(dim=-1)
    column = torch.take_along_dim(projector, longest[:, None, None], dim=2)[..., 0]
    found: Tensor = column / column.norm(dim=1, keepdim=True)
    return found
