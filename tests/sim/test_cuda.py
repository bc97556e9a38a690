"""The simulation on a GPU, where there is one."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Gradient, Rollout

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")

FRAMES = 3


def _episodes(name: str, given: Fidelity) -> list[tuple[Rollout, Gradient]]:
    """An episode of three worlds on the CPU and on the GPU, and the gradients."""
    return [
        scenes.episode(scenes.SCENES[name](), FRAMES, replace(given, device=device), worlds=3)[1:]
        for device in ("cpu", "cuda")
    ]


def _distance(one: Array, other: Array) -> float:
    """The largest difference, by the largest value."""
    return float(np.abs(one - other).max() / max(np.abs(one).max(), 1e-300))


@pytest.mark.parametrize("name", scenes.SCENES)
@pytest.mark.parametrize(("precision", "motion", "slope"), [(64, 1e-11, 1e-9), (32, 1e-5, 1e-2)])
def test_gpu_equals_cpu(name: str, precision: int, motion: float, slope: float) -> None:
    """Trajectories and gradients agree to rounding, with the same substeps."""
    (one, gradient), (other, found) = _episodes(name, scenes.fidelity(precision))
    assert np.array_equal(one.counts, other.counts)
    assert np.abs(one.positions - other.positions).max() < motion
    for group in scenes.GROUPS:
        assert _distance(getattr(gradient, group), getattr(found, group)) < slope, group
