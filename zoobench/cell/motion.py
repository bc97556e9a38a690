"""The motion of robot and objects as tensors for the tasks, and the adjoint of an objective for the simulator."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Motion, ObjectMotion

if TYPE_CHECKING:
    from torch import Tensor

    from zoobench.sim.model.rollout import Gradient, Rollout
    from zoobench.sim.model.scene import Scene


BODY_ARRAYS = ("stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres")
"""Arrays of a body by which the simulator differentiates, with one row for each particle."""

_WEIGHTS = ("occupancy", "density_ratio")  # a particle's mass is their product with density and volume


def motion_of(
    rollout: "Rollout",
    body: Body,
    scene: "Scene",
    worlds: slice = slice(None),
    *,
    gradient: bool = False,
    swims: bool = False,
) -> Motion:
    """The motion of robot and objects in some worlds of a rollout, in double precision.

    Args:
        rollout: an episode; occupancy and density are taken from it.
        body: the robot at rest.
        scene: which was simulated.
        worlds: by default all.
        gradient: whether positions, velocities, occupancy, masses and the muscles' work are leaves of an autograd
            graph.
        swims: whether the body is in the midst of water.
    """
    import torch

    def tensor(values: NDArray[Any], leaf: bool = False) -> "Tensor":
        return torch.tensor(values, dtype=torch.float64, requires_grad=leaf)

    robot = scene.slice_of("robot")
    occupancy = rollout.body["occupancy"][worlds, robot]
    masses = scene.robot.material.density * rollout.body["density_ratio"][worlds, robot] * occupancy * body.volumes
    objects = {
        each.name: ObjectMotion(
            positions=tensor(rollout.positions[:, worlds, scene.slice_of(each.name)], gradient),
            velocities=tensor(rollout.velocities[:, worlds, scene.slice_of(each.name)], gradient),
            masses=tensor(each.body.masses),
            rest=tensor(each.body.positions),
        )
        for each in scene.objects
    }
    return Motion(
        positions=tensor(rollout.positions[:, worlds, robot], gradient),
        velocities=tensor(rollout.velocities[:, worlds, robot], gradient),
        masses=tensor(masses, gradient),
        frame_seconds=FRAME_SECONDS,
        rest=tensor(body.positions),
        head=tensor(body.head),
        tail=tensor(body.tail),
        muscle_work=tensor(rollout.muscle_work[:, worlds], gradient),
        occupancy=tensor(occupancy, gradient),
        swims=swims,
        objects=objects,
    )


def with_states(motion: Motion, positions: "Tensor", velocities: "Tensor") -> Motion:
    """The motion with other states, of the robot and the objects `[frames + 1, worlds, all particles, 3]`; views."""
    first, objects = motion.positions.shape[2], {}
    robot = positions[:, :, :first], velocities[:, :, :first]
    for name, each in motion.objects.items():
        own = slice(first, first + len(each.masses))
        objects[name] = replace(each, positions=positions[:, :, own], velocities=velocities[:, :, own])
        first = own.stop
    return replace(motion, positions=robot[0], velocities=robot[1], objects=objects)


@dataclass(frozen=True)
class MotionAdjoint:
    """Adjoint of a motion: the derivatives of a scalar by its leaves.

    Attributes:
        positions, velocities: of robot and objects `[frames + 1, worlds, all particles, 3]`.
        occupancy, masses: of the robot `[worlds, particle_count]`.
        muscle_work: `[frames, worlds, muscle_count]`; 0 where the scalar does not depend on it.
    """

    positions: Array
    velocities: Array
    occupancy: Array
    masses: Array
    muscle_work: Array

    @classmethod
    def of(cls, value: "Tensor", motion: Motion) -> "MotionAdjoint":
        """The adjoint for a scalar `value` that was computed from `motion`."""
        import torch

        bodies: list[Motion | ObjectMotion] = [motion, *motion.objects.values()]
        leaves = [*(body.positions for body in bodies), *(body.velocities for body in bodies)]
        others = motion.existing, motion.masses, motion.muscle_work
        adjoints = torch.autograd.grad(value, (*leaves, *others), allow_unused=True, materialize_grads=True)
        states = (torch.cat(part, dim=2) for part in (adjoints[: len(bodies)], adjoints[len(bodies) : len(leaves)]))
        return cls(*(adjoint.numpy() for adjoint in (*states, *adjoints[len(leaves) :])))

    @classmethod
    def joined(cls, parts: "list[MotionAdjoint]") -> "MotionAdjoint":
        """The adjoints of several worlds as one."""
        return cls(
            positions=np.concatenate([part.positions for part in parts], axis=1),
            velocities=np.concatenate([part.velocities for part in parts], axis=1),
            occupancy=np.concatenate([part.occupancy for part in parts]),
            masses=np.concatenate([part.masses for part in parts]),
            muscle_work=np.concatenate([part.muscle_work for part in parts], axis=1),
        )

    def by_arrays(self, simulated: "Gradient", rollout: "Rollout", body: Body, density: float) -> dict[str, Array]:
        """Adjoints of the body's arrays by name, `[worlds, ...]` each.

        To the derivative through the simulation, occupancy and density add a direct one: the task weights particles
        by occupancy and mass.
        """
        adjoints: dict[str, Array] = {name: getattr(simulated, name) for name in BODY_ARRAYS}
        robot = slice(body.particle_count)
        weighed = {name: self.masses * density * rollout.body[name][:, robot] * body.volumes for name in _WEIGHTS}
        adjoints["occupancy"] = adjoints["occupancy"] + (self.occupancy + weighed["density_ratio"])
        adjoints["density_ratio"] = adjoints["density_ratio"] + weighed["occupancy"]
        return adjoints
