"""Launches and memory of a scene are those of its effects alone."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver


def _launches(scene: Scene, gradients: bool = False) -> dict[str, int]:
    """The launches of two frames: substeps in frames, kernels and surveys in numbers."""
    solver = Solver(scene, scenes.steady(scene), gradients=gradients)
    rollout = solver.run(scenes.actuation(solver, 2))
    if gradients:
        solver.backward(rollout, *scenes.path_weights(solver, 2))
    record = solver.launcher.launches
    per_frame = {name: solver.substeps_per_frame for name in record if name.split()[-1] not in ("launches", "survey")}
    return {name: count // per_frame.get(name, 1) for name, count in record.items()}


BLOCK = Scene(scenes.passive_block((0.3, 0.3, 0.3), (2, 2, 2), np.zeros(3)), (0, 0, 0), scenes.ARENA)


@pytest.mark.parametrize("scene", [BLOCK, *(make() for make in scenes.SCENES.values())], ids=["block", *scenes.SCENES])
def test_launches_are_the_effects_of_the_scene(scene: Scene) -> None:
    """Frames' worth of substeps by effect: no muscle in passive matter, no friction in flight, no sand on ground."""
    counts = {f"forward {effect}": 2 for effect in scenes.launched(scene)}
    assert _launches(scene) == counts | {"survey": 3, "forward launches": 2}


def test_reverse_launches_only_the_effects_too() -> None:
    """The backward pass reverses each frame once."""
    found = _launches(scenes.ground_scene(), gradients=True)
    effects = ("elasticity", "muscle", "friction")
    counts = {f"{way} {e}": 2 for e in effects for way in ("forward", "reverse")}
    assert found == counts | {"survey": 3, "forward launches": 2, "reverse launches": 2}


def test_forward_run_holds_nothing_of_a_gradient() -> None:
    """No state is kept, no adjoint grid is allocated until a backward pass needs it, and there is no sand."""
    solver = Solver(scenes.ground_scene(), scenes.fidelity())
    rollout = solver.run(scenes.actuation(solver, 2))
    assert not rollout.segments
    assert solver._tape is None
    assert solver.matter.b.numel() == solver.matter.history.numel() == solver.matter.tau.numel() == 0
    assert solver.launcher._grid_adjoint is None
    assert not any("adjoint" in name for name in (*vars(solver), *vars(solver.simulation)))


def test_water_holds_no_strain_and_no_stress() -> None:
    """Not in the state, not in a checkpoint and not on the tape."""
    solver = Solver(scenes.medium_scene("water"), scenes.fidelity(), gradients=True)
    rollout = solver.run(scenes.actuation(solver, 1))
    assert solver._tape is not None
    for matter in (solver.matter, rollout.segments[0].start, solver._tape.states):
        assert matter.b.numel() == matter.tau.numel() == 0
        assert matter.history.numel() == matter.history.shape[0] * 784


def test_serial_driver_holds_one_grid_for_all_worlds() -> None:
    """The worlds are taken in turn through one slab; the parallel driver needs one each."""
    scene = scenes.ground_scene()
    assert Solver(scene, scenes.fidelity(), worlds=3).launcher._grid.shape == (3, 31**3, 4)
    assert Solver(scene, scenes.fidelity(), worlds=3, parallel=True).launcher._grid.shape == (3, 3 * 31**3, 4)


def test_grid_beyond_memory_is_refused() -> None:
    """With the advice to go coarser."""
    scene = replace(scenes.flight_scene(), upper=(8.0, 8.0, 8.0))
    with pytest.raises(SceneError, match="Use a coarser fidelity"):
        Solver(scene, Fidelity(1 / 128, precision=64))
