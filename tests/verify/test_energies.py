"""Energy and momentum against closed forms."""

import numpy as np
import pytest

from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.sim.solver import Solver
from zoobench_verify.energies import energy_balance
from zoobench_verify.stability import stability_scenes as scenes


def _block() -> scenes.ElasticBody:
    return scenes.passive(scenes.lattice((0.25, 0.125, 0.25), (2, 2, 2)), velocity=np.array([1.0, 2.0, 0.0]))


def test_energy_balance_of_a_thrown_block() -> None:
    """Kinetic energy m v^2 / 2, potential m g y, momentum m v, no strain."""
    solver = Solver(scenes.drop(_block()), scenes.fidelity(64))
    solver.reset()
    balance = energy_balance(solver)
    mass = 1000.0 * (2 * scenes.SPACING) ** 3
    assert balance.kinetic == pytest.approx(0.5 * mass * 5.0)
    assert balance.potential == pytest.approx(mass * 9.81 * (0.125 + scenes.SPACING))
    assert balance.elastic == pytest.approx(0.0, abs=1e-12)
    assert balance.momentum == pytest.approx(mass * np.array([1.0, 2.0, 0.0]))
    assert balance.smallest_j == 1.0
    assert balance.speed == pytest.approx(5.0**0.5)


def test_elastic_energy_is_that_of_neo_hookean_matter() -> None:
    """mu/2 (tr F^T F - 3) - mu log J + lambda/2 log^2 J, times the volume; linear in log J below its clamp."""
    solver = Solver(scenes.flight(_block()), scenes.fidelity(64))
    solver.reset()
    mu, lam = lame_parameters(scenes.RUBBER.youngs_modulus, scenes.RUBBER.poissons_ratio)
    volume = (2 * scenes.SPACING) ** 3
    for stretch in (1.2, 0.9):
        solver.matter.load_slot(0, scenes.strained(solver, stretch * np.eye(3)))
        log_j = 3 * np.log(stretch)
        exact = 1.5 * mu * (stretch**2 - 1) - mu * log_j + 0.5 * lam * log_j**2
        assert energy_balance(solver).elastic == pytest.approx(volume * exact)
    energies = []
    for log_j in (np.log(0.05) - 0.1, np.log(0.05) - 0.2):
        solver.matter.load_slot(0, scenes.strained(solver, np.exp(log_j / 3) * np.eye(3)))
        energies.append(energy_balance(solver).elastic / volume - 1.5 * mu * np.exp(2 * log_j / 3) + mu * log_j)
    assert energies[1] - energies[0] == pytest.approx(-0.1 * lam * np.log(0.05))


def test_energy_in_free_fall_is_that_of_one_moment() -> None:
    """Constant to round-off where velocities are brought to the moment of the places, else off by m g^2 t dt / 2."""
    solver = Solver(scenes.drop(_block()), scenes.fidelity(64))
    solver.reset()
    dt, count = 1e-3, 20
    plain, first = (energy_balance(solver, step=step).total for step in (0.0, dt))
    solver.substeps(count, dt)
    mass = 1000.0 * (2 * scenes.SPACING) ** 3
    assert energy_balance(solver, step=dt).total == pytest.approx(first, rel=1e-12)
    assert energy_balance(solver).total == pytest.approx(plain - 0.5 * mass * 9.81**2 * count * dt * dt, rel=1e-12)
