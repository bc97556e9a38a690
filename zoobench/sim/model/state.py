"""The tensors of a simulation: state and parameters of matter, and their adjoints."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.arrays import Array
from zoobench.sim.model.scene import MediumBed, Scene
from zoobench.sim.model.tensors import lazy_zeros, memory, put

IntArray = NDArray[np.int64]

ROBOT_ROWS, SOLID_ROWS = 8, 9
"""Rows of four lanes in which a particle is stored: place, velocity, three of C, three of F; a solid medium has four of
strain, history and stress in place of F."""

NODE_ROWS, WET_NODE_ROWS = 4, 6
"""Rows of four lanes of a node of a robot in its rest frame: place, velocity and two forces; in water by forces on the
surface two more for the added mass."""

WINDOW_SIZE = 8


@dataclass
class Matter:
    """State of all particles at a number of slots; positions are relative to the grid's first node.

    Attributes:
        state: `[slots, worlds, particles, rows, 4]` as `kernels.layout` has it.
        memory: its contents, see `memory`.
        window: `[slots, worlds, 8]` first and past-the-last node in use, and where momenta of the nodes are kept.
        flow: `[slots, worlds, cells, 4]` water on a grid, as `kernels.water_grid.water_layout` has it.
        robot: number of elastic particles, the robot's and those of objects, which come first.
        nodes: `[slots, worlds, nodes, NODE_ROWS or WET_NODE_ROWS, 4]` of a robot in its rest frame, as
            `kernels.rest_frame` has them; the particles' rows then follow from them.

    The other attributes are views of `state`:
        x, v: `[slots, worlds, particles, 3]` [m], [m/s].
        C: `[slots, worlds, particles, 3, 3]` APIC matrix [1/s].
        F: `[slots, worlds, robot, 3, 3]` deformation gradient of the robot.
        b: `[slots, worlds, medium, 6]` elastic left Cauchy-Green tensor of a solid medium (xx yy zz xy xz yz).
        history: `[slots, worlds, medium]` the medium's log-volume gained, plastic volume ratio or J.
        tau: `[slots, worlds, medium, 6]` Kirchhoff stress of a solid medium [Pa]; empty for a fluid, as b is.
    """

    state: Tensor
    window: Tensor
    flow: Tensor
    robot: int
    nodes: Tensor

    def __post_init__(self) -> None:
        self.memory = memory(self.state)
        self._memory = tuple(memory(tensor) for tensor in self.tensors() if tensor.numel())

    @classmethod
    def zeros(
        cls, slots: int, worlds: int, robot: int, medium: int, solid: bool, real: torch.dtype, device: str,
        cells: int = 0, nodes: tuple[int, int] = (0, NODE_ROWS),
    ) -> Self:  # fmt: skip
        """All zero, for `medium` particles, which store strain and stress if they are `solid`, `cells` of water, and
        `nodes` of the robot with so many rows.

        On the CPU, slots take no memory before they are written.
        """
        shape = (slots, worlds, robot + medium, SOLID_ROWS if solid else ROBOT_ROWS, 4)
        window = torch.zeros((slots, worlds, WINDOW_SIZE), dtype=torch.int32, device=device)
        flow = lazy_zeros((slots, worlds, cells, 4), real, device)
        return cls(
            lazy_zeros(shape, real, device), window, flow, robot,
            lazy_zeros((slots, worlds, *nodes, 4), real, device),
        )  # fmt: skip

    @property
    def x(self) -> Tensor:
        """Places [m]."""
        return self.state[..., 0, :3]

    @property
    def v(self) -> Tensor:
        """Velocities [m/s]."""
        return self.state[..., 1, :3]

    @property
    def C(self) -> Tensor:
        """APIC matrices [1/s]."""
        return self.state[..., 2:5, :3].transpose(-1, -2)

    @property
    def F(self) -> Tensor:
        """Deformation gradients of the robot."""
        return self.state[:, :, : self.robot, 5:8, :3].transpose(-1, -2)

    @property
    def b(self) -> Tensor:
        """Elastic left Cauchy-Green tensors of a solid medium."""
        return self._medium[..., 20:26]

    @property
    def history(self) -> Tensor:
        """Histories of the medium."""
        return self.state[:, :, self.robot :, 6, 2]

    @property
    def tau(self) -> Tensor:
        """Kirchhoff stresses of a solid medium [Pa]."""
        return self._medium[..., 28:34]

    @property
    def _medium(self) -> Tensor:
        """The numbers of a solid medium's particles; none of a fluid's."""
        first = self.robot if self.state.shape[3] == SOLID_ROWS else self.state.shape[2]
        return self.state[:, :, first:].flatten(3)

    @property
    def particles(self) -> tuple[Tensor, Tensor]:
        """State and window, as the kernels take them."""
        return self.state, self.window

    def tensors(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """All memory of the state."""
        return self.state, self.window, self.flow, self.nodes

    def _like(self, tensors: Iterable[Tensor]) -> "Matter":
        """Another state of these tensors, in the order of `tensors`."""
        state, window, flow, nodes = tensors
        return Matter(state, window, flow, self.robot, nodes)

    def robot_rows(self, first: int, last: int) -> Array:
        """Some rows of the robot's particles at slot 0, on the CPU `[worlds, robot, rows, 4]`: no copy."""
        rows: Array = self.memory[0, :, : self.robot, first:last]
        return rows

    def on(self, device: str) -> "Matter":
        """The same state on a device, itself where it is there."""
        return self if self.state.device.type == device else self._like(each.to(device) for each in self.tensors())

    def world(self, world: int) -> "Matter":
        """A copy of one world."""
        return self._like(tensor[:, world : world + 1].clone() for tensor in self.tensors())

    def copy_slot(self, slot: int) -> "Matter":
        """A one-slot copy: a checkpoint."""
        return self._like(tensor[slot : slot + 1].clone() for tensor in self.tensors())

    def load_slot(self, slot: int, saved: "Matter") -> None:
        """Write a one-slot copy back into a slot, that of a single world into all worlds."""
        for target, source in zip(self._memory, saved._memory, strict=True):
            target[slot] = source[0]

    def copy_world(self, world: int, saved: "Matter") -> None:
        """Give one world at slot 0 the state that it has at slot 0 of another."""
        for target, source in zip(self._memory, saved._memory, strict=True):
            target[0, world] = source[0, world]

    def stop(self, slot: int, world: int) -> None:
        """Take all motion from one world at a slot."""
        self.state[slot, world, :, 1:5] = 0.0
        self.flow[slot, world] = 0.0
        self.nodes[slot, world, :, 1] = 0.0

    def copy_after(self, slot: int, world: int) -> None:
        """Write one world at a slot into the next."""
        for tensor in self.tensors():
            tensor[slot + 1, world] = tensor[slot, world]

    def stop_after(self, slot: int, world: int) -> None:
        """Write one world at a slot into the next, without its motion."""
        self.copy_after(slot, world)
        self.stop(slot + 1, world)

    def bytes_per_slot(self) -> int:
        """Memory of one slot [bytes]."""
        return sum(tensor[0].numel() * tensor.element_size() for tensor in self.tensors())

    def extended(self, slots: int) -> "Matter":
        """So many zeroed slots of this size; on the CPU they take no memory before they are written."""
        return self._like(lazy_zeros((slots, *one.shape[1:]), one.dtype, str(one.device)) for one in self.tensors())

    def at(self, slots: IntArray) -> "Matter":
        """A one-slot copy of every world at its own slot `[worlds]`."""
        places, worlds = torch.as_tensor(slots), torch.arange(len(slots))
        return self._like(tensor[places, worlds][None] for tensor in self.tensors())

    def load_worlds(self, worlds: IntArray, source: "Matter", slots: IntArray) -> None:
        """Give some worlds at slot 0 the states that they have at these slots of another, `[chosen]` each."""
        for world, slot in zip(worlds.tolist(), slots.tolist(), strict=True):
            for target, given in zip(self._memory, source._memory, strict=True):
                target[0, world] = given[slot, world]


@dataclass
class Parameters:
    """Properties of the particles: constant through an episode but for the tension, which changes every control frame.

    Attributes:
        body: `[worlds, particles, 2, 4]` as `kernels.layout` has it; the other attributes are views of it.
        memory: its contents, see `memory`.
        robot: number of elastic particles, those of the robot and of objects.
        mass, volume: `[worlds, particles]` [kg], [m^3], both scaled by occupancy.
        stiffness: `[worlds, robot]` multiplier of E.
        tension: `[worlds, robot]` active stress along the fibre in this control frame [Pa].
        fibre: `[worlds, robot, 3]` unit rest direction.
        cover: `[worlds, robot]` multiplier of the volume by which faces of a water grid count as solid.
    """

    body: Tensor
    robot: int

    def __post_init__(self) -> None:
        self.memory = memory(self.body)

    @classmethod
    def zeros(cls, worlds: int, robot: int, particles: int, real: torch.dtype, device: str) -> Self:
        """All zero: the start of an adjoint."""
        return cls(torch.zeros((worlds, particles, 2, 4), dtype=real, device=device), robot)

    def tensors(self) -> tuple[Tensor]:
        """All memory of the parameters."""
        return (self.body,)

    @property
    def mass(self) -> Tensor:
        """Masses [kg]."""
        return self.body[:, :, 0, 0]

    @property
    def volume(self) -> Tensor:
        """Volumes [m^3]."""
        return self.body[:, :, 0, 1]

    @property
    def stiffness(self) -> Tensor:
        """Multipliers of E."""
        return self.body[:, : self.robot, 0, 2]

    @property
    def tension(self) -> Tensor:
        """Active stresses [Pa]."""
        return self.body[:, : self.robot, 0, 3]

    @property
    def fibre(self) -> Tensor:
        """Rest directions of the fibres."""
        return self.body[:, : self.robot, 1, :3]

    @property
    def cover(self) -> Tensor:
        """Multipliers of the volume in water on a grid."""
        return self.body[:, : self.robot, 1, 3]

    def set_tension(self, value: Array) -> None:
        """Write the active stresses `[worlds, robot]` [Pa]."""
        tension = self.memory[:, : self.robot, 0, 3]
        if isinstance(tension, np.ndarray):
            tension[...] = value
        else:
            tension[...] = torch.as_tensor(value, dtype=tension.dtype, device=tension.device)


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


def with_objects(arrays: dict[str, Array], scene: Scene) -> dict[str, Array]:
    """A robot's complete arrays `[worlds, robot, ...]`, and behind them those of the scene's objects."""
    if not scene.objects:
        return arrays
    count, all_of = scene.robot.particle_count, {}
    for name, own in arrays.items():
        others = np.asarray(getattr(scene.elastic, name), dtype=np.float64)[count:]
        all_of[name] = np.concatenate([own, np.repeat(others[None], len(own), axis=0)], axis=1)
    return all_of


def medium_share(medium: MediumBed, occupancy: Array) -> Array:
    """Share of each medium particle's volume `[worlds, medium]` that the robot's occupancy `[worlds, robot]` leaves."""
    share = np.ones((len(occupancy), medium.particle_count))
    if medium.hosts is not None:
        guests = medium.hosts >= 0  # medium particles that share the place of a robot particle
        share[:, guests] = 1.0 - occupancy[:, medium.hosts[guests]]
    return share


def empty_matter(
    scene: Scene, slots: int, worlds: int, real: torch.dtype, device: str, cells: int = 0, nodes: int = 0
) -> Matter:
    """Zeroed tensors of the size that the scene needs, with `cells` of water on a grid and `nodes` of the robot."""
    medium = scene.medium
    count = medium.particle_count if medium else 0
    solid = medium is not None and not medium.material.is_liquid
    rows = NODE_ROWS if scene.surface_water is None else WET_NODE_ROWS
    return Matter.zeros(slots, worlds, scene.elastic.particle_count, count, solid, real, device, cells, (nodes, rows))


def initial_matter(
    scene: Scene, worlds: int, origin: Array, real: torch.dtype, device: str, cells: int = 0, nodes: int = 0
) -> Matter:
    """The scene at time zero in one slot, but for the window and the robot's nodes, which the caller sets."""
    robot, medium = scene.elastic, scene.medium
    matter = empty_matter(scene, 1, worlds, real, device, cells, nodes)
    if scene.water is not None and scene.water.velocities is not None:
        put(matter.flow[..., :3], scene.water.velocities.reshape(-1, 3))

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
        if not medium.material.is_liquid:
            put(matter.b, medium.left_cauchy_green)
            put(matter.tau, medium.stress)
    return matter
