"""The account of an episode, and what keeps it."""

from dataclasses import replace

import numpy as np
import pytest

from zoobench.sim.solver import Solver
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe
from zoobench.verify.stability.ledger import episode, flagged, march


def _block() -> scenes.ElasticBody:
    return scenes.passive(scenes.lattice((0.25, 0.125, 0.25), (2, 2, 2)), velocity=np.array([1.0, 2.0, 0.0]))


def test_account_of_an_episode() -> None:
    """One entry at every frame, the solver's figures added to the probe."""
    probe = Probe()
    solver = Solver(scenes.drop(_block()), scenes.fidelity(64))
    rollout, ledger = episode(probe, solver, 5)
    assert not rollout.divergences
    assert len(ledger.entries) == 6
    assert ledger.growth <= 1.0 + 1e-12
    assert (probe.frames, probe.particle_frames) == (5, 5 * 64)
    assert probe.step == pytest.approx(0.008 / rollout.counts.max())


def test_march_keeps_account_and_reports_its_step() -> None:
    """Substeps of any length; a state that is out of bounds for the step is flagged."""
    probe = Probe()
    body = _block()
    solver = Solver(scenes.flight(replace(body, velocities=body.velocities * 2.0)), scenes.fidelity(64))
    solver.reset()
    ledger = march(probe, solver, 10, 1e-4, every=3)
    assert len(ledger.entries) == 5
    assert probe.step == 1e-4
    assert flagged(solver, 1e-4) == ""
    assert "Courant number" in flagged(solver, 1e-2)
