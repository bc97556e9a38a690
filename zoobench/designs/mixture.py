"""Design spaces between primitives: weights of the animals in geometry, stiffness and muscles."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.parts import EVERYTHING, Optimised, parts_of
from zoobench.designs.primitives import Primitives, mean, simplex
from zoobench.designs.space import Form
from zoobench.sim.model.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor

ParticleField = Callable[[Primitives, "Tensor", Body], "Tensor"]
"""A property at every particle of a workspace, from the primitives and their weights `[primitive_count]`."""


@dataclass(frozen=True, kw_only=True)
class Mixture:
    """Bodies between primitives: a softmax turns the coefficients of each part into weights.

    Stiffness and muscle shares are weighted means. A part that is not optimised is the first primitive's.

    Attributes:
        primitives: the animals to mix.
        connected: whether only the largest connected piece is built.
        occupancy: `[particle_count]`, by the weights of the geometry.
        fibres: `[particle_count, 3]`, by the weights of the muscles.
        optimise: the parts with coefficients.
    """

    primitives: Primitives
    connected: bool
    occupancy: ParticleField
    fibres: ParticleField
    optimise: Optimised = EVERYTHING

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace."""
        return self.primitives.workspace(fidelity)

    def with_muscles(self, body: Body) -> Body:
        """The workspace with the muscles of all primitives by equal weights: where muscles are before one is made."""
        import torch

        shares = self.primitives.tissues(body).membership
        weights = torch.full((self.primitives.count,), 1.0 / self.primitives.count, dtype=shares.dtype)
        return replace(body, muscle_membership=mean(weights, shares).numpy())

    def parameter_count(self, body: Body) -> int:
        """A coefficient for each primitive in each part that is optimised."""
        return len(parts_of(self.optimise)) * self.primitives.count

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """Standard normal coefficients `[parameter_count]`: one primitive often dominates, and none is out of reach."""
        return rng.normal(size=self.parameter_count(body))

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`; each world is computed by itself, since the rounding
        of a batch depends on its width."""
        import torch

        tissues = self.primitives.tissues(body)
        worlds = [self._weights(world) for world in parameters]
        return Form(
            occupancy=torch.stack([self.occupancy(self.primitives, w["geometry"], body) for w in worlds]),
            # weights add up to 1 but for rounding
            stiffness=torch.stack([mean(w["stiffness"], tissues.stiffness).clamp(max=1.0) for w in worlds]),
            muscle_membership=torch.stack([mean(w["muscles"], tissues.membership) for w in worlds]),
            fibres=torch.stack([self.fibres(self.primitives, w["muscles"], body) for w in worlds]),
        )

    def _weights(self, parameters: "Tensor") -> "dict[str, Tensor]":
        """The weights of the primitives `[primitive_count]` by part, for `parameters` `[parameter_count]`."""
        import torch

        first = torch.eye(self.primitives.count, dtype=parameters.dtype)[0]
        parts = parts_of(self.optimise)
        own = dict(zip(parts, simplex(parameters, len(parts)), strict=True))
        return dict.fromkeys(parts_of(EVERYTHING), first) | own
