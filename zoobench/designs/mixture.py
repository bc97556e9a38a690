"""Design spaces between primitives: weights of the animals in geometry, stiffness and muscles."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.primitives import Primitives, mean, simplex
from zoobench.designs.space import Form
from zoobench.sim.model.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor

ParticleField = Callable[[Primitives, "Tensor", Body], "Tensor"]
"""A property at every particle of a workspace, from the primitives and their weights `[primitive_count]`."""

_BLOCKS = 3  # of coefficients: geometry, stiffness, muscles


@dataclass(frozen=True, kw_only=True)
class Mixture:
    """Bodies between primitives: a softmax turns the coefficients of each block into weights.

    Stiffness and muscle shares are weighted means.

    Attributes:
        primitives: the animals to mix.
        connected: whether only the largest connected piece is built.
        occupancy: `[particle_count]`, by the weights of the geometry.
        fibres: `[particle_count, 3]`, by the weights of the muscles.
    """

    primitives: Primitives
    connected: bool
    occupancy: ParticleField
    fibres: ParticleField

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace."""
        return self.primitives.workspace(fidelity)

    def parameter_count(self, body: Body) -> int:
        """Three coefficients for each primitive: of geometry, stiffness and muscles."""
        return _BLOCKS * self.primitives.count

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """Standard normal coefficients `[parameter_count]`: one primitive often dominates, and none is out of reach."""
        return rng.normal(size=self.parameter_count(body))

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`; each world is computed by itself, since the rounding
        of a batch depends on its width."""
        import torch

        tissues = self.primitives.tissues(body)
        worlds = [simplex(world, _BLOCKS) for world in parameters]
        return Form(
            occupancy=torch.stack([self.occupancy(self.primitives, w[0], body) for w in worlds]),
            stiffness=torch.stack([mean(w[1], tissues.stiffness) for w in worlds]),
            muscle_membership=torch.stack([mean(w[2], tissues.membership) for w in worlds]),
            fibres=torch.stack([self.fibres(self.primitives, w[2], body) for w in worlds]),
        )
