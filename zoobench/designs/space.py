"""A design space turns parameters into the form of a body, in torch, so that bodies are optimised through physics.

All spaces work on one set of particles, the workspace: a form says how much of each particle is there, how stiff it is,
to which muscle it belongs and along which line it contracts.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from zoobench.designs.base import Body
from zoobench.sim.model.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor

LEAST_STIFFNESS = 0.05
"""Smallest share of the workspace's stiffness: softer matter would not hold its own weight on any grid."""


@dataclass(frozen=True)
class Form:
    """A body that a design space describes, in every world; gradients reach the parameters through all of it.

    Attributes:
        occupancy: `[worlds, particle_count]` in [0, 1]; 0 is empty space.
        stiffness: `[worlds, particle_count]` share of the workspace's stiffness, in (0, 1] [-].
        muscle_membership: `[worlds, particle_count, muscle_count]` share of each muscle, 1 together [-].
        fibres: `[worlds, particle_count, 3]` unit direction in which a muscle contracts.
    """

    occupancy: "Tensor"
    stiffness: "Tensor"
    muscle_membership: "Tensor"
    fibres: "Tensor"

    def matter(self, body: Body) -> "dict[str, Tensor]":
        """The arrays that the simulator takes, by its own names, for a form in the workspace `body`.

        Where matter is scarce it is soft and weak beyond its share: its elastic and active stress fall with the third
        power of the occupancy, as in topology optimisation (SIMP, Bendsoe 1989; mass and volume with the first). What
        is half there is worth less than half, so that bodies become clear; and thin matter gives way to a
        flow around the body instead of holding on to it.
        """
        import torch

        scarcity = self.occupancy**2
        return {
            "occupancy": self.occupancy,
            "stiffness": self.stiffness * torch.as_tensor(body.stiffness) * scarcity,
            "muscle_membership": self.muscle_membership * scarcity[..., None],
            "fibres": self.fibres,
        }


@runtime_checkable
class DesignSpace(Protocol):
    """A family of bodies in one workspace, by one flat vector of parameters, the same for every method.

    Attributes:
        connected: whether only the largest connected piece of a form is built.
    """

    connected: bool

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace: every particle that a form may use, with the labels and density of all forms.

        Raises:
            SceneError: the fidelity is too coarse to hold any of it.
        """
        ...

    def parameter_count(self, body: Body) -> int:
        """Length of the parameter vector for this workspace."""
        ...

    def initial(self, rng: np.random.Generator, body: Body) -> NDArray[np.float64]:
        """A draw from the prior `[parameter_count]`, from which every method starts."""
        ...

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`, in double precision."""
        ...


@runtime_checkable
class SiteSpace(DesignSpace, Protocol):
    """A design space whose parameters are one row of numbers for every site of the workspace, so that any pattern over
    space is a body. It is registered with the tag `sites`."""

    def sites(self, body: Body) -> NDArray[np.float64]:
        """Where the rows are, as a pattern sees it `[site_count, 7]`: see `zoobench.designs.workspace.features`."""
        ...

    def painted(self, patterns: NDArray[np.float64]) -> NDArray[np.float64]:
        """The parameters `[parameter_count]` of the body that has these patterns, of order one, at its sites
        `[site_count, 2 + muscle_count]`: occupancy, stiffness, muscles."""
        ...


def stiffness_multiplier(raw: "Tensor") -> "Tensor":
    """Share of the workspace's stiffness in (0, 1) from any number: a sigmoid above `LEAST_STIFFNESS`."""
    import torch

    return LEAST_STIFFNESS + (1.0 - LEAST_STIFFNESS) * torch.sigmoid(raw)
