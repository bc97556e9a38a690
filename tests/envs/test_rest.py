"""Equilibrated scenes stay at rest: a second without actuation moves nothing."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

ENVS = ("ground", "ice", "desert", "clay", "wetland", "snow", "shallow-water", "ocean")
SOLID = ("desert", "clay", "snow")
FRAMES = 125  # one second


@dataclass(frozen=True)
class Rest:
    """A second of rest.

    Attributes:
        kinetic: the largest energy at the end of any frame, by the initial potential energy [-].
        before, after: height of the bed's surface in every column of cells, at its start and end [m].
        thickness: of the bed [m].
    """

    kinetic: float
    before: Array
    after: Array
    thickness: float


def rest(name: str, fidelity: Fidelity) -> Rest:
    """Simulate the equilibrated environment without actuation."""
    env: Environment = registry.create(Kind.ENV, Ref(name))
    scene = env.scene(Caterpillar().body(fidelity), fidelity)
    solver = Solver(scene, fidelity, start=equilibrated(scene, fidelity, env.equilibration_frames))
    solver.reset()
    places = []
    mass = solver.parameters.mass[0].double().numpy()

    def place() -> Array:
        found: Array = solver.matter.x[0, 0].double().numpy() + solver.origin
        return found

    places.append(place())
    kinetic: list[float] = []

    def measure(_: int) -> None:
        kinetic.append(float(0.5 * (mass[:, None] * solver.matter.v[0, 0].double().numpy() ** 2).sum()))

    rollout = solver.run(np.zeros((FRAMES, 1, solver.muscle_count)), progress=measure)
    assert not rollout.divergences
    places.append(place())
    potential = (mass * 9.81 * places[0][:, 1]).sum()
    columns = (places[0][:, [0, 2]] / fidelity.grid_spacing).astype(int)
    before, after = (_surface(columns[solver.robot_count :], p[solver.robot_count :, 1]) for p in places)
    thickness = env.bed.thickness if env.bed is not None else 0.0
    return Rest(max(kinetic) / potential, before, after, thickness)


def _surface(columns: NDArray[np.int_], heights: Array) -> Array:
    """The highest of the particles that stood in each column at the start."""
    _, column = np.unique(columns, axis=0, return_inverse=True)
    surface = np.zeros(column.max(initial=-1) + 1)
    np.maximum.at(surface, column.ravel(), heights)
    return surface


def _check(name: str, fidelity: Fidelity) -> None:
    found = rest(name, fidelity)
    assert found.kinetic < 1e-6
    if name in SOLID:
        assert np.abs(found.after - found.before).max() < 1e-3 * found.thickness
    if found.thickness:
        assert found.after.mean() == pytest.approx(found.before.mean(), rel=0.01)


@pytest.mark.parametrize("name", ENVS)
def test_an_equilibrated_scene_stays_at_rest(name: str) -> None:
    """Kinetic energy below 1e-6 of the potential energy; solids keep their shape, fluids their level."""
    _check(name, Fidelity(1 / 32))


@pytest.mark.slow
@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize("name", ENVS)
def test_an_equilibrated_scene_stays_at_rest_on_the_default_grid(name: str, precision: int) -> None:
    """The same at the resolution of results."""
    _check(name, Fidelity(1 / 64, precision=64 if precision == 64 else 32))
