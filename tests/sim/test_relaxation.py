"""Episodes that begin with their equilibration: the state of rest, and derivatives through it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.terrain import Terrain
from zoobench.sim.rest import come_to_rest
from zoobench.sim.solver import BodyState, Solver

REST, FRAMES = 12, 6


def _body(stiffness: float) -> BodyState:
    return BodyState(stiffness=np.full((1, scenes.ground_scene().robot.particle_count), stiffness))


def _run(solver: Solver, stiffness: float, replay: Rollout | None = None) -> Rollout:
    actuation = 0.5 * np.ones((FRAMES, 1, solver.muscle_count))
    return solver.run(actuation, _body(stiffness), replay=replay, equilibration=REST)


def test_it_is_the_episode_that_begins_at_the_equilibrated_state() -> None:
    """In one run or in two: the same states bit for bit, and the episode alone is reported."""
    scene = scenes.ground_scene()
    solver = Solver(scene, scenes.fidelity())
    actuation = 0.5 * np.ones((FRAMES, 1, solver.muscle_count))
    together = solver.run(actuation, equilibration=REST).episode
    start = Solver(scene, scenes.fidelity()).equilibrate(REST)
    episode = Solver(scene, scenes.fidelity(), start=start).run(actuation)
    np.testing.assert_array_equal(together.positions, episode.positions)
    np.testing.assert_array_equal(together.velocities, episode.velocities)
    np.testing.assert_array_equal(together.muscle_work, episode.muscle_work)
    assert not together.velocities[0].any()


def test_a_body_goes_on_until_it_rests() -> None:
    """After one equilibration it still moves; after as many as it takes it only creeps down its slope of 3 degrees."""
    scene = scenes.ground_scene()

    def speed(solver: Solver) -> float:
        rollout = solver.run(np.zeros((25, 1, solver.muscle_count)))
        centres = rollout.positions[:, 0].mean(axis=1)
        return float(np.hypot(*(centres[-1] - centres[0])[[0, 2]]) / (25 * solver.frame_seconds))

    once = Solver(scene, scenes.fidelity(), start=Solver(scene, scenes.fidelity()).equilibrate(8))
    rested = Solver(scene, scenes.fidelity())
    state = come_to_rest(rested, 40)
    assert not state.v.any()
    assert speed(once) > 1e-5 > 2e-6 > speed(rested)


@pytest.mark.parametrize(("terrain", "rounds"), [(None, 3), (Terrain(np.zeros((9, 9)), 0.1), 1)])
def test_on_a_terrain_a_body_is_left_after_one_equilibration(terrain: Terrain | None, rounds: int) -> None:
    """It may slide there for ever; on level ground it goes on, here until it has had its rounds."""
    scene = scenes.ground_scene()
    assert scene.ground is not None
    solver = Solver(replace(scene, ground=replace(scene.ground, terrain=terrain)), scenes.fidelity())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("zoobench.sim.rest.MOST_ROUNDS", 2)
        patch.setattr("zoobench.sim.rest.REST_SPEED", 0.0)
        calls: list[int] = []
        equilibrate = solver.equilibrate
        patch.setattr(solver, "equilibrate", lambda frames: (calls.append(frames), equilibrate(frames))[1])
        come_to_rest(solver, 4)
    assert calls == [4, 2, 2][:rounds]


def test_worlds_come_to_rest_independently() -> None:
    """A soft and a firm body side by side are stopped at their own times, each as if alone."""
    scene = scenes.ground_scene()
    pair = BodyState(stiffness=np.repeat([[0.1], [1.0]], scene.robot.particle_count, axis=1))
    solver = Solver(scene, scenes.fidelity(), worlds=2)
    both = solver.run(np.zeros((FRAMES, 2, solver.muscle_count)), pair, equilibration=REST)
    assert (both.stops[:, 0] != both.stops[:, 1]).any()
    for world, stiffness in enumerate((0.1, 1.0)):
        alone = Solver(scene, scenes.fidelity())
        rollout = alone.run(np.zeros((FRAMES, 1, solver.muscle_count)), _body(stiffness), equilibration=REST)
        np.testing.assert_array_equal(both.positions[:, world], rollout.positions[:, 0])


@pytest.mark.parametrize("interval", [None, 5])
def test_the_gradient_is_the_derivative_through_the_equilibration(interval: int | None) -> None:
    """By the stiffness, with the steps and stops of the base point: a softer body begins lower."""
    solver = Solver(scenes.ground_scene(), scenes.fidelity(), gradients=True, checkpoint_interval=interval)
    base = _run(solver, 0.6)
    assert base.stops[:REST].sum() > 1
    heights = np.zeros(base.episode.positions.shape)
    heights[..., 1] = 1.0
    gradient = solver.backward(base, heights, np.zeros_like(heights)).stiffness.sum()
    ends = [_run(solver, 0.6 + step, base) for step in (1e-5, -1e-5)]
    assert all((end.stops == base.stops).all() for end in ends)
    above, below = (float((end.episode.positions * heights).sum()) for end in ends)
    assert gradient == pytest.approx((above - below) / 2e-5, rel=1e-5)
