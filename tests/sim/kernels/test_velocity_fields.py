"""Robot and medium in two velocity fields: what acts between them, and what does not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Transfer
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.solver import Solver
from zoobench_verify.energies import energy_balance

SPEED = np.array([0.3, -0.5, 0.1])
ALONG = (0, 2)


def _thrown(gap: float, friction: float | None, speed: Array = SPEED) -> Scene:
    """A soft block thrown at free sand, `gap` [cells] away, without gravity.

    There are a muscle at rest and a ground out of reach, as where kernels are compiled for other scenes, too.
    """
    bed = scenes.medium_bed("sand", depth=4, first=6, cells=12)
    bed = replace(bed, positions=bed.positions + np.array([0.0, 0.25, 0.0]), friction=friction)
    block = scenes.passive_block((0.3, 0.25 + (4 + gap) * scenes.SPACING, 0.3), (3, 3, 3), speed)
    return Scene(
        scenes.with_idle_muscle(block), (0, 0, 0), scenes.ARENA,
        ground=Ground(0.5), medium=bed, gravity=scenes.NO_GRAVITY,
    )  # fmt: skip


@pytest.mark.parametrize("transfer", ["apic", pytest.param("aflip", marks=pytest.mark.slow)])
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


def _slowed(scene: Scene) -> Array:
    """Change of the mean velocity of the block in five substeps [m/s]."""
    solver = Solver(scene, scenes.fidelity())
    before = solver.matter.v[0, 0, : solver.robot_count].numpy().mean(0)
    solver.substeps(5)
    mean: Array = solver.matter.v[0, 0, : solver.robot_count].numpy().mean(0) - before
    return mean


def test_a_gap_of_a_cell_is_no_contact() -> None:
    """Across it two fields feel nothing, while one field, whose splines reach over it, does."""
    assert np.abs(_slowed(_thrown(1.0, 0.4))).max() <= 1e-12
    assert np.abs(_slowed(_thrown(1.0, None))).max() >= 1e-3


def test_without_friction_the_impulse_is_along_the_normal() -> None:
    """A block that strikes a level bed keeps its velocity along it."""
    smooth = _slowed(_thrown(0.0, 0.0))
    assert smooth[1] > 0.05
    assert np.abs(smooth[[*ALONG]]).max() <= 0.02 * smooth[1]


@pytest.mark.parametrize("friction", [0.1, 0.4])
def test_what_slides_is_slowed_by_the_friction_times_the_normal_impulse(friction: float) -> None:
    """Coulomb's law, against the motion along the bed."""
    change = _slowed(_thrown(0.0, friction))
    along = change[[*ALONG]]
    assert np.linalg.norm(along) == pytest.approx(friction * change[1], rel=0.02)
    assert -along @ SPEED[[*ALONG]] == pytest.approx(np.linalg.norm(along) * np.hypot(0.3, 0.1), rel=1e-3)


def test_what_sticks_is_not_slowed_more_by_more_friction() -> None:
    """A block that hardly moves along the bed is stopped by less than friction could."""
    slow = np.array([0.02, -0.5, 0.01])
    less, more = (_slowed(_thrown(0.0, friction, slow)) for friction in (0.4, 10.0))
    assert np.linalg.norm(less[[*ALONG]]) < 0.1 * less[1]
    np.testing.assert_allclose(more, less, rtol=0.03)


def test_a_negative_friction_is_refused() -> None:
    """It would push a sliding robot on."""
    with pytest.raises(SceneError, match="negative"):
        _thrown(0.0, -0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["interface", "wading"])
def test_a_node_that_the_robot_hardly_touches_has_finite_adjoints(name: str) -> None:
    """Its mass there is 1e-24 kg, whose square is 0 in single precision, in which gradients are those of double."""
    scene = scenes.SCENES[name]()
    # the corner of the robot lies inside the bed, just within reach of the spline of a node
    corner = np.floor(scene.robot.positions.min(0) / scenes.SPACING + (2, 0, 2)) + 0.5 - 1e-3
    scenes.compare_precisions(scenes.with_corner_at(scene, corner))
