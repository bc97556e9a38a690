"""Equilibrated scenes stay at rest: a second without actuation moves nothing."""

import numpy as np
import pytest
from scipy import ndimage

from tests.envs.at_rest import ENVS, made, solver_of
from zoobench.sim.model.fidelity import Fidelity

SOLID = ("desert", "clay", "snow")
MOST_ENERGY = {"shallow-water": 3e-5}
"""Largest kinetic energy of an environment at rest by its potential energy, where it is not 1e-6.

Water by AFLIP, with which bodies float at their draught, swirls by 2 to 3 mm/s, 5e-6 to 2e-5 over 1,000 frames without
growing; by APIC, which damps that, it has 1e-6.
"""
FRAMES = 125  # one second


def _check(name: str, fidelity: Fidelity) -> None:
    """Simulate the equilibrated environment without actuation."""
    solver = solver_of(name, fidelity)
    solver.reset()
    mass = solver.parameters.mass[0].double().numpy()
    kinetic: list[float] = []

    def measure(_: int) -> None:
        kinetic.append(float(0.5 * (mass[:, None] * solver.matter.v[0, 0].double().numpy() ** 2).sum()))

    start = solver.positions(0)
    rollout = solver.run(np.zeros((FRAMES, 1, solver.muscle_count)), progress=measure)
    end = solver.positions(0)
    assert not rollout.divergences
    assert max(kinetic) < MOST_ENERGY.get(name, 1e-6) * (mass * 9.81 * start[:, 1]).sum()
    bed = made(name).bed
    if bed is None:
        return
    # the highest of the particles that stood in each column of cells at the start
    columns = (start[solver.robot_count :, [0, 2]] / fidelity.grid_spacing).astype(int)
    column = np.unique(columns, axis=0, return_inverse=True)[1].ravel()
    before, after = (
        ndimage.maximum(place[solver.robot_count :, 1], column, np.arange(column.max() + 1)) for place in (start, end)
    )
    if name in SOLID:
        assert np.abs(after - before).max() < 1e-3 * bed.thickness
    assert after.mean() == pytest.approx(before.mean(), rel=0.01)


@pytest.mark.parametrize(
    "name",
    [
        # on beds bodies need the grid of scores, and water of particles is simulated in tests/sim
        pytest.param(name, marks=pytest.mark.slow if name in ("desert", "wetland", "shallow-water") else ())
        for name in ENVS
        if name not in SOLID[1:]
    ],
)
def test_an_equilibrated_scene_stays_at_rest(name: str) -> None:
    """Kinetic energy below `MOST_ENERGY` of the potential energy; solids keep their shape, fluids their level.

    A bed of a single cell carries nobody in peace.
    """
    _check(name, Fidelity(1 / 64 if name in (*SOLID, "wetland") else 1 / 32, precision=64))


@pytest.mark.slow
@pytest.mark.parametrize("precision", [32, 64])
@pytest.mark.parametrize("name", ENVS)
def test_an_equilibrated_scene_stays_at_rest_on_the_default_grid(name: str, precision: int) -> None:
    """The same at the resolution of results."""
    _check(name, Fidelity(1 / 64, precision=64 if precision == 64 else 32))
