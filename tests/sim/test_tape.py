"""Gradients from the tape and from checkpoints: the same bits however little is stored, in all that can happen."""

import gc
import weakref
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.sim import step_control
from zoobench.sim.launcher import Launcher
from zoobench.sim.model.diagnostics import Finding
from zoobench.sim.model.rollout import Feedback, FeedbackAdjoint, Gradient, Rollout, SubstepMeter
from zoobench.sim.model.segmentation import OTHER_STATES, whole_frames
from zoobench.sim.model.state import Matter
from zoobench.sim.solver import BodyState, Solver
from zoobench.sim.step_control import StepControl

WORLDS, REST, FRAMES = 3, 3, 4

BROKEN = Finding("det F", -1.0, 0.0, 0, "None.")

STORED = {
    "tape": {},
    "tape left half-way": {"checkpoint_interval": REST + FRAMES},
    "whole frames": {"checkpoint_interval": 2},
    "pieces of a frame": {"memory": 60},
    "halves": {"memory": 32},
}
"""Ways to store; memory in states."""


def _loop(solver: Solver) -> tuple[Feedback, FeedbackAdjoint]:
    """Actuation that follows the state, and its adjoint."""
    weights = np.random.default_rng(5).normal(size=(2, scenes.MUSCLES, solver.robot_count, 3)) / solver.robot_count
    seen: dict[int, Array] = {}

    def act(frame: int, positions: Any, velocities: Any) -> Array:
        drive = sum(np.einsum("mpd,wpd->wm", w, s) for w, s in zip(weights, (positions, velocities), strict=True))
        seen[frame] = 0.5 * np.sin(20.0 * drive)
        return np.asarray(seen[frame])

    def adjoint(frame: int, actuation: Array) -> tuple[Array, Array]:
        slope = 10.0 * np.sqrt(np.maximum(1.0 - (2.0 * seen[frame]) ** 2, 0.0)) * actuation
        positions, velocities = (np.einsum("mpd,wm->wpd", w, slope) for w in weights)
        return positions, velocities

    return act, adjoint


class Eventful:
    """Three bodies that come to rest first; the second repeats two frames, the third diverges.

    Args:
        stored: options of the solver; memory in states.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, precision: int, **stored: int) -> None:
        scene = scenes.ground_scene()
        if "memory" in stored:
            stored = {"memory": stored["memory"] * _solver(precision).matter.bytes_per_slot()}
        self.solver = _solver(precision, gradients=True, **stored)
        body = BodyState(stiffness=np.repeat([[0.3], [1.0], [0.6]], scene.robot.particle_count, axis=1))
        act, self._adjoint = _loop(self.solver)
        still = np.zeros((FRAMES, WORLDS, scenes.MUSCLES))
        failures = StepControl._failures

        def failing(control: StepControl, frame: int) -> dict[int, Finding]:
            """World 1 at the first two tries of two frames, world 2 at every try of the last but one."""
            found, retries = failures(control, frame), control._rollout.retries
            if int(retries[1]) < {REST - 1: 2, REST + 1: 4}.get(frame, 0):
                found[1] = BROKEN
            if frame == REST + FRAMES - 2 and int(control._sim.alive[2]):
                found[2] = BROKEN
            return found

        with monkeypatch.context() as patch:
            patch.setattr(StepControl, "_failures", failing)
            patch.setattr(step_control, "MOST_REFINEMENT", 4)
            self.rollout = self.solver.run(still, body, feedback=act, equilibration=REST)

    def gradient(self) -> Gradient:
        """For a random functional of the trajectory and of the muscles' work."""
        weights, work = scenes.path_weights(self.solver, FRAMES), scenes.actuation(self.solver, FRAMES, seed=6)
        return self.solver.backward(self.rollout, *weights, feedback=self._adjoint, work_adjoint=work)


def _solver(precision: int, **options: Any) -> Solver:
    return Solver(scenes.ground_scene(), scenes.fidelity(precision, courant=0.05), worlds=WORLDS, **options)


@pytest.fixture(scope="module", params=[32, pytest.param(64, marks=pytest.mark.slow)])
def whole(request: pytest.FixtureRequest) -> Iterator[tuple[int, Rollout, Gradient, SubstepMeter]]:
    """The episode with all its states on the tape."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        episode = Eventful(monkeypatch, request.param)
        gradient = episode.gradient()
        yield request.param, episode.rollout, gradient, episode.solver.meter


def test_a_whole_tape_recomputes_nothing(whole: tuple[int, Rollout, Gradient, SubstepMeter]) -> None:
    """Though worlds were stopped, repeated frames and diverged."""
    _, rollout, gradient, meter = whole
    assert (set(rollout.divergences), rollout.retries[:2].tolist()) == ({2}, [0, 4])
    assert rollout.stops[:, :2].sum() > 2
    assert gradient.actuation[:, :2].any()
    assert not gradient.actuation[:, 2].any()
    assert not gradient.fault
    assert len(rollout.segments) == 1
    assert meter.recomputed == 0


@pytest.mark.parametrize("way", [way for way in STORED if way != "tape"])
def test_what_is_stored_changes_no_bit(
    way: str, whole: tuple[int, Rollout, Gradient, SubstepMeter], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the trajectory, its substeps and stops, the gradient, and of what is charged."""
    precision, rollout, gradient, meter = whole
    episode = Eventful(monkeypatch, precision, **STORED[way])
    other = episode.rollout
    for name in ("positions", "velocities", "actuation", "muscle_potential", "counts", "stops", "retries"):
        np.testing.assert_array_equal(getattr(other, name), getattr(rollout, name), name)
    assert scenes.same(episode.gradient(), gradient)
    spent = episode.solver.meter
    assert replace(spent, recomputed=0) == replace(meter, recomputed=0)
    healthy = int(rollout.counts[:, :2].sum())
    assert spent.recomputed >= healthy
    pieces = other.segmentation.pieces if other.segmentation else 0
    assert (pieces > 1) == (way == "pieces of a frame")
    assert (len(other.segments) == 2) == (way == "tape left half-way")


def test_a_rollout_can_be_differentiated_after_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its states are computed again where the tape has been written over, or was released."""
    first, _, gradient = scenes.episode(scenes.ground_scene(), 3)
    weights = scenes.path_weights(first, 3)
    rollouts = [first.run(sign * scenes.actuation(first, 3)) for sign in (1.0, -1.0)]
    again, other = (first.backward(rollout, *weights) for rollout in rollouts)
    assert scenes.same(again, gradient)
    assert not scenes.same(other, gradient)
    assert first.meter.recomputed == rollouts[0].counts.sum() + rollouts[1].counts.sum()
    assert scenes.same(first.backward(rollouts[1], *weights), other)
    assert first.meter.recomputed == rollouts[0].counts.sum() + rollouts[1].counts.sum(), "it was on the tape"
    first.release()
    assert scenes.same(first.backward(rollouts[0], *weights), gradient)


def test_a_released_tape_takes_no_memory(
    nothing_compiled: None, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """Though what Taichi compiled a kernel with refers to its first tensors until the garbage is collected."""
    rooms: list[weakref.ref[Array]] = []
    zeros = np.zeros

    def noted(*given: Any) -> Array:
        room = zeros(*given)
        rooms.append(weakref.ref(room))
        return room

    request.addfinalizer(gc.enable)
    gc.disable()
    solver = Solver(scenes.flight_scene(), scenes.fidelity(32), gradients=True, checkpoint_interval=2)
    storage = whole_frames(2, solver.substeps_per_frame)
    with monkeypatch.context() as patch:
        patch.setattr(np, "zeros", noted)
        solver._tape_of(storage)
    rollout = solver.run(scenes.actuation(solver, 2))
    solver.backward(rollout, *scenes.path_weights(solver, 2))
    assert rooms
    assert all(room() is not None for room in rooms), "it was used"
    solver.release()
    assert all(room() is None for room in rooms)


@pytest.mark.parametrize("states", [30, *(pytest.param(n, marks=pytest.mark.slow) for n in (40, 60)), 400])
def test_memory_is_kept(states: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """All states that are alive at any launch fit, though frames take more substeps than declared."""
    size = _solver(64).matter.bytes_per_slot()
    made: list[weakref.ref[Matter]] = []
    make, most = Matter.__init__, 0

    def noted(matter: Matter, *given: Any, **named: Any) -> None:
        made.append(weakref.ref(matter))
        make(matter, *given, **named)

    monkeypatch.setattr(Matter, "__init__", noted)
    for name in ("advance", "reverse"):
        launch = getattr(Launcher, name)

        def watched(*given: Any, launch: Callable[..., None] = launch) -> None:
            nonlocal most
            alive = [matter for one in made if (matter := one()) is not None]
            most = max(most, sum(matter.bytes_per_slot() * len(matter.x) for matter in alive))
            launch(*given)

        monkeypatch.setattr(Launcher, name, watched)
    Eventful(monkeypatch, 64, memory=states).gradient()
    assert most <= states * size
    assert most > 0.5 * min(states, 60) * size, "the states are counted"


def test_memory_too_small_for_anything_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the episode begins."""
    with pytest.raises(UsageError, match=r"7 frames need at least .* MB .* are allowed\. Give more memory"):
        Eventful(monkeypatch, 64, memory=OTHER_STATES + 2)
