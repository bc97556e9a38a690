"""Observations frame after frame: the bits of the model's."""

import numpy as np
import pytest
import torch

from zoobench import registry
from zoobench.cell.observation import ObservationModel
from zoobench.cell.observer import Observer
from zoobench.designs.caterpillar import Caterpillar
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

BODY = Caterpillar().body(Fidelity(1 / 64))


@pytest.mark.parametrize(
    "task", [None, "final-position", "movement-speed", "turning", "velocity-tracking", "waypoint-following"]
)
def test_an_observer_sees_the_bits_of_the_model(task: str | None) -> None:
    """At rest, upright, where the state is not finite, and in motion; nothing is left of the state before."""
    rng = np.random.default_rng(0)
    model = ObservationModel(BODY, registry.create(Kind.TASK, Ref(task)) if task else None, 200)
    weights = model.weights(torch.as_tensor(rng.uniform(0.0, 1.0, BODY.particle_count)))
    rest = torch.as_tensor(BODY.positions)
    positions, velocities = torch.zeros((2, *rest.shape), dtype=torch.float64)
    begun = weights.share @ rest
    observer = Observer(model, weights, positions, velocities, begun)
    upright = rest[:, [1, 0, 2]]
    wild = torch.where(torch.arange(len(rest))[:, None] == 5, torch.nan, rest)
    moved = [rest + torch.as_tensor(rng.normal(0.0, 0.01, rest.shape)) for _ in range(20)]
    for frame, state in enumerate((rest, upright, wild, *moved)):
        positions.copy_(state)
        velocities.copy_(torch.as_tensor(rng.normal(size=rest.shape)) * bool(frame))
        expected = model.observe_with(weights, frame, positions, velocities, begun).numpy()
        seen = np.full(model.count, 7.0)
        observer.write(frame, seen)
        np.testing.assert_array_equal(seen.view(np.int64), expected.view(np.int64))
