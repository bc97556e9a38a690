"""From the simulator to the tasks and back: how the robot moved, as tensors, and the adjoint of an objective."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Motion

if TYPE_CHECKING:
    from torch import Tensor

    from zoobench.sim.model.rollout import Gradient, Rollout


BODY_ARRAYS = ("stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres")
"""What a body can be varied by, particle by particle."""

_WEIGHTS = ("occupancy", "density_ratio")  # a particle's mass is their product with density and volume


def motion_of(
    rollout: "Rollout", body: Body, density: float, worlds: slice = slice(None), *, gradient: bool = False
) -> Motion:
    """How the robot moved in some worlds of a rollout, in double precision.

    Args:
        rollout: an episode.
        body: of the robot, at rest; occupancy and density are those with which the rollout was made.
        density: of muscle [kg/m^3].
        worlds: which; all if not given.
        gradient: whether positions, velocities, presence and masses are leaves of a gradient.
    """
    import torch

    def tensor(values: NDArray[Any], leaf: bool = False) -> "Tensor":
        return torch.tensor(values, dtype=torch.float64, requires_grad=leaf)

    presence = rollout.body["occupancy"][worlds]
    masses = density * rollout.body["density_ratio"][worlds] * presence * body.volumes
    return Motion(
        positions=tensor(rollout.positions[:, worlds], gradient),
        velocities=tensor(rollout.velocities[:, worlds], gradient),
        masses=tensor(masses, gradient),
        frame_seconds=FRAME_SECONDS,
        rest=tensor(body.positions),
        head=tensor(body.head),
        tail=tensor(body.tail),
        muscle_work=tensor(rollout.muscle_work[:, worlds]),
        presence=tensor(presence, gradient),
    )


@dataclass(frozen=True)
class MotionAdjoint:
    """Derivatives of a scalar by a motion whose parts are leaves.

    Attributes:
        positions, velocities: `[frames + 1, worlds, particle_count, 3]`.
        presence, masses: `[worlds, particle_count]`.
    """

    positions: Array
    velocities: Array
    presence: Array
    masses: Array

    @classmethod
    def of(cls, value: "Tensor", motion: Motion) -> "MotionAdjoint":
        """Of one number."""
        import torch

        leaves = (motion.positions, motion.velocities, motion.existing, motion.masses)
        pulls = torch.autograd.grad(value, leaves, allow_unused=True, materialize_grads=True)
        return cls(*(pull.numpy() for pull in pulls))

    @classmethod
    def joined(cls, pulls: "list[MotionAdjoint]") -> "MotionAdjoint":
        """Those of several worlds as one."""
        return cls(
            positions=np.concatenate([pull.positions for pull in pulls], axis=1),
            velocities=np.concatenate([pull.velocities for pull in pulls], axis=1),
            presence=np.concatenate([pull.presence for pull in pulls]),
            masses=np.concatenate([pull.masses for pull in pulls]),
        )

    def by_arrays(self, simulated: "Gradient", rollout: "Rollout", body: Body, density: float) -> dict[str, Array]:
        """Derivatives by the arrays of the body, `[worlds, ...]` each: through the simulation, and directly.

        Occupancy and density also say directly which particles count, and what they weigh.
        """
        pulls: dict[str, Array] = {name: getattr(simulated, name) for name in BODY_ARRAYS}
        weighed = {name: self.masses * density * rollout.body[name] * body.volumes for name in _WEIGHTS}
        pulls["occupancy"] = pulls["occupancy"] + (self.presence + weighed["density_ratio"])
        pulls["density_ratio"] = pulls["density_ratio"] + weighed["occupancy"]
        return pulls
