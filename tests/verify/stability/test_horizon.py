"""Rounding in a long gradient: the bounds are met, and missed with an error of 1 % in 32 bits."""

import numpy as np
import pytest
import torch

from zoobench.sim.launcher import Launcher
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.state import Matter, Parameters
from zoobench_verify.stability.episode_recorder import EpisodeRecorder
from zoobench_verify.stability.horizon import SingleSegment, check_gap, measure, walker
from zoobench_verify.stability.stability_scenes import muscle_wave

FRAMES = 10


def fallen(*, contact: bool) -> list[str]:
    """The failed checks of a short episode."""
    record = EpisodeRecorder()
    check_gap(record, measure(record, contact=contact, frames=FRAMES), contact=contact, frames=FRAMES)
    assert len(record.checks) >= 4
    return [check.text for check in record.checks if not check.is_met]


@pytest.mark.parametrize("contact", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_sound_arithmetic_is_within_all_bounds(contact: bool) -> None:
    """On the ground and in mid-air."""
    assert not fallen(contact=contact)


def test_an_adjoint_wrong_by_a_per_cent_in_32_bits_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though contact alone may make as large a difference between the precisions."""
    reverse = Launcher.reverse

    def wrong(launcher: Launcher, matter: Matter, parameters: Parameters, plan: LaunchPlan, *adjoints: object) -> None:
        reverse(launcher, matter, parameters, plan, *adjoints)  # type: ignore[arg-type]
        if matter.x.dtype == torch.float32:
            adjoints[1].tension.mul_(1.01)  # type: ignore[attr-defined]

    monkeypatch.setattr(Launcher, "reverse", wrong)
    assert any("on its path" in text for text in fallen(contact=True))


@pytest.mark.slow
def test_a_muscle_too_strong_by_a_per_cent_in_32_bits_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """In mid-air, where the whole difference counts."""
    set_tension = Parameters.set_tension

    def wrong(parameters: Parameters, tension: np.ndarray) -> None:
        set_tension(parameters, tension)
        if parameters.tension.dtype == torch.float32:
            parameters.tension.mul_(1.01)

    monkeypatch.setattr(Parameters, "set_tension", wrong)
    assert any("mid-air, 32 bits against 64" in text for text in fallen(contact=False))


def test_on_its_own_trajectory_it_is_the_gradient() -> None:
    """Bit for bit that of the solver, recomputed or given."""
    solver = walker(32, FRAMES)
    rollout = solver.run(muscle_wave(solver, FRAMES))
    adjoint = np.ones(rollout.positions.shape)
    expected = solver.backward(rollout, adjoint, 0.0 * adjoint).actuation
    own = SingleSegment(solver, rollout)
    assert (own.run(adjoint, 0.0 * adjoint).actuation == expected).all()
    assert own.states is not None
    assert (SingleSegment(solver, rollout, own.states).run(adjoint, 0.0 * adjoint).actuation == expected).all()
