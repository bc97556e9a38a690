"""The observation: the input of closed-loop controllers and policies."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from zoobench.controllers.base import WAVE_RATE, Controller
from zoobench.designs.base import Body
from zoobench.sim.model.elastic_bodies import SceneObject
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import ObjectState, Observed, Situation, Task, axes_of, constant

if TYPE_CHECKING:
    import torch
    from torch import Tensor


Layout = tuple[tuple[str, int], ...]
"""The parts of an observation by name, each with its length."""


def layout_of(muscle_count: int, task: Task | None) -> Layout:
    """The layout of the observations of a robot with so many muscles; `task` is as in `ObservationModel`."""
    body = (("body", 8), ("muscles", 6 * muscle_count))
    if task is None:
        return body
    import torch

    zero, *axes = torch.cat([torch.zeros(1, 3), torch.eye(3)]).double()
    objects = {"object": ObjectState(zero, zero, zero, torch.stack(axes))}
    anywhere = Situation(time=0.0, start=zero, centre=zero, ahead=axes[0], right=axes[2], length=1.0, objects=objects)
    added = ((name, len(values)) for name, values in observed(task, anywhere).items())
    return (*body, *added, ("time_left", 1))


def seen_by(controller: Controller, task: Task) -> Task | None:
    """The task for the observations of this controller, None if it sees its own body only."""
    return None if getattr(controller, "sees", "all") == "body" else task


def observed(task: Task, situation: Situation) -> "Mapping[str, Tensor]":
    """The observations that the task adds; empty if it adds none."""
    return task.observed(situation) if _adds(type(task)) else {}  # type: ignore[attr-defined]


@cache
def _adds(task: type[Task]) -> bool:
    """Whether such tasks add to the observation; to ask a protocol takes as long as half an observation."""
    return issubclass(task, Observed)


@dataclass(frozen=True)
class ObservationModel:
    """Observations of one body at one task.

    Lengths are in units of the body's length L and velocities in 20 L/s. Vectors have the components ahead, up and
    right of the present heading, except the displacement, whose components are those of the heading at rest.

    * the centre of mass: velocity (3) and displacement since the start (3);
    * the heading: cosine and sine of its horizontal angle from that at rest (2);
    * each muscle: displacement of its centre from its place at rest (3) and velocity (3), both relative to the centre
      of mass;
    * the observations that the task adds, see `zoobench.tasks.base.Observed`;
    * the share of the episode that is left (1).

    Attributes:
        body: at rest.
        task: None for observations of the body only, without the last two.
        frames: length of the episode.
        objects: of the scene; their particles follow the robot's in every state.
    """

    body: Body
    task: Task | None
    frames: int
    objects: tuple[SceneObject, ...] = ()

    @cached_property
    def layout(self) -> Layout:
        """The parts of an observation."""
        return layout_of(self.body.muscle_count, self.task)

    @property
    def count(self) -> int:
        """Length of an observation."""
        return sum(count for _, count in self.layout)

    def observe(
        self,
        frame: int,
        positions: "Tensor",
        velocities: "Tensor",
        start: "Tensor",
        occupancy: "Tensor",
        membership: "Tensor | None" = None,
    ) -> "Tensor":
        """The observation `[count]`; differentiable by all tensors.

        Args:
            frame: number of control frames since the start of the episode.
            positions: of the robot's particles and of the objects' `[all particles, 3]` [m].
            velocities: `[all particles, 3]` [m/s].
            start: positions at the start of the episode `[all particles, 3]` [m].
            occupancy: of the robot's `[particle_count]` in [0, 1].
            membership: of its muscles `[particle_count, muscle_count]`; None for the body's own.
        """
        weights = self.weights(occupancy, membership)
        return self.observe_with(weights, frame, positions, velocities, self.centres(weights, start))

    def weights(self, occupancy: "Tensor", membership: "Tensor | None" = None) -> "Weights":
        """The weights of observations of a body with this occupancy and membership, as of `observe`, whatever its
        motion."""
        import torch

        masses = occupancy * torch.as_tensor(self.body.density_ratio * self.body.volumes)
        share = masses / masses.sum()
        membership = torch.as_tensor(self.body.muscle_membership) if membership is None else membership
        active = masses[:, None] * membership
        muscles = (active / _positive(active.sum(dim=0))).T
        head, tail = (share * torch.as_tensor(label.astype(np.float64)) for label in (self.body.head, self.body.tail))
        rest = torch.as_tensor(self.body.positions)
        ends = (head, _positive(head.sum()), tail, _positive(tail.sum()))
        return Weights(share, muscles, *ends, rest=muscles @ rest - share @ rest)

    def observe_with(
        self, weights: "Weights", frame: int, places: "Tensor", velocities: "Tensor", begun: "Tensor"
    ) -> "Tensor":
        """As `observe`, with the body's `weights` and the `centres` at the start of the episode."""
        import torch

        length, count = self.length, self.body.particle_count
        positions, moving, start = places[:count], velocities[:count], begun[0]
        axes, angle = _axes(weights, positions) if self.body.anchored is None else _still_axes(positions.dtype)
        centre, speed = weights.share @ positions, weights.share @ moving
        apart = (weights.muscles @ positions - centre) @ axes.T - weights.rest
        faster = (weights.muscles @ moving - speed) @ axes.T
        own = (axes @ speed / (WAVE_RATE * length), (centre - start) / length, angle)
        parts = [*own, (apart / length).reshape(-1), (faster / (WAVE_RATE * length)).reshape(-1)]
        if self.task is not None:
            objects = self._objects(places, velocities, begun)
            situation = Situation(frame * FRAME_SECONDS, start, centre, axes[0], axes[2], length, objects)
            parts += [*observed(self.task, situation).values(), centre.new_tensor([1.0 - frame / self.frames])]
        return torch.cat(parts)

    def centres(self, weights: "Weights", positions: "Tensor") -> "Tensor":
        """Centres of mass of the robot and the objects `[1 + object_count, 3]` [m]; arguments as above."""
        import torch

        robot = weights.share @ positions[: self.body.particle_count]
        return torch.stack([robot, *(share @ positions[own] for own, share, _ in self._matter)])

    def _objects(self, positions: "Tensor", velocities: "Tensor", begun: "Tensor") -> dict[str, ObjectState]:
        return {
            each.name: ObjectState(
                start, share @ positions[own], share @ velocities[own], axes_of(positions[own], rest, share)
            )
            for each, start, (own, share, rest) in zip(self.objects, begun[1:], self._matter, strict=True)
        }

    @cached_property
    def _matter(self) -> "list[tuple[slice, Tensor, Tensor]]":
        """Where an object's particles are, their shares of its mass, and their positions without strain [m]."""
        import torch

        found, first = [], self.body.particle_count
        for each in self.objects:
            masses = torch.as_tensor(each.body.masses)
            own = slice(first, first + len(masses))
            found.append((own, masses / masses.sum(), torch.as_tensor(each.body.positions)))
            first = own.stop
        return found

    @cached_property
    def length(self) -> float:
        """Length of the body at rest [m]."""
        return float(np.ptp(self.body.positions[:, 0]))


class Weights(NamedTuple):
    """Weights of a body's particles, with which its means are computed.

    Attributes:
        share: of the mass `[particle_count]`.
        muscles: of each muscle's mean `[muscle_count, particle_count]`.
        head, tail: of either end `[particle_count]`, with their sums `head_total` and `tail_total`.
        rest: places of the muscles relative to the centre of mass at rest `[muscle_count, 3]` [m].
    """

    share: "Tensor"
    muscles: "Tensor"
    head: "Tensor"
    head_total: "Tensor"
    tail: "Tensor"
    tail_total: "Tensor"
    rest: "Tensor"


def _still_axes(dtype: "torch.dtype") -> tuple["Tensor", "Tensor"]:
    """As `_axes`, of a robot that is held: it cannot turn, and its head may hang below its tail."""
    import torch

    return torch.eye(3, dtype=dtype), constant((1.0, 0.0), dtype)


def _positive(total: "Tensor") -> "Tensor":
    """A sum of weights, by which can be divided where all are zero, too."""
    import torch

    return total.clamp(min=torch.finfo(total.dtype).tiny)


def _axes(weights: Weights, positions: "Tensor") -> tuple["Tensor", "Tensor"]:
    """Unit vectors ahead, up and right as rows `[3, 3]`, and cosine and sine of the heading `[2]`.

    Ahead is the horizontal direction from the centre of the tail to that of the head.
    """
    import torch

    head, tail = weights.head @ positions / weights.head_total, weights.tail @ positions / weights.tail_total
    level = (head - tail) * constant((1.0, 0.0, 1.0), head.dtype)
    # a robot whose head is above its tail has no heading: the small constant [m^2] keeps the division finite
    ahead = level / torch.sqrt(level.square().sum() + 1e-12)
    up = constant((0.0, 1.0, 0.0), head.dtype)
    return torch.stack([ahead, up, torch.linalg.cross(ahead, up)]), ahead[::2] * constant((1.0, -1.0), head.dtype)
