"""The robot's motion as tensors for the tasks, and the adjoint of an objective for the simulator."""

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
"""Arrays of a body by which the simulator differentiates, with one row for each particle."""

_WEIGHTS = ("occupancy", "density_ratio")  # a particle's mass is their product with density and volume


def motion_of(
    rollout: "Rollout",
    body: Body,
    density: float,
    worlds: slice = slice(None),
    *,
    gradient: bool = False,
    swims: bool = False,
) -> Motion:
    """The robot's motion in some worlds of a rollout, in double precision.

    Args:
        rollout: an episode; occupancy and density are taken from it.
        body: the robot at rest.
        density: of muscle [kg/m^3].
        worlds: by default all.
        gradient: whether positions, velocities, occupancy and masses are leaves of an autograd graph.
        swims: whether the body is in the midst of water.
    """
    import torch

    def tensor(values: NDArray[Any], leaf: bool = False) -> "Tensor":
        return torch.tensor(values, dtype=torch.float64, requires_grad=leaf)

    occupancy = rollout.body["occupancy"][worlds]
    masses = density * rollout.body["density_ratio"][worlds] * occupancy * body.volumes
    return Motion(
        positions=tensor(rollout.positions[:, worlds], gradient),
        velocities=tensor(rollout.velocities[:, worlds], gradient),
        masses=tensor(masses, gradient),
        frame_seconds=FRAME_SECONDS,
        rest=tensor(body.positions),
        head=tensor(body.head),
        tail=tensor(body.tail),
        muscle_work=tensor(rollout.muscle_work[:, worlds]),
        occupancy=tensor(occupancy, gradient),
        swims=swims,
    )


@dataclass(frozen=True)
class MotionAdjoint:
    """Adjoint of a motion: the derivatives of a scalar by its leaves.

    Attributes:
        positions, velocities: `[frames + 1, worlds, particle_count, 3]`.
        occupancy, masses: `[worlds, particle_count]`.
    """

    positions: Array
    velocities: Array
    occupancy: Array
    masses: Array

    @classmethod
    def of(cls, value: "Tensor", motion: Motion) -> "MotionAdjoint":
        """The adjoint for a scalar `value` that was computed from `motion`."""
        import torch

        leaves = (motion.positions, motion.velocities, motion.existing, motion.masses)
        adjoints = torch.autograd.grad(value, leaves, allow_unused=True, materialize_grads=True)
        return cls(*(adjoint.numpy() for adjoint in adjoints))

    @classmethod
    def joined(cls, parts: "list[MotionAdjoint]") -> "MotionAdjoint":
        """The adjoints of several worlds as one."""
        return cls(
            positions=np.concatenate([part.positions for part in parts], axis=1),
            velocities=np.concatenate([part.velocities for part in parts], axis=1),
            occupancy=np.concatenate([part.occupancy for part in parts]),
            masses=np.concatenate([part.masses for part in parts]),
        )

    def by_arrays(self, simulated: "Gradient", rollout: "Rollout", body: Body, density: float) -> dict[str, Array]:
        """Adjoints of the body's arrays by name, `[worlds, ...]` each.

        To the derivative through the simulation, occupancy and density add a direct one: the task weights particles
        by occupancy and mass.
        """
        adjoints: dict[str, Array] = {name: getattr(simulated, name) for name in BODY_ARRAYS}
        weighed = {name: self.masses * density * rollout.body[name] * body.volumes for name in _WEIGHTS}
        adjoints["occupancy"] = adjoints["occupancy"] + (self.occupancy + weighed["density_ratio"])
        adjoints["density_ratio"] = adjoints["density_ratio"] + weighed["occupancy"]
        return adjoints
