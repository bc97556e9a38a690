"""Steps follow the state, and a frame that fails is put back and repeated."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import UsageError
from zoobench.sim import step_control
from zoobench.sim.model.diagnostics import Finding
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.step_limits import MOST_REFINEMENT, Condition, elastic_kappa, isolated_particle_limit
from zoobench.sim.solver import BodyState, Solver


def _drop(speed: float) -> Scene:
    """A soft block just above the ground, thrown down at it."""
    body = scenes.passive_block((0.3, 0.02, 0.3), (3, 3, 3), np.array([0.0, -speed, 0.0]))
    soft = replace(body, material=scenes.SOFT)
    return Scene(soft, (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(0.5))


def test_step_follows_the_actuation() -> None:
    """A contracting muscle adds its stress to the stiffness, and so shortens the step of the frame that it acts in."""
    scene = scenes.flight_scene(moving=False)
    solver = Solver(scene, scenes.fidelity(courant=0.05))
    calm = np.zeros((3, 1, scenes.MUSCLES))
    tense = calm.copy()
    tense[1] = 1.0
    before, after = solver.run(calm).counts, solver.run(tense).counts
    assert after[0] == before[0]
    assert after[1] > before[1]


def test_step_is_that_of_the_formula() -> None:
    """At rest, of the stiffest and lightest particles: courant h sqrt(rho / kappa) in whole substeps."""
    scene = scenes.flight_scene(moving=False)
    robot = scene.robot
    solver = Solver(scene, scenes.fidelity(courant=0.3))
    rollout = solver.run(np.zeros((1, 1, scenes.MUSCLES)))
    mu, lam = scenes.SOFT.youngs_modulus / 2.4, scenes.SOFT.youngs_modulus * 0.2 / (1.2 * 0.6)
    ratio = max(
        elastic_kappa(mu, lam, k, 0.0, 1.0) / (d * scenes.SOFT.density)
        for k, d in zip(robot.stiffness, robot.density_ratio, strict=True)
    )
    assert rollout.counts[0, 0] == np.ceil(0.008 / (0.3 * isolated_particle_limit(scenes.fidelity(), ratio)))


def test_hardened_snow_shortens_the_step() -> None:
    """The stiffness is that of the plastic volume ratio of the moment: exp(xi (1 - J_P))."""
    solver = Solver(scenes.medium_scene("snow"), scenes.fidelity())
    solver.reset()
    loose = solver.current_limit()[0]
    solver.matter.history[:] = 0.9
    hard = solver.current_limit()[0]
    assert loose.matter == hard.matter == "snow"
    assert loose.dt_iso / hard.dt_iso == pytest.approx(np.exp(10 * 0.1 / 2), rel=1e-12)


@pytest.mark.parametrize(("speed", "binds"), [(0.1, False), (40.0, True)])
def test_fast_matter_shortens_the_step(speed: float, binds: bool) -> None:
    """No particle crosses more than 0.4 cells in a substep."""
    body = scenes.thrown_body(np.array([speed, 0.0, 0.0]))
    solver = Solver(scenes.weightless(body), scenes.fidelity(), frame_seconds=0.002)
    found = solver.current_limit()[0]
    assert (found.matter == "speed") == binds
    assert speed * found.dt <= 0.4 * scenes.SPACING * (1 + 1e-12)


def test_frame_that_fails_is_repeated_with_half_the_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of that world alone: its substeps double, the retry is counted and metered, the other world is unchanged."""
    scene = _drop(1.0)
    expected = Solver(scene, scenes.fidelity(), worlds=2).run(np.zeros((3, 2, 0)))
    seen = []
    diagnose = step_control.diagnose

    def fail_once(condition: Condition, dt: float, grid_spacing: float) -> Finding | None:
        seen.append(dt)
        broken = condition._replace(smallest_j=-1.0) if len(seen) == 4 else condition
        return diagnose(broken, dt, grid_spacing)

    monkeypatch.setattr(step_control, "diagnose", fail_once)
    solver = Solver(scene, scenes.fidelity(), worlds=2)
    rollout = solver.run(np.zeros((3, 2, 0)))
    assert rollout.retries.tolist() == [0, 1]
    assert not rollout.divergences
    assert rollout.counts[1].tolist() == [expected.counts[1, 0], 2 * expected.counts[1, 1]]
    assert solver.meter.forward == rollout.counts.sum() + expected.counts[1, 1]
    assert np.array_equal(rollout.positions[:, 0], expected.positions[:, 0])
    assert np.array_equal(rollout.positions[:2, 1], expected.positions[:2, 1])
    assert not np.array_equal(rollout.positions[2, 1], expected.positions[2, 1])


@pytest.mark.parametrize("gradients", [False, True])
@pytest.mark.parametrize("frame", [2, *(pytest.param(frame, marks=pytest.mark.slow) for frame in (3, 6))])
def test_a_repeated_frame_begins_with_the_state_before_it(
    frame: int, gradients: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bit for bit: in equilibration, after it, and of matter that sleeps; as if its step had been chosen at once."""
    scene = replace(scenes.medium_scene(), medium=scenes.medium_bed(first=5, cells=13))
    solver = Solver(scene, replace(scenes.fidelity(), sleep=0.5), worlds=2, gradients=gradients)
    actuation = scenes.actuation(solver, 4)
    calls = iter(range(100))
    diagnose = step_control.diagnose

    def fail_once(condition: Condition, dt: float, grid_spacing: float) -> Finding | None:
        is_broken = next(calls) == 2 * frame + 1
        return diagnose(condition._replace(smallest_j=-1.0) if is_broken else condition, dt, grid_spacing)

    with monkeypatch.context() as patch:
        patch.setattr(step_control, "diagnose", fail_once)
        rollout = solver.run(actuation, equilibration=4)
    assert rollout.retries.tolist() == [0, 1]
    assert rollout.asleep.any()
    monkeypatch.setattr(step_control.StepControl, "_choose", lambda _, frame: rollout.counts[frame])
    straight = solver.run(actuation, equilibration=4)
    for name in ("positions", "velocities", "stops", "asleep", "muscle_potential"):
        assert np.array_equal(getattr(rollout, name), getattr(straight, name)), name


@pytest.mark.parametrize("strength", [1e8, 1e303])
def test_hopeless_world_is_given_up_after_the_stated_retries(strength: float) -> None:
    """A sixteenth of the declared step, then a divergence; the world stays as it was before the frame."""
    scene = scenes.flight_scene()
    solver = Solver(scene, scenes.fidelity(), worlds=2)
    membership = np.repeat(scene.robot.muscle_membership[None], 2, axis=0)
    membership[1] = strength
    actuation = np.zeros((4, 2, scenes.MUSCLES))
    actuation[2:] = 0.5
    rollout = solver.run(actuation, BodyState(muscle_membership=membership))
    assert set(rollout.divergences) == {1}
    assert rollout.divergences[1].frame == 2
    assert rollout.retries[0] == 0
    assert rollout.counts[2:, 1].tolist() == [MOST_REFINEMENT * solver.substeps_per_frame, 0]
    assert np.array_equal(rollout.positions[2, 1], rollout.positions[4, 1])


def test_real_impact_is_saved_by_a_retry() -> None:
    """A block that hits a wall at 12 m/s inverts at the step of its flight, and survives at a shorter one."""
    scene = replace(_drop(12.0), ground=None)
    steady = Solver(scene, scenes.steady(scene)).run(np.zeros((4, 1, 0)))
    assert steady.divergences
    solver = Solver(scene, scenes.fidelity())
    rollout = solver.run(np.zeros((4, 1, 0)))
    assert not rollout.divergences
    assert rollout.smallest_j[0] > 0.0


def test_a_rollout_is_replayed_exactly() -> None:
    """Its substeps give it again bit for bit, whatever the state would have chosen; so do gradients."""
    solver, first, gradient = scenes.episode(scenes.medium_scene("sand"), 3)
    actuation, weights = scenes.actuation(solver, 3), scenes.path_weights(solver, 3)
    again = solver.run(actuation, replay=first)
    assert np.array_equal(again.positions, first.positions)
    assert np.array_equal(solver.backward(again, *weights).actuation, gradient.actuation)
    other = solver.run(actuation, replay=replace(first, counts=first.counts + 1))
    assert np.array_equal(other.counts, first.counts + 1)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"counts": np.ones((2, 1), int)}, "substeps of shape"),
        ({"counts": np.zeros((3, 1), int)}, "at least 1"),
        ({"asleep": np.ones((3, 1, 4), bool)}, "asleep of shape"),
    ],
)
def test_a_rollout_that_cannot_be_replayed_is_refused(changes: dict[str, np.ndarray], word: str) -> None:
    """Another number of frames, a frame without a substep, or sleepers of another scene."""
    solver = Solver(scenes.flight_scene(), scenes.fidelity())
    first = solver.run(scenes.actuation(solver, 3))
    with pytest.raises(UsageError, match=word):
        solver.run(scenes.actuation(solver, 3), replay=replace(first, **changes))


@pytest.mark.parametrize(
    "scene",
    [
        scenes.flight_scene(),
        # each compiles kernels of its own
        *(
            pytest.param(scene, marks=pytest.mark.slow)
            for scene in (scenes.medium_scene("snow"), scenes.wading_scene())
        ),
    ],
)
def test_a_renewed_condition_is_that_of_a_survey(scene: Scene) -> None:
    """After another activity, of the robot alone and beside what it moves in, to the last bit."""
    solver = Solver(scene, scenes.fidelity(), worlds=2)
    rng = np.random.default_rng(0)
    rollout = solver.run(rng.uniform(-1.0, 1.0, (3, 2, scenes.MUSCLES)))
    diagnostics = step_control.Diagnostics(solver.simulation)
    before = diagnostics.survey()
    rollout.actuation[0] = 1.0
    solver.simulation.set_tension(rollout, 0)
    renewed = diagnostics.renew(before)
    assert renewed == diagnostics.survey()
    assert renewed != before
