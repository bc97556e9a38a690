"""The muscles' energy at frame boundaries does not depend on how many frames are computed together."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import torch

from zoobench.sim import muscle_energy
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.state import Matter, Parameters
from zoobench.sim.muscle_energy import MuscleEnergy

_FRAMES, _WORLDS, _ROBOT = 7, 2, 37


def _parameters() -> Parameters:
    parameters = Parameters.zeros(_WORLDS, _ROBOT, _ROBOT + 3, torch.float32, "cpu")
    parameters.body.numpy()[:] = np.random.default_rng(1).uniform(0.1, 1.0, parameters.body.shape)
    return parameters


def _energy() -> MuscleEnergy:
    energy = MuscleEnergy(strength=1e4)
    energy.set_body(_parameters())
    return energy


def _rollout(muscles: int) -> Rollout:
    membership = np.random.default_rng(2).uniform(size=(_WORLDS, _ROBOT, muscles))
    potential = np.full((_FRAMES, _WORLDS, muscles), np.nan)
    return cast("Rollout", SimpleNamespace(muscle_potential=potential, body={"muscle_membership": membership}))


def _states() -> list[Matter]:
    rng = np.random.default_rng(3)
    states = [Matter.zeros(1, _WORLDS, _ROBOT, 3, solid=True, real=torch.float32, device="cpu") for _ in range(_FRAMES)]
    for state in states:
        state.state.numpy()[:] = rng.normal(size=state.state.shape)
    return states


@pytest.mark.parametrize("muscles", [1, 4])
@pytest.mark.parametrize("most_bytes", [0, 3 * _WORLDS * _ROBOT * 9 * 4, 1 << 30])
def test_frames_together_give_the_bits_of_each_alone(
    muscles: int, most_bytes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And those of the definition, to rounding: 1/2 strength sum membership volume |F d|^2."""
    alone, together = _rollout(muscles), _rollout(muscles)
    energy = _energy()
    for frame, state in enumerate(_states()):
        energy.note(alone, frame, state)
        energy.finish()
    monkeypatch.setattr(muscle_energy, "_MOST_BYTES", most_bytes)
    for frame, state in enumerate(_states()):
        energy.note(together, frame, state)
        state.state.zero_()  # the simulation goes on
    energy.finish()
    np.testing.assert_array_equal(together.muscle_potential, alone.muscle_potential)
    state = _states()[4]
    stretched = np.einsum("wpij,jwp->wpi", state.F[0].double().numpy(), energy._fibre[:, 0, 0])
    expected = np.einsum("wpk,wp,wp->wk", alone.body["muscle_membership"], energy._energy, (stretched**2).sum(-1))
    np.testing.assert_allclose(alone.muscle_potential[4], expected, rtol=1e-12)


def test_potential_is_the_same_where_the_simulation_is() -> None:
    """As on a GPU, which computes it at once."""
    energy, rollout, state = _energy(), _rollout(3), _states()[0]
    energy.note(rollout, 0, state)
    energy.finish()
    found = energy.potential(torch.as_tensor(rollout.body["muscle_membership"]), state.F[0])
    assert found == pytest.approx(rollout.muscle_potential[0], rel=1e-12)


def test_another_rollout_completes_the_one_before() -> None:
    """Two solvers' rollouts may be recorded in turn."""
    first, second = _rollout(2), _rollout(2)
    energy, state = _energy(), _states()[0]
    energy.note(first, 0, state)
    energy.note(second, 1, state)
    energy.finish()
    np.testing.assert_array_equal(first.muscle_potential[0], second.muscle_potential[1])
    assert np.isfinite(first.muscle_potential[0]).all()
    assert np.isnan(second.muscle_potential[0]).all()


def test_muscles_that_were_changed_in_place_count_for_the_next_body() -> None:
    """Which particles are whose is found again when a body is set, though its array is the same."""
    energy, rollout, state = _energy(), _rollout(2), _states()[0]
    energy.note(rollout, 0, state)
    energy.finish()
    rollout.body["muscle_membership"][:, ::2] = 0.0
    energy.set_body(_parameters())
    energy.note(rollout, 1, state)
    energy.finish()
    anew = _energy()
    anew.note(rollout, 2, state)
    anew.finish()
    np.testing.assert_array_equal(rollout.muscle_potential[1], rollout.muscle_potential[2])
    assert (rollout.muscle_potential[0] > rollout.muscle_potential[1]).all()
