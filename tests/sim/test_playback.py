"""Worlds with clocks of their own: the same states as in a run, whenever they are begun."""

from typing import Any

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import UsageError
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.playback import Playback
from zoobench.sim.solver import Solver

FRAMES = 6
WAVE = np.random.default_rng(0).uniform(-1.0, 1.0, (FRAMES, scenes.MUSCLES))


def _run() -> Rollout:
    return Solver(scenes.flight_scene(moving=False), scenes.fidelity()).run(WAVE[:, None])


def test_frame_by_frame_is_the_same_to_the_last_bit() -> None:
    """Positions, velocities, substeps and the work of muscles, in a world that goes through and in one begun again."""
    expected = _run()
    playback = Playback(Solver(scenes.flight_scene(moving=False), scenes.fidelity(), worlds=2))
    offset = 2  # frames by which the second world is behind, after it was begun again
    for frame in range(FRAMES):
        if frame == offset:
            playback.begin([1])
        playback.frame(np.stack([WAVE[frame], WAVE[frame - offset]]))
        for world, number in ((0, frame), (1, frame - offset)):
            if number < 0:
                continue
            rollout = playback.rollout
            np.testing.assert_array_equal(rollout.positions[1, world], expected.positions[number + 1, 0])
            np.testing.assert_array_equal(rollout.velocities[1, world], expected.velocities[number + 1, 0])
            np.testing.assert_array_equal(rollout.muscle_work[0, world], expected.muscle_work[number, 0])
            assert rollout.counts[0, world] == expected.counts[number, 0]
            assert playback.frames[world] == number + 1
            assert playback.substeps[world] == expected.counts[: number + 1].sum()


def test_a_frame_that_goes_on_surveys_the_robot_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """What else the step follows from is known from the end of the last frame, unless a world was begun or led in."""
    playback = Playback(Solver(scenes.medium_scene(), scenes.fidelity(), worlds=2))
    launcher = playback._sim.launcher
    surveys: list[bool] = []
    survey = launcher.survey

    def watched(*arrays: Any) -> None:
        surveys.append(arrays[-1] is not None)
        survey(*arrays)

    monkeypatch.setattr(launcher, "survey", watched)
    still = np.zeros((2, scenes.MUSCLES))
    for step in (
        lambda: playback.frame(still), lambda: playback.frame(still),
        lambda: playback.begin([1]), lambda: playback.frame(still),
        lambda: playback.lead_in(0, still[:1]), lambda: playback.frame(still),
    ):  # fmt: skip
        step()
    assert surveys == [False, False, True, False, *[False, False] * 3]


def test_a_world_that_diverges_says_when_in_its_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same frame, substep and value as in a run; it is not moved until it is begun again, the other goes on."""
    monkeypatch.setattr("zoobench.sim.model.diagnostics.LARGEST_COURANT", 1e-4)
    expected = _run().divergences[0]
    assert expected.frame < FRAMES - 1
    playback = Playback(Solver(scenes.flight_scene(moving=False), scenes.fidelity(), worlds=2))
    for frame in range(expected.frame + 1):
        assert not playback.rollout.divergences
        playback.frame(np.stack([WAVE[frame], 0.0 * WAVE[frame]]))
    found = playback.rollout.divergences[0]
    assert (found.frame, found.step, found.value, found.place) == (
        expected.frame,
        expected.step,
        expected.value,
        expected.place,
    )
    playback.begin([0])
    assert not playback.rollout.divergences
    assert playback.frames.tolist() == [0, expected.frame + 1]


def test_an_actuation_that_cannot_be_is_refused() -> None:
    """Another shape, or out of range."""
    playback = Playback(Solver(scenes.flight_scene(moving=False), scenes.fidelity()))
    for wrong in (np.zeros((2, scenes.MUSCLES)), np.full((1, scenes.MUSCLES), 1.5)):
        with pytest.raises(UsageError, match="actuation"):
            playback.frame(wrong)
