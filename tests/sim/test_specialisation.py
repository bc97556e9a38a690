"""What a scene does not call for is not held in memory, not worked on, and changes no bit."""

import gc
import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.sim import scenes
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.model.scene import Effect, Ground, Scene
from zoobench.sim.solver import Solver


def _run(solver: Solver, frames: int = 1, replay: Rollout | None = None) -> Rollout:
    return solver.run(scenes.actuation(solver, frames), replay=replay)


def _tensors() -> dict[int, int]:
    """Bytes of every tensor alive, by its place in memory: views count once."""
    gc.collect()
    held = (item.untyped_storage() for item in gc.get_objects() if issubclass(type(item), torch.Tensor))
    return {storage.data_ptr(): storage.nbytes() for storage in held}


@pytest.mark.parametrize("gradients", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_forward_run_holds_no_adjoint(gradients: bool) -> None:
    """Nothing is held after an episode that was not there before it, unless gradients were asked for."""
    solver = Solver(scenes.ground_scene(), scenes.fidelity(), gradients=gradients)
    _run(solver)
    before = _tensors()
    rollout = _run(solver)
    after = _tensors()
    grown = sum(after.values()) - sum(before.values())
    # the tape is kept from the episode before
    assert grown == sum(segment.start.bytes_per_slot() for segment in rollout.segments)
    assert (grown > 0) == gradients
    assert not any(name.startswith("reverse") for name in solver.launcher.launches)


SENTINEL = 7.0


@pytest.mark.parametrize("parallel", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["ground", "sand"])
def test_no_grid_work_outside_the_window(name: str, parallel: bool) -> None:
    """Nodes that no particle touched keep a sentinel through an episode and its reverse, on both grids."""
    solver = Solver(scenes.SCENES[name](), scenes.fidelity(), gradients=True, checkpoint_interval=3, parallel=parallel)
    launcher, slab = solver.launcher, math.prod(solver.launcher.shape)
    _run(solver, 3)  # makes the tape, and room in the grid for the momenta that are kept
    launcher._grid_adjoint = torch.empty_like(launcher._grid)
    grids = (launcher._grid, launcher._grid_adjoint)
    for grid in grids:
        grid.fill_(SENTINEL)
    rollout = _run(solver, 3)
    used = [grids[0].clone()]
    adjoint = solver.adjoint(rollout)
    adjoint.run(*scenes.path_weights(solver, 3))
    windows = adjoint._tape.states.window[: rollout.substeps + 1, 0]
    most = int((windows[:, 3:6] - windows[:, :3]).prod(dim=1).max())
    assert 0 < most < 0.5 * slab
    for grid in (*used, *grids):
        touched = (grid[:, :slab] != SENTINEL).any(dim=-1).any(dim=0)
        assert touched.any()
        assert not touched[most:].any()  # the nodes of a window follow each other from the grid's beginning on


PASSIVE = ("stiffness", "density_ratio", "occupancy")
GROUND, FLIGHT = scenes.ground_scene(), scenes.flight_scene()
LIMP = replace(FLIGHT, robot=replace(FLIGHT.robot, material=replace(scenes.SOFT, muscle_strength=0.0)))


def _beside(name: str, height: float) -> tuple[Scene, Scene]:
    """A robot out of reach of a bed, with it and without."""
    body = scenes.muscle_body((0.1, height, 0.1), moving=True)
    # on the arena's floor, as ground has a skin only where there is no medium
    alone = Scene(body, (0.0, 0.0, 0.0), scenes.ARENA)
    return replace(alone, medium=scenes.medium_bed(name, first=16, cells=2)), alone


MEDIUM = {Effect.PLASTICITY, Effect.FLUID}
slow = pytest.mark.slow


@pytest.mark.parametrize(
    ("on", "off", "idle", "effects"),
    [
        # compiled in and not activated
        pytest.param(FLIGHT, LIMP, True, {Effect.MUSCLE}, id="muscle", marks=slow),
        # compiled in with the smallest positive coefficient
        pytest.param(
            scenes.ground_scene(friction=5e-324),
            replace(GROUND, ground=Ground(0.0)),
            False,
            {Effect.FRICTION},
            id="friction",
        ),
        # where there is water the ground is tight, which a robot that stands on it feels
        pytest.param(*_beside("sand", 0.0), False, MEDIUM, id="sand", marks=slow),
        pytest.param(*_beside("mud", 0.0), False, MEDIUM, id="mud", marks=slow),
        pytest.param(*_beside("water", 0.1), False, MEDIUM, id="water", marks=slow),
    ],
)
def test_an_effect_that_does_nothing_is_no_effect(on: Scene, off: Scene, idle: bool, effects: set[Effect]) -> None:
    """Compiled in, it gives bit for bit the trajectory and gradient of compiled out, in the same steps."""
    assert set() < on.effects - off.effects <= effects
    rollouts: list[Rollout] = []
    gradients: list[Gradient] = []
    for scene in (on, off):
        solver = Solver(scene, scenes.fidelity(), gradients=True)
        actuation = np.where(idle, 0.0, scenes.actuation(solver, 2))
        rollouts.append(solver.run(actuation, replay=rollouts[0] if rollouts else None))
        gradients.append(solver.backward(rollouts[-1], *scenes.path_weights(solver, 2)))
    assert np.array_equal(rollouts[0].positions, rollouts[1].positions)
    assert scenes.same(*gradients, PASSIVE if idle else (*PASSIVE, "actuation", "fibres"))
