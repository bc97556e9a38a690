"""The protocol of tasks: score, reward and objective as differentiable functions of the robot's motion, in torch."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from zoobench.arrays import Array
from zoobench.spec import Scalar
from zoobench.tasks.task_place import TaskPlace

if TYPE_CHECKING:
    import torch
    from torch import Tensor


@dataclass(frozen=True)
class Metric:
    """A measured number with its unit."""

    value: float
    unit: str


@dataclass(frozen=True)
class ObjectMotion:
    """The motion of an object in every world; the first state is that before any control.

    Attributes:
        positions: `[frames + 1, worlds, particle_count, 3]` [m].
        velocities: the same shape [m/s].
        masses: `[particle_count]` [kg].
        rest: positions without strain `[particle_count, 3]` [m].
    """

    positions: "Tensor"
    velocities: "Tensor"
    masses: "Tensor"
    rest: "Tensor"

    @property
    def share(self) -> "Tensor":
        """Share of the mass `[particle_count]`."""
        share: Tensor = self.masses / self.masses.sum()
        return share

    def centre_of_mass(self) -> "Tensor":
        """The centre of mass `[frames + 1, worlds, 3]` [m]."""
        centre: Tensor = self.share @ self.positions
        return centre

    def axes(self) -> "Tensor":
        """Directions of the object's x, y and z axis as rows `[frames + 1, worlds, 3, 3]`, see `axes_of`."""
        return self._axes

    @cached_property
    def _axes(self) -> "Tensor":
        return axes_of(self.positions, self.rest, self.share)


def axes_of(positions: "Tensor", rest: "Tensor", share: "Tensor") -> "Tensor":
    """Directions of a nearly rigid body's x, y and z axis as rows `[..., 3, 3]`, orthogonal unit vectors.

    By Gram and Schmidt from the linear map that fits its positions best, x first.

    Args:
        positions: `[..., particle_count, 3]` [m].
        rest: the same where the axes are those of the world `[particle_count, 3]` [m].
        share: of the mass `[particle_count]`.
    """
    import torch

    arm = rest - share @ rest
    weighed = share[:, None] * arm
    fit = torch.linalg.inv(arm.T @ weighed) @ (weighed.T @ positions)
    first = _unit(fit[..., 0, :])
    second = _unit(fit[..., 1, :] - (fit[..., 1, :] * first).sum(-1, keepdim=True) * first)
    return torch.stack([first, second, torch.linalg.cross(first, second)], dim=-2)


def _unit(vectors: "Tensor") -> "Tensor":
    unit: Tensor = vectors / vectors.square().sum(-1, keepdim=True).sqrt()
    return unit


@dataclass(frozen=True)
class Motion:
    """The robot's motion in every world; the first state is that before any control.

    Attributes:
        positions: `[frames + 1, worlds, particle_count, 3]` [m].
        velocities: the same shape [m/s].
        masses: `[worlds, particle_count]` [kg]; 0 for a particle that does not exist.
        frame_seconds: length of a control frame [s].
        rest: positions in the design's own frame, x ahead and y up, `[particle_count, 3]` [m].
        head, tail: 1 for a particle with this label, else 0 `[particle_count]`.
        muscle_work: work of every muscle on the body in every frame `[frames, worlds, muscle_count]` [J]; negative if
            the body stretched the muscle.
        occupancy: `[worlds, particle_count]` in [0, 1]; None if it is 1 for every particle with mass.
        swims: whether the body is in the midst of water, so that readings of swimming mean something.
        numbers: the control frames at whose ends the states are `[frames + 1]`; by default 0, 1, 2 and so on.
        objects: those of the scene by name.
    """

    positions: "Tensor"
    velocities: "Tensor"
    masses: "Tensor"
    frame_seconds: float
    rest: "Tensor"
    head: "Tensor"
    tail: "Tensor"
    muscle_work: "Tensor"
    occupancy: "Tensor | None" = None
    numbers: "Tensor | None" = None
    swims: bool = False
    objects: Mapping[str, ObjectMotion] = field(default_factory=dict)
    _known: "dict[str, Tensor]" = field(default_factory=dict, init=False, repr=False, compare=False)
    _of_bodies: "dict[Hashable, Tensor]" = field(default_factory=dict, init=False, repr=False, compare=False)

    def once(self, name: str, compute: "Callable[[], Tensor]") -> "Tensor":
        """A quantity that several readings of this motion share, by its name; computed once where no gradient is asked.

        With autograd at work every caller has a graph of its own.
        """
        import torch

        if torch.is_grad_enabled():
            value = compute()
            self._known[name] = value.detach()
            return value
        if name not in self._known:
            self._known[name] = compute()
        return self._known[name]

    def of_bodies(self, name: Hashable, compute: "Callable[[], Tensor]") -> "Tensor":
        """As `once`, of a quantity that depends on masses, occupancy and labels alone: it survives `forget`."""
        import torch

        if torch.is_grad_enabled():
            return compute()
        if name not in self._of_bodies:
            self._of_bodies[name] = compute()
        return self._of_bodies[name]

    def forget(self) -> None:
        """Forget readings of states that have been overwritten since."""
        self._known.clear()

    @property
    def object(self) -> ObjectMotion:
        """The first object; a task that reads it says so, see `Task.needs_object`."""
        return next(iter(self.objects.values()))

    @property
    def existing(self) -> "Tensor":
        """Occupancy `[worlds, particle_count]`; if none is given, 1 for particles with mass and 0 for the others."""
        return (self.masses > 0).to(self.positions.dtype) if self.occupancy is None else self.occupancy

    def clock(self) -> "Tensor":
        """Simulated time of every state `[frames + 1]` [s], a product and not a sum, so that it does not drift."""
        import torch

        counted = torch.arange(len(self.positions)) if self.numbers is None else self.numbers
        return counted.to(self.positions.dtype) * self.frame_seconds

    def mean_over_existing(self, values: "Tensor") -> "Tensor":
        """Mean over the particles, the third axis of `values`, weighted by occupancy."""
        shape = values.shape[3:]
        ones = (1,) * len(shape)

        def weights() -> "Tensor":
            return self.existing.reshape(1, *self.existing.shape, *ones)

        existing = self.of_bodies(("existing", shape), lambda: _like(weights(), shape))
        return (values * existing).sum(dim=2) / self.of_bodies(("all", ones), lambda: weights().sum(dim=2))

    def centre_of_mass(self) -> "Tensor":
        """The centre of mass `[frames + 1, worlds, 3]` [m]."""

        def compute() -> "Tensor":
            return (self.positions * self.of_bodies("shares of mass", shares)).sum(dim=2)

        def shares() -> "Tensor":
            return _like((self.masses / self.masses.sum(dim=1, keepdim=True))[None, :, :, None], (3,))

        return self.once("centre_of_mass", compute)


def _like(weights: "Tensor", shape: Sequence[int]) -> "Tensor":
    """Weights `[1, worlds, particle_count, 1, ...]`, where no gradient is asked repeated for values of that shape: a
    product takes a third of the time then."""
    import torch

    return weights if torch.is_grad_enabled() else weights.expand(*weights.shape[:3], *shape).contiguous()


class Route(Hashable, Protocol):
    """The path of a target, which begins at the robot's centre of mass; x is ahead at rest, z to the right."""

    def positions(self, times: Array) -> Array:
        """Positions `[times, 3]` [m] at times from 0 [s]."""

    def velocities(self, times: Array) -> Array:
        """Their first derivative `[times, 3]` [m/s]."""


class Target(NamedTuple):
    """A target at one time or several, its position [m] and velocity [m/s], `[3]` or `[times, 3]` each."""

    position: "Tensor"
    velocity: "Tensor"


def targets_of(route: Route, motion: Motion) -> Target:
    """The target at every state of a motion."""
    return _targets(route, motion.clock().numpy().tobytes())


@lru_cache(maxsize=1024)
def target_at(route: Route, time: float) -> Target:
    """The target at a time from 0 [s]."""
    return Target(*(part[0] for part in _targets(route, np.array([time]).tobytes())))


@lru_cache(maxsize=1024)  # every episode has the same times
def _targets(route: Route, times: bytes) -> Target:
    import torch

    clock = np.frombuffer(times)
    with torch.inference_mode(False):  # autograd may use them, whoever asks first
        return Target(
            *(torch.tensor(part, dtype=torch.float64) for part in (route.positions(clock), route.velocities(clock)))
        )


@lru_cache(maxsize=256)
def constant(values: tuple[float, ...], dtype: "torch.dtype") -> "Tensor":
    """A tensor that is needed every frame, and that autograd may use whoever asks first."""
    import torch

    with torch.inference_mode(False):
        return torch.tensor(values, dtype=dtype)


class Task(Protocol):
    """A task. All functions are differentiable and computed over all worlds at once.

    A task that derives from this class inherits the mean reward as its score and objective.

    Attributes:
        unit: of score, reward and objective.
        needs_object: whether it reads an object, so that it is possible only where there is one.
        needs_sides: whether only a body with muscles that differ left and right can do it.
        usual_settings: of an environment in which the task makes sense, for a robot on the ground, where a bare one is
            not enough or not what is meant; `below` is for one that hangs.
        needs_way: whether it counts how far the body itself gets, which one that is held at its base cannot.
    """

    unit: ClassVar[str]
    needs_object: ClassVar[bool] = False
    needs_sides: ClassVar[bool] = False
    needs_way: ClassVar[bool] = False
    usual_settings: ClassVar[Mapping[str, Scalar]] = {}

    @property
    def routes(self) -> "tuple[Route, ...]":
        """The paths of its targets, for which the arena must have room; by default none."""
        return ()

    def fault(self, where: TaskPlace) -> str:
        """Why the task makes no sense there, and what does; empty if it does, as by default."""
        return ""

    def reward(self, motion: Motion) -> "Tensor":
        """Reward of every control frame `[frames, worlds]`; higher is better.

        It depends on the state at the end of the frame, on the muscles' work in it and on the first state of the
        episode only, so that it is known at once.
        """

    def score(self, motion: Motion) -> "Tensor":
        """The episode's score `[worlds]`, as shown in tables; higher is better."""
        return self.reward(motion).mean(dim=0)

    def objective(self, motion: Motion) -> "Tensor":
        """The quantity that gradient methods maximise `[worlds]`: the score or a smoother substitute."""
        return self.score(motion)

    def metrics(self, motion: Motion) -> Mapping[str, tuple["Tensor", str]]:
        """Readings of the episode by name, each `[worlds]` with its unit."""


@dataclass(frozen=True)
class ObjectState:
    """An object at the start of a control frame.

    Attributes:
        start: centre of mass at the start of the episode `[3]` [m].
        centre: centre of mass now `[3]` [m].
        velocity: of the centre of mass `[3]` [m/s].
        axes: see `axes_of` `[3, 3]`.
    """

    start: "Tensor"
    centre: "Tensor"
    velocity: "Tensor"
    axes: "Tensor"


@dataclass(frozen=True)
class Situation:
    """The robot at the start of a control frame, from which a task tells a closed loop about itself.

    Attributes:
        time: since the start of the episode [s].
        start: centre of mass at the start of the episode `[3]` [m].
        centre: centre of mass now `[3]` [m].
        ahead, right: horizontal unit vectors of the present heading `[3]`.
        length: of the body at rest [m].
        objects: those of the scene by name.
    """

    time: float
    start: "Tensor"
    centre: "Tensor"
    ahead: "Tensor"
    right: "Tensor"
    length: float
    objects: Mapping[str, ObjectState] = field(default_factory=dict)

    @property
    def object(self) -> ObjectState:
        """The first object."""
        return next(iter(self.objects.values()))

    def components(self, vector: "Tensor") -> "Tensor":
        """The components of a vector `[3]` ahead and to the right `[2]`."""
        import torch

        return torch.mv(torch.stack([self.ahead, self.right]), vector)


class ObservedPart(NamedTuple):
    """A part of an observation, in words: its unit, - for pure numbers, and its meaning."""

    unit: str
    meaning: str


@runtime_checkable
class Observed(Protocol):
    """A task that adds to the observation; of any other a closed loop knows the time left only.

    An attribute `observed_parts` may hold an `ObservedPart` for each of the names, which tables of observations show.
    """

    def observed(self, situation: Situation) -> "Mapping[str, Tensor]":
        """The observations that the task adds, by name, each `[count]`, of order one; differentiable by the situation.

        Names and counts must be the same in every situation.
        """
