"""Energy balances and the solver's figures of an episode."""

from dataclasses import replace

import numpy as np
import pytest

from zoobench.sim.solver import Solver
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, flagged


def _block() -> scenes.ElasticBody:
    return scenes.passive(scenes.lattice((0.25, 0.125, 0.25), (2, 2, 2)), velocity=np.array([1.0, 2.0, 0.0]))


def test_energy_balances_of_an_episode() -> None:
    """One balance at every frame, the solver's figures added to the record."""
    record = EpisodeRecorder()
    solver = Solver(scenes.drop(_block()), scenes.fidelity(64))
    rollout, energies = record.episode(solver, 5)
    assert not rollout.divergences
    assert len(energies.balances) == 6
    assert energies.growth <= 1.0 + 1e-12
    assert (record.frames, record.particle_frames) == (5, 5 * 64)
    assert record.step == pytest.approx(0.008 / rollout.counts.max())


def test_march_records_energy_and_step() -> None:
    """Substeps of any length; a state that is too fast for the step is flagged."""
    record = EpisodeRecorder()
    body = _block()
    solver = Solver(scenes.flight(replace(body, velocities=body.velocities * 2.0)), scenes.fidelity(64))
    solver.reset()
    energies = record.march(solver, 10, 1e-4, every=3)
    assert len(energies.balances) == 5
    assert record.step == 1e-4
    assert flagged(solver, 1e-4) == ""
    assert "Courant number" in flagged(solver, 1e-2)
