"""The simulation on a GPU, where there is one."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.sim import scenes
from zoobench import registry
from zoobench.arrays import Array
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.model.scene import Scene
from zoobench.spec import Ref

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")

FRAMES = 3


def _episodes(scene: Scene, given: Fidelity) -> list[tuple[Rollout, Gradient]]:
    """An episode of three worlds on the CPU and on the GPU, and the gradients."""
    return [scenes.episode(scene, FRAMES, replace(given, device=device), worlds=3)[1:] for device in ("cpu", "cuda")]


def _swimmer(given: Fidelity) -> Scene:
    """A fish in water by forces on its surface."""
    environment: Environment = registry.create(Kind.ENV, Ref.parse("ocean"))
    return environment.scene(registry.create(Kind.DESIGN, Ref("fish")).body(given), given)


def _distance(one: Array, other: Array) -> float:
    """The largest difference, by the largest value."""
    return float(np.abs(one - other).max() / max(np.abs(one).max(), 1e-300))


@pytest.mark.parametrize("name", scenes.SCENES)
@pytest.mark.parametrize(("precision", "motion", "slope"), [(64, 1e-11, 1e-9), (32, 1e-5, 1e-2)])
def test_gpu_equals_cpu(name: str, precision: int, motion: float, slope: float) -> None:
    """Trajectories and gradients agree to rounding, with the same substeps."""
    (one, gradient), (other, found) = _episodes(scenes.SCENES[name](), scenes.fidelity(precision))
    assert np.array_equal(one.counts, other.counts)
    assert np.abs(one.positions - other.positions).max() < motion
    for group in scenes.GROUPS:
        assert _distance(getattr(gradient, group), getattr(found, group)) < slope, group


@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize("make", [lambda _: scenes.ground_scene(), _swimmer])
def test_gpu_equals_cpu_in_the_rest_frame(make: Callable[[Fidelity], Scene], precision: int) -> None:
    """On the ground and in water, where each world has a thread of its own."""
    given = replace(scenes.fidelity(precision), robot="lagrangian")
    (one, gradient), (other, found) = _episodes(make(given), given)
    assert np.array_equal(one.counts, other.counts)
    assert np.abs(one.positions - other.positions).max() < (1e-11 if precision == 64 else 1e-5)
    for group in scenes.GROUPS:
        assert _distance(getattr(gradient, group), getattr(found, group)) < (1e-9 if precision == 64 else 1e-2), group
