"""Only the effects that a scene calls for are compiled, launched and held in memory, by the records of real runs."""

import gc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch
from taichi.lang.kernel_impl import Func

from tests.sim import scenes
from zoobench import registry
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim import runtime
from zoobench.sim.adjoint import Adjoint
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.rollout import Gradient, Rollout
from zoobench.sim.model.scene import Effect, Ground, Scene
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

COARSE = Fidelity(1 / 32, precision=64)

COMMON = {"elasticity", "muscle", "damping"}

# What a frame of every environment may be recorded to have launched.
LAUNCHED = {
    "ground": COMMON | {"friction"},
    "ice": COMMON | {"friction"},
    "desert": COMMON | {"friction", "plasticity", "decomposition"},
    "wetland": COMMON | {"friction", "plasticity", "decomposition", "fluid"},
    "clay": COMMON | {"friction", "plasticity", "decomposition"},
    "snow": COMMON | {"friction", "plasticity", "decomposition"},
    "shallow-water": COMMON | {"friction", "fluid"},
    "ocean": COMMON | {"fluid"},
}

# Kernel functions of every effect: compiled into the substep and its reverse where a scene calls for it, else not.
CODE = {
    "muscle": {"fibre_stress", "fibre_stress_adjoint"},
    "damping": {"viscous"},
    "friction": {"coulomb", "coulomb_adjoint"},
    "decomposition": {"eigen_symmetric"},
    "plasticity": {"hencky_update", "hencky_update_adjoint", "snow_update", "snow_update_adjoint"},
    "fluid": {"water_pressure", "shear_rate"},
}


def _scene(name: str) -> Scene:
    env: Environment = registry.create(Kind.ENV, Ref(name))
    return env.scene(Caterpillar().body(COARSE), COARSE)


def _run(solver: Solver, frames: int = 1, schedule: np.ndarray | None = None) -> Rollout:
    return solver.run(scenes.actuation(solver, frames), schedule=schedule)


def _differentiate(solver: Solver, rollout: Rollout) -> Gradient:
    return solver.backward(rollout, *scenes.path_weights(solver, rollout.frames))


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Names of the kernel functions that are compiled from now on; whatever was compiled before is forgotten."""
    names: set[str] = set()
    call = Func.__call__

    def noting(self: Func, *args: object, **kwargs: object) -> object:
        names.add(self.func.__name__)
        return call(self, *args, **kwargs)

    runtime.stop()
    monkeypatch.setattr(Func, "__call__", noting)
    return names


@pytest.mark.parametrize(
    ("name", "launched"),
    # each compiles kernels that no other test needs, for minutes: of beds and waters one is fast
    [
        pytest.param(*item, marks=() if item[0] in ("ground", "ice", "desert", "ocean") else pytest.mark.slow)
        for item in LAUNCHED.items()
    ],
)
def test_an_environment_compiles_and_launches_what_it_calls_for(
    name: str, launched: set[str], compiled: set[str]
) -> None:
    """A frame, its recomputation and its reverse are recorded with its effects, whose functions alone are compiled."""
    solver = Solver(_scene(name), COARSE, gradients=True)
    rollout = _run(solver)
    _differentiate(solver, rollout)
    record = dict(solver.launcher.launches)
    assert record.pop("survey") > 0
    assert (record.pop("forward launches"), record.pop("reverse launches")) == (2, 1)
    once = rollout.substeps
    assert record == {f"forward {e}": 2 * once for e in launched} | {f"reverse {e}": once for e in launched}
    assert {"scatter", "gather", "neo_hookean", "scatter_adjoint"} <= compiled
    for effect, functions in CODE.items():
        assert bool(functions & compiled) == (effect in launched), effect


def test_passive_matter_in_flight_compiles_elasticity_alone(compiled: set[str]) -> None:
    """No muscle, no contact law, no medium."""
    block = Scene(scenes.passive_block((0.3, 0.3, 0.3), (2, 2, 2), np.zeros(3)), (0, 0, 0), scenes.ARENA)
    _run(Solver(block, scenes.fidelity()))
    assert "neo_hookean" in compiled
    assert not compiled & set().union(*CODE.values())


def _tensors() -> dict[int, int]:
    """Bytes of every tensor alive, by its place in memory: views count once."""
    gc.collect()
    held = (item.untyped_storage() for item in gc.get_objects() if issubclass(type(item), torch.Tensor))
    return {storage.data_ptr(): storage.nbytes() for storage in held}


@pytest.mark.parametrize("gradients", [False, True])
def test_a_forward_run_holds_no_adjoint(gradients: bool) -> None:
    """Nothing is held after an episode that was not there before it, unless gradients were asked for."""
    solver = Solver(scenes.ground_scene(), scenes.fidelity(), gradients=gradients)
    _run(solver)
    before = _tensors()
    rollout = _run(solver)
    after = _tensors()
    grown = sum(after.values()) - sum(before.values())
    checkpoints = sum(matter.bytes_per_slot() for matter in rollout.checkpoints)
    assert grown == checkpoints
    assert (checkpoints > 0) == gradients
    assert not any(name.startswith("reverse") for name in solver.launcher.launches)


SENTINEL = 7.0


@pytest.mark.parametrize("parallel", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["ground", "sand"])
def test_no_grid_work_outside_the_window(name: str, parallel: bool) -> None:
    """Nodes that no particle touched keep a sentinel through an episode and its reverse, on all three grids."""
    solver = Solver(scenes.SCENES[name](), scenes.fidelity(), gradients=True, checkpoint_interval=3, parallel=parallel)
    launcher = solver.launcher
    launcher._reverse_grids = (*(torch.empty_like(launcher._grid) for _ in range(2)), *launcher._grids[1:])
    grids = (launcher._grid, *launcher._reverse_grids[:2])
    for grid in grids:
        grid.fill_(SENTINEL)
    rollout = _run(solver, 3)
    used = [grids[0].clone()]
    adjoint = Adjoint(solver.simulation, rollout)
    adjoint.run(*scenes.path_weights(solver, 3))
    visited = torch.zeros(launcher.shape, dtype=torch.bool)
    for window in adjoint._tape.window[: rollout.substeps + 1, 0].tolist():
        visited[window[0] : window[3], window[1] : window[4], window[2] : window[5]] = True
    assert 0.0 < visited.float().mean() < 0.5
    for grid in (*used, *grids):
        touched = (grid[0] != SENTINEL).any(dim=-1)
        assert touched.any()
        assert not (touched & ~visited).any()


def _same(first: Gradient, second: Gradient, names: tuple[str, ...]) -> bool:
    return all(np.array_equal(getattr(first, name), getattr(second, name)) for name in names)


PASSIVE = ("stiffness", "density_ratio", "occupancy")


def _on_and_off(
    on: Scene, off: Scene, actuation: Callable[[Solver], np.ndarray]
) -> tuple[list[Rollout], list[Gradient]]:
    """Two frames of both scenes in the steps of the first, with gradients."""
    rollouts: list[Rollout] = []
    gradients: list[Gradient] = []
    for scene in (on, off):
        solver = Solver(scene, scenes.fidelity(), gradients=True)
        schedule = rollouts[0].counts if rollouts else None
        rollouts.append(solver.run(actuation(solver), schedule=schedule))
        gradients.append(_differentiate(solver, rollouts[-1]))
    return rollouts, gradients


def test_muscle_at_rest_is_no_muscle() -> None:
    """Compiled in and not activated gives bit for bit the trajectory and gradient of compiled out."""
    on = scenes.ground_scene()
    off = replace(on, robot=replace(on.robot, material=replace(on.robot.material, muscle_strength=0.0)))
    assert on.effects - off.effects == {Effect.MUSCLE}
    rollouts, gradients = _on_and_off(on, off, lambda solver: np.zeros((2, 1, solver.muscle_count)))
    assert np.array_equal(rollouts[0].positions, rollouts[1].positions)
    assert _same(*gradients, PASSIVE)


def test_vanishing_friction_is_no_friction() -> None:
    """Compiled in with the smallest positive coefficient gives the trajectory and gradient of compiled out."""
    on = scenes.ground_scene(friction=5e-324)
    off = replace(on, ground=Ground(0.0))
    assert on.effects - off.effects == {Effect.FRICTION}
    rollouts, gradients = _on_and_off(on, off, lambda solver: scenes.actuation(solver, 2))
    assert np.array_equal(rollouts[0].positions, rollouts[1].positions)
    assert _same(*gradients, (*PASSIVE, "actuation", "fibres"))


@pytest.mark.parametrize(
    ("name", "height"),
    [
        ("sand", 0.0),
        pytest.param("mud", 0.0, marks=pytest.mark.slow),
        pytest.param("water", 0.1, marks=pytest.mark.slow),
    ],
)
def test_a_medium_out_of_reach_is_no_medium(name: str, height: float) -> None:
    """A bed that the robot does not touch, compiled in, changes no bit of its trajectory and gradient.

    Where there is water the ground is tight, which a robot that stands on it feels.
    """
    bed = scenes.medium_bed(name, first=16, cells=2)
    body = scenes.muscle_body((0.1, height, 0.1), moving=True)
    off = Scene(body, (0.0, 0.0, 0.0), scenes.ARENA, ground=Ground(0.5))
    rollouts, gradients = _on_and_off(replace(off, medium=bed), off, lambda solver: scenes.actuation(solver, 2))
    assert np.array_equal(rollouts[0].positions, rollouts[1].positions)
    assert _same(*gradients, (*PASSIVE, "actuation", "fibres"))
