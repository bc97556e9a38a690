"""SDF-Lerp (H.5): the zero level of a weighted mean of the primitives' signed distances."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.designs.base import Body
from zoobench.designs.primitives import DEFAULT_PRIMITIVES, Primitives, mean, simplex
from zoobench.designs.space import Form
from zoobench.registry import Kind, register
from zoobench.sim.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor

_BLOCKS = 3  # of coefficients: geometry, stiffness, muscles

_TEMPERATURE = 0.15  # of the sigmoid, in particle spacings: one spacing outside the skin 0.1 % are left


@register(Kind.DESIGN, "sdf-lerp", tags=("space",))
@dataclass(frozen=True, kw_only=True)
class SdfLerp:
    """Bodies between animals, where the weighted mean of the signed distances to their skins is negative.

    One coefficient per animal and part: geometry, stiffness, and muscles (groups and directions); a softmax makes each
    part's positive and 1 together. Stiffness and muscle groups are means; fibres are means of rotations.

    * `primitives`: names of animals, joined by +.
    * `length`: of each of them [m].
    * `connected`: whether only the largest connected piece is built.
    """

    primitives: str = DEFAULT_PRIMITIVES
    length: float = 0.10
    connected: bool = True

    def __post_init__(self) -> None:
        _ = self._primitives

    @cached_property
    def _primitives(self) -> Primitives:
        return Primitives(self.primitives, self.length)

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace."""
        return self._primitives.workspace(fidelity)

    def parameter_count(self, body: Body) -> int:
        """Three coefficients per primitive: of its geometry, its stiffness, its muscles."""
        return _BLOCKS * self._primitives.count

    def initial(self, rng: np.random.Generator, body: Body) -> NDArray[np.float64]:
        """Standard normal coefficients `[parameter_count]`."""
        return self._primitives.draw(rng, _BLOCKS)

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`; each world is computed for itself, so that its bits
        do not depend on the others."""
        import torch

        tissues = self._primitives.tissues(body)
        temperature = _TEMPERATURE * torch.as_tensor(np.cbrt(body.volumes))
        worlds = [simplex(world, _BLOCKS) for world in parameters]
        return Form(
            occupancy=torch.stack([torch.sigmoid(-mean(w[0], tissues.distances) / temperature) for w in worlds]),
            stiffness=torch.stack([mean(w[1], tissues.stiffness) for w in worlds]),
            muscle_membership=torch.stack([mean(w[2], tissues.membership) for w in worlds]),
            fibres=torch.stack([mean_line(w[2], tissues.fibres) for w in worlds]),
        )


def mean_line(weights: "Tensor", directions: "Tensor") -> "Tensor":
    """The weighted mean `[n, 3]` of lines given by unit vectors `[count, n, 3]`, whose senses have no meaning.

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
    # every column of u u^T lies along u; the longest is not lost in rounding
    longest = torch.diagonal(projector, dim1=-2, dim2=-1).argmax(dim=-1)
    column = torch.take_along_dim(projector, longest[:, None, None], dim=2)[..., 0]
    found: Tensor = column / column.norm(dim=1, keepdim=True)
    return found
