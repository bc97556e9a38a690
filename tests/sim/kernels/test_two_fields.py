"""Robot and medium in two velocity fields: what acts between them, and what does not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Transfer
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench.verify.energies import energy_balance

SPEED = np.array([0.3, -0.5, 0.1])


def _thrown(gap: float, friction: float | None, medium: str = "sand") -> Scene:
    """A soft block thrown at a free piece of a medium, `gap` [cells] away, without gravity and ground."""
    bed = scenes.medium_bed(medium, depth=4, first=6, cells=12)
    bed = replace(bed, positions=bed.positions + np.array([0.0, 0.25, 0.0]), friction=friction)
    block = scenes.passive_block((0.3, 0.25 + (4 + gap) * scenes.SPACING, 0.3), (3, 3, 3), SPEED)
    return Scene(replace(block, material=scenes.SOFT), (0, 0, 0), scenes.ARENA, medium=bed, gravity=scenes.NO_GRAVITY)


@pytest.mark.parametrize("transfer", ["apic", "aflip"])
def test_the_impulse_between_them_is_equal_and_opposite_and_adds_no_energy(transfer: Transfer) -> None:
    """An elastic block thrown at sand slows down; momentum stays to rounding, and energy falls in every substep."""
    solver = Solver(_thrown(0.0, 0.4), scenes.fidelity(transfer=transfer))
    balances = [energy_balance(solver)]
    for _ in range(60):
        solver.substeps(1)
        balances.append(energy_balance(solver))
    momenta = np.array([balance.momentum for balance in balances])
    energies = np.array([balance.total for balance in balances])
    assert np.abs(momenta - momenta[0]).max() <= 1e-13 * np.abs(momenta[0]).max()
    assert np.diff(energies).max() < 0.0
    assert energies[-1] < 0.6 * energies[0]


def _slowed(scene: Scene, substeps: int = 5) -> Array:
    """Change of the mean velocity of the block [m/s]."""
    solver = Solver(scene, scenes.fidelity())
    solver.substeps(substeps)
    mean: Array = solver.matter.v[0, 0, : solver.robot_count].numpy().mean(0) - SPEED
    return mean


def test_a_gap_of_a_cell_is_no_contact() -> None:
    """Across it two fields feel nothing, while one field, whose splines reach over it, does."""
    assert np.abs(_slowed(_thrown(1.0, 0.4))).max() <= 1e-12
    assert np.abs(_slowed(_thrown(1.0, None))).max() >= 1e-3


def test_without_friction_the_impulse_is_along_the_normal() -> None:
    """A block that strikes a level bed keeps its velocity along it, and loses some with friction."""
    smooth, rough = _slowed(_thrown(0.0, 0.0)), _slowed(_thrown(0.0, 0.4))
    assert smooth[1] > 0.05
    assert np.abs(smooth[[0, 2]]).max() <= 0.02 * smooth[1]
    assert -rough[0] >= 0.2 * rough[1]


def test_a_negative_friction_is_refused() -> None:
    """It would push a sliding robot on."""
    with pytest.raises(SceneError, match="negative"):
        _thrown(0.0, -0.1)
