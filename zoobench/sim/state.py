"""The tensors of a simulation: matter that moves, parameters that do not, and the adjoints of both."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
import torch
from torch import Tensor

from zoobench.sim.scene import Array, Scene, lame_parameters


@dataclass
class Matter:
    """State of all particles at a number of slots; positions are relative to the grid's first node.

    Attributes:
        x, v: `[slots, worlds, particles, 3]` [m], [m/s].
        C: `[slots, worlds, particles, 3, 3]` APIC matrix [1/s].
        F: `[slots, worlds, robot, 3, 3]` deformation gradient of the robot.
        b: `[slots, worlds, sand, 6]` elastic left Cauchy-Green tensor of the sand (xx yy zz xy xz yz).
        surplus: `[slots, worlds, sand]` log-volume gained while loose.
        tau: `[slots, worlds, sand, 6]` Kirchhoff stress of the sand [Pa].
        window: `[slots, worlds, 6]` first and past-the-last node in use.
    """

    x: Tensor
    v: Tensor
    C: Tensor
    F: Tensor
    b: Tensor
    surplus: Tensor
    tau: Tensor
    window: Tensor

    @classmethod
    def zeros(cls, slots: int, worlds: int, robot: int, sand: int, real: torch.dtype, device: str) -> Self:
        """All zero; the sand's tensors are empty in a scene without sand."""

        def make(*shape: int) -> Tensor:
            return torch.zeros((slots, worlds, *shape), dtype=real, device=device)

        total = robot + sand
        return cls(
            x=make(total, 3),
            v=make(total, 3),
            C=make(total, 3, 3),
            F=make(robot, 3, 3),
            b=make(sand, 6),
            surplus=make(sand),
            tau=make(sand, 6),
            window=torch.zeros((slots, worlds, 6), dtype=torch.int32, device=device),
        )

    def tensors(self) -> list[Tensor]:
        """In the order in which the kernels take them."""
        return [getattr(self, item.name) for item in fields(self)]

    def copy_slot(self, slot: int) -> "Matter":
        """A one-slot copy: a checkpoint."""
        return Matter(*(tensor[slot : slot + 1].clone() for tensor in self.tensors()))

    def load_slot(self, slot: int, saved: "Matter") -> None:
        """Write a one-slot copy back into a slot."""
        for target, source in zip(self.tensors(), saved.tensors(), strict=True):
            target[slot] = source[0]

    def bytes_per_slot(self) -> int:
        """Memory of one slot [bytes]."""
        return sum(tensor[0].numel() * tensor.element_size() for tensor in self.tensors())


@dataclass
class Parameters:
    """What a particle is: constant through an episode but for the tension, which changes with every control frame.

    Attributes:
        mass, volume: `[worlds, particles]` [kg], [m^3], both scaled by occupancy.
        stiffness: `[worlds, robot]` multiplier of E.
        tension: `[worlds, robot]` active stress along the fibre in this control frame [Pa].
        fibre: `[1, worlds, robot, 3]` unit rest direction.
    """

    mass: Tensor
    volume: Tensor
    stiffness: Tensor
    tension: Tensor
    fibre: Tensor

    @classmethod
    def zeros(cls, worlds: int, robot: int, particles: int, real: torch.dtype, device: str) -> Self:
        """All zero: the start of an adjoint."""

        def make(*shape: int) -> Tensor:
            return torch.zeros(shape, dtype=real, device=device)

        return cls(
            mass=make(worlds, particles),
            volume=make(worlds, particles),
            stiffness=make(worlds, robot),
            tension=make(worlds, robot),
            fibre=make(1, worlds, robot, 3),
        )

    def tensors(self) -> list[Tensor]:
        """In the order in which the kernels take them."""
        return [getattr(self, item.name) for item in fields(self)]


@dataclass(frozen=True)
class BodyState:
    """A design's arrays for every world; None takes the scene's robot as it is.

    Attributes:
        stiffness, density_ratio, occupancy: `[worlds, robot]` [-].
        muscle_membership: `[worlds, robot, muscles]` [-].
        fibres: `[worlds, robot, 3]` unit vectors.
    """

    stiffness: Array | None = None
    density_ratio: Array | None = None
    occupancy: Array | None = None
    muscle_membership: Array | None = None
    fibres: Array | None = None

    def filled(self, scene: Scene, worlds: int) -> dict[str, Array]:
        """Every array in float64, those not given repeated from the scene's robot."""
        return {
            item.name: np.asarray(given, dtype=np.float64)
            if (given := getattr(self, item.name)) is not None
            else np.repeat(np.asarray(getattr(scene.robot, item.name), dtype=np.float64)[None], worlds, axis=0)
            for item in fields(self)
        }


def initial_matter(scene: Scene, worlds: int, origin: Array, real: torch.dtype, device: str) -> Matter:
    """The scene at time zero in one slot; the window is the caller's to set."""
    robot, sand = scene.robot, scene.sand
    sand_count = sand.particle_count if sand else 0
    matter = Matter.zeros(1, worlds, robot.particle_count, sand_count, real, device)

    def put(target: Tensor, value: Array) -> None:
        target[:] = torch.as_tensor(np.ascontiguousarray(value), dtype=real, device=device)

    count = robot.particle_count
    put(matter.x[:, :, :count], robot.positions - origin)
    put(matter.v[:, :, :count], robot.velocities)
    if robot.velocity_gradients is not None:
        put(matter.C[:, :, :count], robot.velocity_gradients)
    put(matter.F, np.eye(3))
    if sand is not None:
        material = sand.material
        mu, lam = lame_parameters(material.youngs_modulus, material.poissons_ratio)
        put(matter.x[:, :, count:], sand.positions - origin)
        put(matter.b[..., :3], np.exp(2.0 * sand.strains))
        put(matter.tau[..., :3], 2.0 * mu * sand.strains + lam * sand.strains.sum(1, keepdims=True))
    return matter
