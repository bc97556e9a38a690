"""Observations of one world frame after frame, without gradient."""

from typing import TYPE_CHECKING

from zoobench.arrays import Array
from zoobench.cell.observation import ObservationModel, Weights, observed
from zoobench.controllers.base import WAVE_RATE
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Situation

if TYPE_CHECKING:
    from torch import Tensor


class Observer:
    """`ObservationModel.observe_with` in a fraction of its time, bit for bit.

    Between the frames of a simulation a call of torch costs several times what it does in a loop of its own. Its
    products of arrays remain, since they decide the rounding, and write into arrays that are kept; what is of a few
    numbers is done by NumPy or Python.

    Args:
        model: of the observations.
        weights: of the body.
        positions, velocities: memory that holds the present state of the world `[particle_count, 3]` [m], [m/s].
        begun: centre of mass at the start of the episode `[3]` [m].
    """

    def __init__(
        self, model: ObservationModel, weights: Weights, positions: "Tensor", velocities: "Tensor", begun: "Tensor"
    ) -> None:
        import torch

        self._model, self._weights, self._begun = model, weights, begun
        self._positions, self._velocities = positions, velocities
        self._by_axis = positions.t(), velocities.t()
        self._means = torch.zeros((5, 3), dtype=torch.float64)
        self._head, self._tail, self._centre, self._speed, self._own = self._means
        self._totals = float(weights.head_total), float(weights.tail_total)
        self._axes = torch.eye(3, dtype=torch.float64)
        self._ahead, _, self._right = self._axes
        self._norm = torch.zeros(1, dtype=torch.float64)
        self._across = self._axes.t()
        self._muscles = len(weights.muscles)
        self._places, self._turned = torch.zeros((2, self._muscles, 3), dtype=torch.float64)
        # the same memory, for NumPy
        self._means_now, self._axes_now, self._norm_now = self._means.numpy(), self._axes.numpy(), self._norm.numpy()
        _, _, self._centre_now, self._speed_now, self._own_now = self._means_now
        self._places_now: Array = self._places.numpy()
        self._turned_now: Array = self._turned.numpy()
        self._begun_now, self._rest = begun.numpy(), weights.rest.numpy()

    def write(self, frame: int, seen: Array) -> None:
        """Write the observation of the present state, so many control frames after the start, into `seen` `[count]`."""
        import torch

        weights, length, muscles = self._weights, self._model.length, 8 + 3 * self._muscles
        places, speeds = self._by_axis
        torch.mv(places, weights.head, out=self._head)
        torch.mv(places, weights.tail, out=self._tail)
        torch.mv(places, weights.share, out=self._centre)
        torch.mv(speeds, weights.share, out=self._speed)
        self._turn(seen)
        torch.mv(self._axes, self._speed, out=self._own)
        seen[0:3] = self._own_now / (WAVE_RATE * length)
        seen[3:6] = (self._centre_now - self._begun_now) / length
        apart = self._relative(self._positions, self._centre_now)
        apart -= self._rest
        seen[8:muscles] = (apart / length).reshape(-1)
        faster = self._relative(self._velocities, self._speed_now)
        seen[muscles : 2 * muscles - 8] = (faster / (WAVE_RATE * length)).reshape(-1)
        if self._model.task is None:
            return
        situation = Situation(frame * FRAME_SECONDS, self._begun, self._centre, self._ahead, self._right, length)
        first = 2 * muscles - 8
        for values in observed(self._model.task, situation).values():
            seen[first : first + len(values)] = values.numpy()
            first += len(values)
        seen[first] = 1.0 - frame / self._model.frames

    def _turn(self, seen: Array) -> None:
        """Find the present axes, and write cosine and sine of the heading, as the model has them."""
        import torch

        (head, tail), ends = self._totals, zip(*self._means_now[:2].tolist(), strict=True)
        x, y, z = [one / head - other / tail for one, other in ends]
        y *= 0.0
        self._norm_now[0] = x * x + y * y + z * z + 1e-12
        torch.sqrt(self._norm, out=self._norm)  # which may differ from Python's in the last bit
        norm = float(self._norm_now[0])
        x, y, z = x / norm, y / norm, z / norm
        self._axes_now[:] = (x, y, z), (0.0, 1.0, 0.0), (y * 0.0 - z, z * 0.0 - x * 0.0, x - y * 0.0)
        seen[6:8] = x, z * -1.0

    def _relative(self, values: "Tensor", mean: Array) -> Array:
        """Means of the muscles relative to that of the body, along the axes `[muscles, 3]`, valid until the next call.

        Args:
            values: of the particles `[particle_count, 3]`.
            mean: of the body `[3]`.
        """
        import torch

        torch.mm(self._weights.muscles, values, out=self._places)
        self._places_now -= mean
        torch.mm(self._places, self._across, out=self._turned)
        return self._turned_now
