"""The particle-based design space (specification H.1): every particle of the workspace on its own."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.fields import grow, painted, rows_like, width_of
from zoobench.designs.space import Form
from zoobench.designs.workspace import base_design, features, workspace
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.DESIGN, "particle", tags=("space", "sites"))
@dataclass(frozen=True, kw_only=True)
class ParticleSpace:
    """A design space in which every particle has its own occupancy, stiffness and muscle.

    The parameters are one number for occupancy and one for stiffness, each behind a sigmoid, and one for each muscle
    behind a softmax, particle by particle; fibres run ahead. A draw from the prior is the base nearly full (0.8 to
    0.95), of stiffness 0.5 to 0.85, with its own muscles and noise on all.

    * `base`: the fixed design whose particles are the workspace.
    * `connected`: whether only the largest connected piece is built.
    """

    base: str = "block"
    connected: bool = True

    def __post_init__(self) -> None:
        base_design(self.base)  # one that cannot be used is refused now

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace."""
        return workspace(self.base, fidelity)

    def parameter_count(self, body: Body) -> int:
        """A row of numbers for each particle."""
        return body.particle_count * width_of(body)

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """A body near the base."""
        return rows_like(body.muscle_membership, rng).ravel()

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`."""
        return grow(parameters, body, lambda row: row.reshape(body.particle_count, -1))

    def sites(self, body: Body) -> Array:
        """The particles."""
        return features(body)

    def painted(self, patterns: Array) -> Array:
        """The parameters of the body with these patterns."""
        return painted(patterns)
