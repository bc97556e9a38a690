"""The tensors of a simulation: state and parameters of matter, and their adjoints; and the plan of a launch."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.arrays import Array
from zoobench.sim.model.matter import Law
from zoobench.sim.model.scene import MediumBed, Scene

IntArray = NDArray[np.int64]


@dataclass
class Matter:
    """State of all particles at a number of slots; positions are relative to the grid's first node.

    Attributes:
        x, v: `[slots, worlds, particles, 3]` [m], [m/s].
        C: `[slots, worlds, particles, 3, 3]` APIC matrix [1/s].
        F: `[slots, worlds, robot, 3, 3]` deformation gradient of the robot.
        b: `[slots, worlds, medium, 6]` elastic left Cauchy-Green tensor of a solid medium (xx yy zz xy xz yz).
        history: `[slots, worlds, medium]` the medium's log-volume gained, plastic volume ratio or J.
        tau: `[slots, worlds, medium, 6]` Kirchhoff stress of a solid medium [Pa].
        window: `[slots, worlds, 6]` first and past-the-last node in use.
    """

    x: Tensor
    v: Tensor
    C: Tensor
    F: Tensor
    b: Tensor
    history: Tensor
    tau: Tensor
    window: Tensor

    @classmethod
    def zeros(
        cls, slots: int, worlds: int, robot: int, medium: int, solid: int, real: torch.dtype, device: str
    ) -> Self:
        """All zero, for `medium` particles of which `solid` (all or none) store strain and stress."""

        def make(*shape: int) -> Tensor:
            return torch.zeros((slots, worlds, *shape), dtype=real, device=device)

        total = robot + medium
        return cls(
            x=make(total, 3),
            v=make(total, 3),
            C=make(total, 3, 3),
            F=make(robot, 3, 3),
            b=make(solid, 6),
            history=make(medium),
            tau=make(solid, 6),
            window=torch.zeros((slots, worlds, 6), dtype=torch.int32, device=device),
        )

    def tensors(self) -> list[Tensor]:
        """In the order in which the kernels take them."""
        return [getattr(self, item.name) for item in fields(self)]

    def copy_slot(self, slot: int) -> "Matter":
        """A one-slot copy: a checkpoint."""
        return Matter(*(tensor[slot : slot + 1].clone() for tensor in self.tensors()))

    def load_slot(self, slot: int, saved: "Matter") -> None:
        """Write a one-slot copy back into a slot, that of a single world into all worlds."""
        for target, source in zip(self.tensors(), saved.tensors(), strict=True):
            target[slot] = source[0]

    def copy_world(self, world: int, saved: "Matter") -> None:
        """Give one world at slot 0 the state that it has at slot 0 of another."""
        for target, source in zip(self.tensors(), saved.tensors(), strict=True):
            target[0, world] = source[0, world]

    def stop(self, slot: int, world: int) -> None:
        """Take all motion from one world at a slot."""
        self.v[slot, world] = 0.0
        self.C[slot, world] = 0.0

    def stop_after(self, slot: int, world: int) -> None:
        """Write one world at a slot into the next, without its motion."""
        for tensor in self.tensors():
            tensor[slot + 1, world] = tensor[slot, world]
        self.stop(slot + 1, world)

    def bytes_per_slot(self) -> int:
        """Memory of one slot [bytes]."""
        return sum(tensor[0].numel() * tensor.element_size() for tensor in self.tensors())

    def extended(self, slots: int, make: Callable[[tuple[int, ...], Tensor], Tensor]) -> "Matter":
        """So many slots of this size, in tensors that `make` gives for a shape and a tensor of the type."""
        return Matter(*(make((slots, *tensor.shape[1:]), tensor) for tensor in self.tensors()))

    def at(self, slots: IntArray) -> "Matter":
        """A one-slot copy of every world at its own slot `[worlds]`."""
        places, worlds = torch.as_tensor(slots), torch.arange(len(slots))
        return Matter(*(tensor[places, worlds][None] for tensor in self.tensors()))

    def load_worlds(self, worlds: IntArray, source: "Matter", slots: IntArray) -> None:
        """Give some worlds at slot 0 the states that they have at these slots of another, `[chosen]` each."""
        places, chosen = torch.as_tensor(slots), torch.as_tensor(worlds)
        for target, given in zip(self.tensors(), source.tensors(), strict=True):
            target[0, chosen] = given[places, chosen]


@dataclass
class Parameters:
    """Properties of the particles: constant through an episode but for the tension, which changes every control frame.

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


@dataclass
class LaunchPlan:
    """The substeps of a launch in each world.

    Attributes:
        slots: `[worlds, 2]` first slot read and number of substeps; a world with none is unchanged.
        dt: `[worlds]` step [s].
    """

    slots: Tensor
    dt: Tensor

    @classmethod
    def none(cls, worlds: int, real: torch.dtype, device: str) -> Self:
        """Nothing to do in any world."""
        slots = torch.zeros((worlds, 2), dtype=torch.int32, device=device)
        return cls(slots, torch.ones(worlds, dtype=real, device=device))

    def set(self, first: IntArray, counts: IntArray, dt: Array) -> None:
        """Give every world its first slot, number of substeps and step [s], `[worlds]` each."""
        self.slots[:] = torch.as_tensor(np.stack([first, counts], axis=1))
        self.dt[:] = torch.as_tensor(dt)

    @property
    def world_substeps(self) -> int:
        """Substeps of all worlds together."""
        return int(self.slots[:, 1].sum())


@dataclass(frozen=True)
class BodyState:
    """A design's arrays for every world; None takes those of the scene's robot.

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


def medium_share(medium: MediumBed, occupancy: Array) -> Array:
    """Share of each medium particle's volume `[worlds, medium]` that the robot's occupancy `[worlds, robot]` leaves."""
    share = np.ones((len(occupancy), medium.particle_count))
    if medium.hosts is not None:
        guests = medium.hosts >= 0  # medium particles that share the place of a robot particle
        share[:, guests] = 1.0 - occupancy[:, medium.hosts[guests]]
    return share


def empty_matter(scene: Scene, slots: int, worlds: int, real: torch.dtype, device: str) -> Matter:
    """Zeroed tensors of the size that the scene needs."""
    medium = scene.medium
    count = medium.particle_count if medium else 0
    solid = count if medium and medium.material.law != Law.WATER else 0
    return Matter.zeros(slots, worlds, scene.robot.particle_count, count, solid, real, device)


def initial_matter(scene: Scene, worlds: int, origin: Array, real: torch.dtype, device: str) -> Matter:
    """The scene at time zero in one slot, but for the window, which the caller sets."""
    robot, medium = scene.robot, scene.medium
    matter = empty_matter(scene, 1, worlds, real, device)

    def put(target: Tensor, value: Array) -> None:
        target[:] = torch.as_tensor(np.ascontiguousarray(value), dtype=real, device=device)

    count = robot.particle_count
    put(matter.x[:, :, :count], robot.positions - origin)
    put(matter.v[:, :, :count], robot.velocities)
    if robot.velocity_gradients is not None:
        put(matter.C[:, :, :count], robot.velocity_gradients)
    put(matter.F, np.eye(3))
    if medium is not None:
        put(matter.x[:, :, count:], medium.positions - origin)
        put(matter.history, medium.history)
        if medium.velocities is not None:
            put(matter.v[:, :, count:], medium.velocities)
        if medium.material.law != Law.WATER:
            put(matter.b, medium.left_cauchy_green)
            put(matter.tau, medium.stress)
    return matter
