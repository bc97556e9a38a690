"""Only the kernel functions that a scene calls for are compiled, and what is launched for it is recorded."""

import numpy as np
import pytest
from taichi.lang.kernel_impl import Func

from tests.sim import scenes
from zoobench import registry
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

SMOKE = Fidelity(1 / 32)
"""That of small cells: what was compiled for their tests is found again, once the functions in it are known."""

# Kernel functions of every effect: compiled into the substep and its reverse where a scene calls for it, else not.
CODE = {
    "muscle": {"fibre_stress", "fibre_stress_adjoint"},
    "damping": {"viscous"},
    "friction": {"coulomb", "coulomb_adjoint"},
    "contact": {"update_fields", "update_fields_adjoint"},
    "decomposition": {"eigen_symmetric"},
    "plasticity": {"hencky_update", "hencky_update_adjoint", "snow_update", "snow_update_adjoint"},
    "fluid": {"water_pressure", "shear_rate", "advect", "advect_adjoint"},
}


@pytest.fixture
def compiled(nothing_compiled: None, monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Names of the kernel functions that are compiled from now on."""
    names: set[str] = set()
    call = Func.__call__

    def noting(self: Func, *args: object, **kwargs: object) -> object:
        names.add(self.func.__name__)
        return call(self, *args, **kwargs)

    monkeypatch.setattr(Func, "__call__", noting)
    return names


@pytest.mark.slow  # test_specialisation.py shows what is compiled for an effect
@pytest.mark.parametrize(
    "name",
    # others compile kernels that hardly another test needs, for seconds, and ice those of the ground; what effects each
    # has is in tests/verify/effects
    [pytest.param(name, marks=() if name == "ground" else pytest.mark.slow) for name in registry.names(Kind.ENV)],
)
def test_an_environment_compiles_and_launches_what_it_calls_for(name: str, compiled: set[str]) -> None:
    """A frame and its reverse are recorded with its effects, whose functions alone are compiled."""
    # a robot in its rest frame, as in the ocean's own water, has kernels of its own
    env: Environment = registry.create(Kind.ENV, Ref.parse("ocean[water=grid]" if name == "ocean" else name))
    scene = env.scene(Caterpillar().body(SMOKE), SMOKE)
    solver, rollout, _ = scenes.episode(scene, 1, SMOKE)
    launched = scenes.launched(scene)
    record = dict(solver.launcher.launches)
    assert record.pop("survey") > 0
    assert (record.pop("forward launches"), record.pop("reverse launches")) == (1, 1)
    once = rollout.substeps
    assert record == {f"{way} {e}": once for e in launched for way in ("forward", "reverse")}
    assert {"scatter", "gather", "neo_hookean", "scatter_adjoint"} <= compiled
    for effect, functions in CODE.items():
        assert bool(functions & compiled) == (effect in launched), effect


def test_passive_matter_in_flight_compiles_elasticity_alone(compiled: set[str]) -> None:
    """No muscle, no contact law, no medium."""
    block = Scene(scenes.passive_block((0.3, 0.3, 0.3), (2, 2, 2), np.zeros(3)), (0, 0, 0), scenes.ARENA)
    solver = Solver(block, scenes.fidelity())
    solver.run(scenes.actuation(solver, 1))
    assert "neo_hookean" in compiled
    assert not compiled & set().union(*CODE.values())
