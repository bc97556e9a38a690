"""A stored gait: the controller of a run's solution, which stays as it is while the body changes."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench import registry
from zoobench.controllers.base import ClosedLoop, Controller, MusclePlaces, OpenLoop, Placed, Senses
from zoobench.inputs import Start, StoredRun, solution_in
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, kw_only=True)
class Gait:
    """The common base of open and closed gaits.

    Attributes:
        start: the solution, with the controller's parameters first.
    """

    start: Start

    def _with_stored(self, parameters: "Tensor", count: int) -> "Tensor":
        """The first of the solution's parameters `[..., count]` in place of none `[..., 0]`.

        Joined, so that the derivative by the empty parameters exists and is empty.
        """
        import torch

        values = parameters.new_tensor(self.start.params[:count])
        return torch.cat([parameters, values.expand(*parameters.shape[:-1], -1)], dim=-1)


@dataclass(frozen=True, kw_only=True)
class OpenGait(Gait):
    """A gait by the clock, an `OpenLoop`."""

    open_loop: OpenLoop

    def parameter_count(self, muscle_count: int) -> int:
        """None."""
        return 0

    def initial(self, rng: np.random.Generator, muscle_count: int) -> NDArray[np.float64]:
        """The empty vector."""
        return np.zeros(0)

    def actuation(self, parameters: "Tensor", times: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[frames, worlds, muscle_count]` for `parameters` `[worlds, 0]`, the same in every world."""
        stored = self._with_stored(parameters, self.open_loop.parameter_count(muscle_count))
        return self.open_loop.actuation(stored, times, muscle_count)


@dataclass(frozen=True, kw_only=True)
class PlacedGait(OpenGait):
    """An open gait that depends on where the muscles are, a `Placed` one, as a travelling wave."""

    def placed(self, places: MusclePlaces) -> OpenGait:
        """The gait on a body with its muscles there."""
        assert isinstance(self.open_loop, Placed)
        return replace(self, open_loop=self.open_loop.placed(places))


@dataclass(frozen=True, kw_only=True)
class ClosedGait(Gait):
    """A policy, a `ClosedLoop`."""

    closed_loop: ClosedLoop

    @property
    def sees(self) -> Senses:
        """The part of the observation that it receives."""
        found: Senses = getattr(self.closed_loop, "sees", "all")
        return found

    def parameter_count(self, muscle_count: int, observation_count: int) -> int:
        """None."""
        return 0

    def initial(self, rng: np.random.Generator, muscle_count: int, observation_count: int) -> NDArray[np.float64]:
        """The empty vector."""
        return np.zeros(0)

    def response(self, parameters: "Tensor", time: float, observation: "Tensor", muscle_count: int) -> "Tensor":
        """Activity `[muscle_count]` for `parameters` `[0]`."""
        stored = self._with_stored(parameters, self.closed_loop.parameter_count(muscle_count, len(observation)))
        return self.closed_loop.response(stored, time, observation, muscle_count)


@register(Kind.CONTROLLER, "stored", tags=("fixed",))
def stored_gait(*, run: StoredRun) -> OpenGait | ClosedGait:
    """The controller of a stored run's solution with the parameters found there: none of its own.

    A closed loop stays one: it reacts to what its new body does. The body needs as many muscles as that of the run,
    which are driven in their order.

    * `run`: a run that is done, in the same database.
    """
    start = solution_in(run)
    controller: Controller = registry.create(Kind.CONTROLLER, start.spec.controller)
    if isinstance(controller, OpenLoop):
        kind = PlacedGait if isinstance(controller, Placed) else OpenGait
        return kind(start=start, open_loop=controller)
    return ClosedGait(start=start, closed_loop=controller)
