"""Actuation for studies that compare no methods: a plain wave, or controllers with random parameters."""

import numpy as np

from zoobench.arrays import Array
from zoobench.controllers.base import Controller, OpenLoop
from zoobench.errors import UsageError
from zoobench.spec import FRAME_SECONDS


def travelling_wave(frames: int, muscle_count: int) -> Array:
    """Full actuation at 20 rad/s, `[frames, 1, muscle_count]`, the muscles one after the other."""
    times = np.arange(frames)[:, None, None] * FRAME_SECONDS
    phases = np.linspace(0, 2 * np.pi, muscle_count, endpoint=False)
    actuation: Array = np.sin(20 * times + phases)
    return actuation


def random_actuation(controller: Controller, muscle_count: int, frames: int, worlds: int, seed: int) -> Array:
    """Of the controller with random parameters in every world, `[frames, worlds, muscle_count]`.

    Raises:
        UsageError: the controller acts by what the robot feels.
    """
    import torch

    if not isinstance(controller, OpenLoop):
        raise UsageError(
            "A controller in a closed loop has no actuation before the robot has moved, but this study asks for one. "
            "Give a controller with the tag open-loop; `zoobench list controllers` has the tags."
        )
    rng = np.random.default_rng(seed)
    parameters = torch.as_tensor(np.array([controller.initial(rng, muscle_count) for _ in range(worlds)]))
    times = torch.arange(frames, dtype=torch.float64) * FRAME_SECONDS
    actuation: Array = controller.actuation(parameters, times, muscle_count).numpy()
    return actuation
