"""The gradient of the muscles' work: exact by states, activity and body, and nothing where it is not asked for."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.sim import adjoint
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.solver import BodyState, Solver

FRAMES = 6
GRID = scenes.fidelity()
LAGRANGIAN = replace(GRID, robot="lagrangian")


class WorkLoss:
    """A random functional of the muscles' work on the ground, of viscous matter, as a function of all parameters."""

    def __init__(self, given: Fidelity, equilibration: int) -> None:
        scene = scenes.damped_scene()
        self.solver = Solver(scene, given, gradients=True, stiffness_max=1.0, density_ratio_min=0.5)
        self._rest = equilibration
        shape = FRAMES, 1, scenes.MUSCLES
        self.weights = np.random.default_rng(4).normal(size=shape)
        self.base: dict[str, Array] = dict(BodyState().filled(scene, 1))
        self.base["actuation"] = scenes.actuation(self.solver, FRAMES)
        self.rollout = self.run(self.base)

    def run(self, values: dict[str, Array], replay: Rollout | None = None) -> Rollout:
        body = BodyState(**{name: values[name] for name in scenes.BODY_GROUPS})
        return self.solver.run(values["actuation"], body, replay=replay, equilibration=self._rest)

    def at(self, name: str, change: Array) -> float:
        moved = self.run(self.base | {name: self.base[name] + change}, self.rollout)
        assert (moved.stops == self.rollout.stops).all()
        return float((moved.episode.muscle_work * self.weights).sum())

    def gradient(self, weights: Array | None = None) -> Gradient:
        nothing = np.zeros(self.rollout.episode.positions.shape)
        return self.solver.backward(
            self.rollout, nothing, nothing, work_adjoint=self.weights if weights is None else weights
        )


@pytest.mark.parametrize(
    ("given", "equilibration"),
    [
        (GRID, 0),
        (GRID, 4),
        # the conformance suite has it, in the score of a fish in the sea
        *(pytest.param(LAGRANGIAN, frames, marks=pytest.mark.slow) for frames in (0, 4)),
    ],
    ids=["grid", "grid-at-rest-first", "rest-frame", "rest-frame-at-rest-first"],
)
def test_the_gradient_of_the_work_agrees_with_differences(given: Fidelity, equilibration: int) -> None:
    """By activity and by every array of the body, through the equilibration, too, along a random direction."""
    loss, rng = WorkLoss(given, equilibration), np.random.default_rng(5)
    gradient = loss.gradient()
    for name in scenes.GROUPS:
        exact = getattr(gradient, name)
        direction = rng.normal(size=exact.shape)
        along, step = float((exact * direction).sum()), 2e-6
        found = (loss.at(name, step * direction) - loss.at(name, -step * direction)) / (2 * step)
        assert found == pytest.approx(along, rel=1e-6, abs=1e-8 * np.abs(exact * direction).sum()), name


@pytest.mark.slow
def test_work_in_one_frame_does_not_depend_on_what_follows() -> None:
    """That of the third frame has no derivative by activity after it, and one by the activity in it and before."""
    loss = WorkLoss(GRID, 0)
    third = np.zeros_like(loss.weights)
    third[2] = 1.0
    has = loss.gradient(third).actuation.any(axis=(1, 2))
    assert has.tolist() == [True, True, True, False, False, False]


def test_nothing_is_computed_for_a_loss_without_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """The gradient of a trajectory is the same bits with and without an adjoint of the work that is all zero."""
    monkeypatch.setattr(adjoint, "WorkAdjoint", None)
    solver, rollout, expected = scenes.episode(scenes.damped_scene(), 3, GRID, density_ratio_min=0.5)
    weights = scenes.path_weights(solver, 3)
    assert scenes.same(solver.backward(rollout, *weights, work_adjoint=np.zeros((3, 1, scenes.MUSCLES))), expected)
