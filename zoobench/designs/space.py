"""The protocol of design spaces: from parameters to the form of a body, differentiable, in torch.

A form gives occupancy, stiffness, muscle shares and fibre direction of every particle of a fixed set, the workspace.
Where occupancy is above one half, the body that is scored, shown and exported is solid, and elsewhere there is nothing;
gradients are those of the relaxed body of all occupancies (`zoobench.cell.robot.Draft`).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from zoobench.designs.base import Body
from zoobench.sim.model.fidelity import Fidelity

if TYPE_CHECKING:
    from torch import Tensor

LEAST_STIFFNESS = 0.05
"""Least stiffness relative to the workspace: softer matter could not carry its own weight."""


@dataclass(frozen=True)
class Form:
    """A body of a design space in every world; all arrays are differentiable by the parameters.

    Attributes:
        occupancy: `[worlds, particle_count]` in [0, 1]; 0 is empty space.
        stiffness: `[worlds, particle_count]` relative to the workspace, in (0, 1] [-].
        muscle_membership: `[worlds, particle_count, muscle_count]` share of each muscle, with sum 1, or less where
            muscles are not optimised and the base has passive tissue, or where matter is too soft for them, see
            `cell.firm_muscles` [-].
        fibres: `[worlds, particle_count, 3]` unit directions of contraction.
    """

    occupancy: "Tensor"
    stiffness: "Tensor"
    muscle_membership: "Tensor"
    fibres: "Tensor"

    @classmethod
    def filling(cls, body: Body, worlds: int) -> Self:
        """The workspace `body` itself, solid, in every world."""
        import torch

        arrays = (body.occupancy, np.ones(body.particle_count), body.muscle_membership, body.fibres)
        return cls(*(torch.as_tensor(array).expand(worlds, *array.shape) for array in arrays))

    def matter(self, body: Body) -> "dict[str, Tensor]":
        """The arrays of the simulator, by its names, for a form in the workspace `body`.

        Elastic and active stress are proportional to the third power of the occupancy, as in topology optimisation
        (SIMP, Bendsoe 1989), mass and volume to the first. This penalises intermediate occupancy, and matter of low
        occupancy does not hold on to the flow around the body.
        """
        import torch

        penalty = self.occupancy**2
        return {
            "occupancy": self.occupancy,
            "stiffness": self.stiffness * torch.as_tensor(body.stiffness) * penalty,
            "muscle_membership": self.muscle_membership * penalty[..., None],
            "fibres": self.fibres,
        }


@runtime_checkable
class DesignSpace(Protocol):
    """A family of bodies in one workspace, with one flat parameter vector.

    Attributes:
        connected: whether only the largest connected piece of a form is built.
    """

    connected: bool

    def body(self, fidelity: Fidelity) -> Body:
        """The workspace: all particles that a form can have, with the labels and density of all forms.

        Raises:
            SceneError: the fidelity is too coarse for a single particle.
        """

    def parameter_count(self, body: Body) -> int:
        """Length of the parameter vector for this workspace."""

    def initial(self, rng: np.random.Generator, body: Body) -> NDArray[np.float64]:
        """A draw from the prior `[parameter_count]`, from which every method starts."""

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`, in double precision."""


@runtime_checkable
class SiteSpace(DesignSpace, Protocol):
    """A design space with a row of parameters for every site of the workspace, so that every pattern over space is a
    body. It is registered with the tag `sites`."""

    def sites(self, body: Body) -> NDArray[np.float64]:
        """Inputs of a pattern at the sites `[site_count, 7]`, see `zoobench.designs.workspace.features_at`."""

    def painted(self, patterns: NDArray[np.float64]) -> NDArray[np.float64]:
        """The parameters `[parameter_count]` for patterns of order one at the sites `[site_count, 3 + muscle_count]`,
        in the order occupancy, share of the sites that are solid, stiffness, muscles."""


def stiffness_multiplier(raw: "Tensor") -> "Tensor":
    """Stiffness relative to the workspace, in (0, 1), from any number: a sigmoid above `LEAST_STIFFNESS`."""
    import torch

    return LEAST_STIFFNESS + (1.0 - LEAST_STIFFNESS) * torch.sigmoid(raw)
