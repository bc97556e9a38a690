"""Actuation for studies without a method: a travelling wave, or a controller with random parameters."""

import numpy as np

from zoobench.arrays import Array
from zoobench.controllers.base import Controller, OpenLoop
from zoobench.errors import UsageError
from zoobench.spec import FRAME_SECONDS


def travelling_wave(frames: int, muscle_count: int) -> Array:
    """Full actuation at 20 rad/s, with phases spread evenly over the muscles `[frames, 1, muscle_count]`."""
    times = np.arange(frames)[:, None, None] * FRAME_SECONDS
    phases = np.linspace(0, 2 * np.pi, muscle_count, endpoint=False)
    return np.sin(20 * times + phases)


def random_actuation(controller: Controller, muscle_count: int, frames: int, worlds: int, seed: int) -> Array:
    """Actuation by draws from the controller's prior, one for each world `[frames, worlds, muscle_count]`.

    Raises:
        UsageError: the controller is a closed loop.
    """
    import torch

    if not isinstance(controller, OpenLoop):
        raise UsageError(
            "A closed-loop controller has no actuation before the robot moves, but this study fixes it in advance. "
            "Give a controller with the tag open-loop; `zoobench list controllers` shows the tags."
        )
    rng = np.random.default_rng(seed)
    parameters = torch.as_tensor(np.array([controller.initial(rng, muscle_count) for _ in range(worlds)]))
    times = torch.arange(frames, dtype=torch.float64) * FRAME_SECONDS
    return controller.actuation(parameters, times, muscle_count).numpy()
