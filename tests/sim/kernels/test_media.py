"""The laws of the media in kernels: against their NumPy twins, symmetries, rest and yield surfaces."""

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.kernels.lanes import relative, rounded, symmetric, tensors
from tests.sim.kernels.law_kernels import shear_rate_all, water_all
from tests.sim.kernels.media_laws import (
    MU,
    SOLIDS,
    constants,
    deviators,
    native,
    rest_history,
    states,
    states_of_size,
    strains,
    twin_update,
    update,
    update_adjoint,
)
from zoobench.sim.kernels.power_series import NEAR
from zoobench.sim.launcher import law_of
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.laws.snow import LARGEST_PLASTIC, SMALLEST_PLASTIC, SnowMaterial
from zoobench.sim.model.laws.water import WaterMaterial

PRECISIONS = pytest.mark.parametrize(
    ("precision", "tolerance"), [(64, 1e-12), pytest.param(32, 1e-6, marks=pytest.mark.slow)]
)
EVERY_SOLID = pytest.mark.parametrize("name", SOLIDS)
WATER = WaterMaterial(bulk_modulus=1e4, density=1000.0)


@PRECISIONS
@EVERY_SOLID
def test_update_agrees_with_its_twin(name: str, precision: int, tolerance: float) -> None:
    """Elastic b, history and stress of 500 random states."""
    material = SOLIDS[name]
    b, history = rounded(precision, *states(material, 500))
    found, expected = update(material, b, history, precision), twin_update(material, b, history)
    assert relative(found[0], expected[0], 1.0) <= tolerance
    assert np.abs(found[1] - expected[1]).max() <= tolerance
    # the stress of hardened snow is that of larger moduli
    moduli = MU * np.exp(10.0 * (1 - expected[1])) if isinstance(material, SnowMaterial) else MU
    assert relative(found[2], expected[2], moduli) <= tolerance


SIZES = (1e-6, 1e-4, 1e-3, 1e-2, 0.03, 0.06, 0.99 * NEAR, 1.01 * NEAR, 0.3)


@pytest.mark.parametrize(("precision", "tolerance"), [(64, 1e-14), pytest.param(32, 1e-6, marks=pytest.mark.slow)])
@EVERY_SOLID
def test_update_agrees_with_its_twin_at_every_size(name: str, precision: int, tolerance: float) -> None:
    """Elastic, yielding and loose, from next to no strain through the border of the series to beyond it."""
    material = SOLIDS[name]
    for size in SIZES:
        b, history = rounded(precision, *states_of_size(material, 300, size))
        found, expected = update(material, b, history, precision), twin_update(material, b, history)
        assert np.abs(found[0] - expected[0]).max() <= tolerance
        assert np.abs(found[1] - expected[1]).max() <= tolerance
        moduli = MU * np.exp(10.0 * (1 - expected[1])) if isinstance(material, SnowMaterial) else MU + 0 * expected[1]
        assert np.abs((found[2] - expected[2]) / moduli[:, None, None]).max() <= tolerance


@pytest.mark.parametrize("name", ["sand", "clay", "snow"])
def test_stress_of_small_strains_keeps_its_digits(name: str) -> None:
    """To 1e-6 of the strain itself in 32 bits, not of 1: a bed at rest is strained by some thousandths."""
    material = SOLIDS[name]
    for size in (1e-6, 1e-4, 1e-2):
        b, history = rounded(32, *states_of_size(material, 300, size))
        found, expected = update(material, b, history, 32)[2], twin_update(material, b, history)[2]
        moduli = MU * np.exp(10.0 * (1 - history)) if isinstance(material, SnowMaterial) else MU + 0 * history
        error = np.abs((found - expected) / moduli[:, None, None]).max()
        assert error <= 1e-6 * size
        assert np.abs(expected / moduli[:, None, None]).max() > 0.1 * size


@pytest.mark.slow  # the kernels of an episode have native vectors
@pytest.mark.parametrize("name", ["sand", "snow"])
def test_native_vectors_give_the_same(name: str) -> None:
    """A kernel whose small vectors are those of the processor finds what one of single numbers does."""
    material = SOLIDS[name]
    b, history = (
        np.concatenate(pair) for pair in zip(*(states_of_size(material, 50, s) for s in (0.02, 0.3)), strict=True)
    )
    rng = np.random.default_rng(12)
    adjoints = symmetric(rng.normal(size=b.shape)), rng.normal(size=len(b)), symmetric(rng.normal(size=b.shape)) / MU
    found = native(material, b, history, adjoints)
    expected = (*update(material, b, history), *update_adjoint(material, b, history, adjoints))
    for one, other in zip(found, expected, strict=True):
        assert np.abs(one - other).max() <= 1e-14 * np.abs(other).max()


@PRECISIONS
def test_water_agrees_with_its_twin(precision: int, tolerance: float) -> None:
    """Pressure from strong compression to cavity."""
    (J,) = rounded(precision, np.linspace(0.5, 1.5, 401))
    given = tensors(precision, J, 0 * J, 0 * J, constants(WATER))
    water_all(*given, law_of(WATER))
    expected = WATER.pressure(J)
    assert (np.abs(given[1].double().numpy() - expected) <= tolerance * np.maximum(expected, WATER.bulk_modulus)).all()


@EVERY_SOLID
def test_rest_is_free_of_stress(name: str) -> None:
    """At F = I a medium without past bears nothing and stays as it is, exactly."""
    material, rest = SOLIDS[name], np.eye(3)[None]
    b, history, stress = update(material, rest, rest_history(material, 1))
    assert np.array_equal(b, rest)
    assert not stress.any()
    assert np.array_equal(history, rest_history(material, 1))


def test_water_at_rest_bears_no_pressure() -> None:
    """None at J = 1 and none in a cavity."""
    given = tensors(64, np.array([1.0, 1.2, 0.99]), np.ones(3), np.ones(3), constants(WATER))
    water_all(*given, law_of(WATER))
    assert given[1][:2].tolist() == given[2][:2].tolist() == [0.0, 0.0]
    assert given[1][2] > 0


@EVERY_SOLID
def test_update_is_objective(name: str) -> None:
    """A rotated b gives the rotated result: with Q b Q^T all of it turns by Q, and history stays."""
    material = SOLIDS[name]
    b, history = states(material, 200)
    Q = np.linalg.qr(np.random.default_rng(5).normal(size=(200, 3, 3)))[0]
    Q *= np.linalg.det(Q)[:, None, None]
    back = np.swapaxes(Q, 1, 2)
    turned = update(material, symmetric(Q @ b @ back), history)
    for found, expected in zip(turned, update(material, b, history), strict=True):
        rotated = Q @ expected @ back if expected.ndim == 3 else expected
        assert np.abs(found - rotated).max() <= 1e-11 * max(1.0, np.abs(expected).max())


@EVERY_SOLID
def test_update_is_isotropic(name: str) -> None:
    """Elastic b and stress share the eigenvectors of the trial b: they commute with it, and axes may be exchanged."""
    material = SOLIDS[name]
    b, history = states(material, 200)
    elastic, after, stress = update(material, b, history)
    for found in (elastic, stress):
        assert np.abs(found @ b - b @ found).max() <= 1e-11 * max(1.0, np.abs(found).max())
    order = [2, 0, 1]
    swapped = update(material, b[:, order][:, :, order], history)
    assert np.abs(swapped[0] - elastic[:, order][:, :, order]).max() <= 1e-11
    assert np.abs(swapped[1] - after).max() <= 1e-11
    assert np.abs(swapped[2] - stress[:, order][:, :, order]).max() <= 1e-11 * np.abs(stress).max()


def _noise(precision: int) -> float:
    """Round-off of a deviator is that of the whole stress [Pa]."""
    return 10 * (1e-16 if precision == 64 else 1e-7) * MU


@pytest.mark.parametrize("precision", [64, 32])
def test_sand_never_leaves_its_yield_cone(precision: int) -> None:
    """|dev tau| <= -alpha tr tau after the return of 10,000 random states, to 1e-5 relative; no tension anywhere."""
    material = SOLIDS["sand"]
    assert isinstance(material, SandMaterial)
    slope = material.cone_slope
    _, left, tau = update(material, *states(material, 10_000), precision)
    pressure, size, noise = -np.trace(tau, axis1=1, axis2=2), deviators(tau), _noise(precision)
    assert (size <= slope * pressure * (1 + 1e-5) + noise).all()
    assert (pressure >= -noise).all()
    assert (left >= 0).all()
    sheared = size >= slope * pressure * (1 - 1e-4) - noise
    assert 1000 < int((sheared & (pressure > 100 * noise)).sum()) < 9900


@pytest.mark.parametrize("precision", [64, pytest.param(32, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["clay", "mud"])
def test_clay_and_mud_never_leave_their_yield_surface(name: str, precision: int) -> None:
    """|dev tau| <= y after the return of 10,000 random states, to 1e-5 relative; many of them reach it."""
    material = SOLIDS[name]
    bound = material.yield_stress
    _, _, tau = update(material, *states(material, 10_000), precision)
    size, noise = deviators(tau), _noise(precision)
    assert (size <= bound * (1 + 1e-5) + noise).all()
    assert 1000 < int((size >= bound * (1 - 1e-5) - noise).sum()) < 9900


@pytest.mark.parametrize("precision", [64, 32])
def test_snow_never_leaves_its_stretch_bounds(precision: int) -> None:
    """Elastic stretches and plastic volume ratio of 10,000 random states, to 1e-5 relative; each bound is met."""
    material = SOLIDS["snow"]
    assert isinstance(material, SnowMaterial)
    low, high = 1 - material.critical_compression, 1 + material.critical_stretch
    b, plastic, _ = update(material, *states(material, 10_000), precision)
    stretch = np.exp(strains(b))
    assert ((stretch >= low * (1 - 1e-5)) & (stretch <= high * (1 + 1e-5))).all()
    assert ((plastic >= SMALLEST_PLASTIC * (1 - 1e-5)) & (plastic <= LARGEST_PLASTIC * (1 + 1e-5))).all()
    for met in (stretch[:, 0] < low * (1 + 1e-5), stretch[:, 2] > high * (1 - 1e-5), plastic < 0.8 * (1 + 1e-5)):
        assert 500 < int(met.sum()) < 9900


def test_plastic_ratio_of_shattered_snow_is_held() -> None:
    """Snow torn a hundredfold apart stops at the largest ratio; it bears next to nothing."""
    _, plastic, stress = update(SOLIDS["snow"], 100.0 * np.eye(3)[None], np.ones(1))
    assert plastic[0] == LARGEST_PLASTIC
    assert 0 < np.abs(stress).max() < 1e-60


@EVERY_SOLID
def test_nothing_yields_twice(name: str) -> None:
    """The result of an update is elastic: a second one changes neither b nor the stress."""
    material = SOLIDS[name]
    b, _, stress = update(material, *states(material, 1000))
    history = rest_history(material, 1000)
    again, after, same = update(material, b, history)
    tight = deviators(stress) <= 1e-9  # sand at the tip of its cone has let go of all strain
    assert np.abs(again - b).max() <= 1e-13
    assert np.abs(after - history)[~tight].max() <= 1e-12
    if not isinstance(material, SnowMaterial):  # whose hardening is that of its past
        assert np.abs(same - stress).max() <= 1e-12 * max(MU, np.abs(stress).max())


@pytest.mark.parametrize("name", ["clay", "mud", "snow", "sand"])
def test_yield_keeps_the_volume(name: str) -> None:
    """To 1e-12 of J; snow's goes from the elastic to the plastic ratio; sand that is loose is not asked."""
    material = SOLIDS[name]
    b, history = states(material, 1000)
    elastic, after, stress = update(material, b, history)
    J, kept = np.sqrt(np.linalg.det(b)), np.sqrt(np.linalg.det(elastic))
    asked = np.full(1000, True)
    if isinstance(material, SnowMaterial):
        J, kept = J * history, kept * after
        asked = (after > SMALLEST_PLASTIC) & (after < LARGEST_PLASTIC)
    if isinstance(material, SandMaterial):
        J, asked = J * np.exp(history), np.abs(stress).max((1, 2)) > 0
    assert asked.sum() > 500
    assert np.abs(kept / J - 1)[asked].max() <= 1e-12


@pytest.mark.parametrize("name", ["sand", "clay", "mud"])
def test_plastic_work_is_never_negative(name: str) -> None:
    """The stress does work on the strain that yield takes."""
    material = SOLIDS[name]
    b, history = states(material, 5000)
    elastic, _, stress = update(material, b, np.zeros_like(history))
    work = (np.linalg.eigvalsh(stress) * (strains(b) - strains(elastic))).sum(1)
    assert work.min() >= -1e-12 * MU
    assert (work > 1e-6 * MU).sum() > 500


@pytest.mark.parametrize("name", scenes.MEDIA)
def test_bed_at_rest_is_at_rest_for_the_kernel(name: str) -> None:
    """The stress that a bed starts with is the one that the kernel gives its strain and history."""
    material = scenes.MEDIA[name]
    principal = np.array([[-0.0032, -0.003, -0.0031]])
    expected = material.stress(principal)
    if isinstance(material, WaterMaterial):
        given = tensors(64, np.exp(principal.sum(1)), np.zeros(1), np.zeros(1), constants(material))
        water_all(*given, law_of(material))
        assert expected[0] == pytest.approx(np.full(3, -given[1].item()), rel=1e-12)
    else:
        b, history = np.diag(np.exp(2 * principal[0]))[None], rest_history(material, 1)
        elastic, after, stress = update(material, b, history)
        assert np.abs(elastic - b).max() <= 1e-15
        assert np.abs(after - history).max() <= 1e-15
        assert np.diagonal(stress[0]) == pytest.approx(expected[0], rel=1e-10)


def test_viscosity_acts_on_the_rate_of_shear() -> None:
    """The deviator of the symmetric gradient: rotation and change of volume cost nothing."""
    C = np.random.default_rng(2).normal(size=(50, 3, 3))
    C[0], C[1] = 3.0 * np.eye(3), [[0, 1, 2], [-1, 0, 3], [-2, -3, 0]]
    given, rate = tensors(64, C, 0 * C)
    shear_rate_all(given, rate)
    expected = symmetric(C) - np.trace(C, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    assert np.abs(rate.numpy() - expected).max() <= 1e-15
    assert not rate[:2].any()
