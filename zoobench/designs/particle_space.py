"""The particle-based design space (SoftZoo's paper, H.1): independent parameters for every particle."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.fields import grow, painted, rows_like, width_of
from zoobench.designs.space import Form
from zoobench.designs.workspace import BasedSpace, features_at
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@register(Kind.DESIGN, "particle", version=5, tags=("space", "sites"))
@dataclass(frozen=True, kw_only=True)
class ParticleSpace(BasedSpace):
    """A design space in which every particle has its own occupancy, stiffness and muscle.

    The parameters of a particle are one for occupancy and one for stiffness, each mapped by a sigmoid, and one for each
    muscle, mapped by a softmax; fibres run ahead. A particle is solid where its first number is positive. A draw from
    the prior is a smooth random shape of 0.4 to 1 of the base (loose or thin parts are not built), of stiffness 0.5 to
    0.85 and mostly the base's muscles. Its numbers are of order 0.5, so that 100 steps of Adam at a rate of 0.01, each
    of which moves a number by 0.01, can fill or empty nearly every place.

    * `base`: the fixed design whose particles are the workspace.
    * `connected`: whether only the largest connected piece is built.
    * `optimise`: the parts with parameters, joined by +; the others are the base's.
    """

    def parameter_count(self, body: Body) -> int:
        """A row of numbers for each particle."""
        return body.particle_count * width_of(self.optimise, body)

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """A draw from the prior `[parameter_count]`."""
        return rows_like(body.muscle_membership, self.sites(body)[:, :3], self.optimise, rng)

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`."""
        return grow(parameters, body, self.optimise, lambda row: row.reshape(body.particle_count, -1))

    def sites(self, body: Body) -> Array:
        """The particles."""
        return features_at(body.positions, body)

    def painted(self, patterns: Array) -> Array:
        """The parameters for these patterns."""
        return painted(patterns, self.optimise)
