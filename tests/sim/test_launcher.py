"""Launches and memory of a scene are those of its effects alone."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.test_adjoint import DEAR
from zoobench.errors import SceneError
from zoobench.sim import parallel_driver
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench.sim.step_control import Diagnostics


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


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(BLOCK, id="block"),
        *(
            pytest.param(make(), id=name, marks=pytest.mark.slow if name in (*DEAR, "mire") else ())
            for name, make in scenes.SCENES.items()
        ),
    ],
)
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


def test_matter_that_needs_more_nodes_than_there_is_memory_for_diverges(monkeypatch: pytest.MonkeyPatch) -> None:
    """The parallel driver holds a part of the arena for each world, the serial one all of it."""
    scene, actuation = scenes.ground_scene(), np.zeros((1, 2, 3))
    monkeypatch.setattr(parallel_driver, "memory_share", lambda _: 2 * 3 * 4 * 8 * 1000)
    assert not Solver(scene, scenes.fidelity(), worlds=2, parallel=True).run(actuation).divergences
    monkeypatch.setattr(parallel_driver, "memory_share", lambda _: 2 * 3 * 4 * 8 * 100)
    with pytest.raises(SceneError, match="2 worlds have memory for 100 each"):
        Solver(scene, scenes.fidelity(), worlds=2, parallel=True)
    monkeypatch.setattr(parallel_driver.ParallelDriver, "check_room", lambda *_: None)
    found = Solver(scene, scenes.fidelity(), worlds=2, parallel=True).run(actuation).divergences
    assert [(each.quantity, np.isnan(each.value)) for each in found.values()] == [("finite state", True)] * 2


@pytest.mark.parametrize(
    "name", ["ground", *(pytest.param(name, marks=pytest.mark.slow) for name in ("snow", "water"))]
)
def test_surveys_of_both_drivers_are_the_same(name: str) -> None:
    """One goes through the particles in turn, the other reduces what was found of each; a NaN is kept by both."""
    found = []
    for parallel in (False, True):
        solver = Solver(scenes.SCENES[name](), scenes.fidelity(), worlds=4, parallel=parallel)
        solver.reset()
        solver.parameters.tension[:] = 100.0
        solver.parameters.mass[1, 3] = 0.0
        solver.simulation.alive[2] = 0
        solver.matter.F[0, 0, 5] *= 0.2
        solver.matter.v[0, 0, 7, 1] = 3.0
        solver.matter.x[0, 3, 9, 2] = np.nan
        solver.matter.v[0, 3, 4, 0] = np.nan
        diagnostics = Diagnostics(solver.simulation)
        conditions = np.array(diagnostics.survey())
        found.append((conditions, diagnostics._culprit.numpy().copy()))
    (serial, culprit), (parallel, other) = found
    assert np.isnan(serial[3, 0])
    assert np.isnan(serial[3, 2])
    assert serial[0, 4] == 1.0
    np.testing.assert_allclose(parallel, serial, rtol=1e-14)
    assert np.array_equal(other, culprit)


def test_grid_beyond_memory_is_refused() -> None:
    """With the advice to go coarser."""
    scene = replace(scenes.flight_scene(), upper=(8.0, 8.0, 8.0))
    with pytest.raises(SceneError, match="Use a coarser fidelity"):
        Solver(scene, Fidelity(1 / 128, precision=64))
