"""Element tests of the media's laws: one point of matter driven along a path whose stress is known."""

import numpy as np
import pytest

from tests.sim.kernels.lanes import symmetric
from tests.sim.kernels.media_laws import LAM, MU, MUD, SAND, SOLIDS, Solid, rest_history, update
from tests.sim.scenes import SNOW
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.sand import SandMaterial


def _shear(material: Solid, b: np.ndarray, strain: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Simple shear along x over y by `strain` in equal steps: all shear strains and stresses on the way."""
    increment = np.eye(3)
    increment[0, 1] = strain / steps
    history, path = rest_history(material, 1), []
    for _ in range(steps):
        b, history, stress = update(material, symmetric(increment @ b @ increment.T), history)
        path.append(stress[0])
    return strain * np.arange(1, steps + 1) / steps, np.array(path)


@pytest.mark.parametrize("ratio", [2.5e-3, 1e-2, 5e-2, 0.15])
def test_clay_in_simple_shear_is_capped(ratio: float) -> None:
    """Validation case V12: elastic up to yield, then tau_xy stands at (y / sqrt2) (1 - (y / 2 mu)^2)."""
    bound = 2 * MU * ratio
    material = ClayMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1800.0, yield_stress=bound)
    begin = np.sqrt(2) * ratio  # y / (sqrt2 mu)
    gamma, stress = _shear(material, np.eye(3)[None], 12 * begin, 240)
    shear = stress[:, 0, 1]
    # the elastic branch to large strain: principal strain asinh(gamma / 2), turned by atan(2 / gamma) / 2
    exact = 2 * MU * np.arcsinh(gamma / 2) / np.sqrt(1 + gamma**2 / 4)
    elastic = gamma < 0.999 * begin
    assert elastic.sum() >= 19
    assert shear[elastic] == pytest.approx(exact[elastic], rel=1e-10)
    assert shear[elastic] == pytest.approx(MU * gamma[elastic], rel=gamma[elastic].max() ** 2)
    assert (shear[gamma > 1.1 * begin] < 0.95 * exact[gamma > 1.1 * begin]).all()
    cap = bound / np.sqrt(2) * (1 - ratio**2)
    assert shear[-1] == pytest.approx(cap, rel=1e-3)
    assert np.abs(np.trace(stress, axis1=1, axis2=2)).max() <= 1e-10 * bound


def test_clay_in_uniaxial_stretch_is_capped() -> None:
    """Its principal stresses stand sqrt(3/2) y apart, which is the uniaxial yield stress."""
    bound, stretch = 400.0, 0.2
    material = ClayMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1800.0, yield_stress=bound)
    b = np.diag(np.exp(2 * stretch * np.array([1.0, -0.5, -0.5])))[None]
    elastic, _, stress = update(material, b, np.zeros(1))
    assert stress[0, 0, 0] - stress[0, 1, 1] == pytest.approx(np.sqrt(1.5) * bound, rel=1e-12)
    assert np.linalg.det(elastic[0]) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("name", ["clay", "mud"])
def test_no_yield_below_the_yield_stress(name: str) -> None:
    """A deviator at 0.999 of the yield stress is borne elastically, whatever the pressure; at 1.001 it is not."""
    solid = SOLIDS[name]
    rng = np.random.default_rng(3)
    deviator = rng.normal(size=(200, 3))
    deviator -= deviator.mean(1, keepdims=True)
    deviator *= solid.yield_stress / (2 * MU) / np.linalg.norm(deviator, axis=1, keepdims=True)
    volume = rng.uniform(-0.1, 0.1, (200, 1))
    for factor, kept in ((0.999, 0.999), (1.001, 1.0)):
        b = np.exp(2 * (factor * deviator + volume))[:, :, None] * np.eye(3)
        elastic, _, _ = update(solid, b, np.zeros(200))
        strain = 0.5 * np.log(np.diagonal(elastic, axis1=1, axis2=2))
        assert np.abs(strain - kept * deviator - volume).max() <= 1e-14


def test_mud_bears_pressure_but_no_tension() -> None:
    """In volume it is a fluid: p = K (1 - J) compressed, nothing when stretched."""
    J = np.array([0.8, 0.95, 1.05, 1.3])
    b = J[:, None, None] ** (2 / 3) * np.eye(3)
    _, _, stress = update(MUD, b, np.zeros(4))
    pressure = (LAM + 2 / 3 * MU) * np.maximum(1 - J, 0)
    assert np.allclose(stress, -(J * pressure)[:, None, None] * np.eye(3), rtol=1e-12, atol=1e-10)


TABLE = {-0.05: -4838.6, -0.1: -7787.1, -0.15: -12244.8, -0.2: -18833.8}
"""Kirchhoff stress [Pa] by log J: validation case V13."""


def _compress(logs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axial stress and plastic ratio of snow pressed along x in confinement, at each of the log J on the way."""
    b, history, found = np.eye(3)[None], np.ones(1), []
    for increment in np.diff(logs, prepend=0.0):
        step = np.diag([np.exp(increment), 1.0, 1.0])
        b, history, stress = update(SNOW, step @ b @ step, history)
        found.append((stress[0, 0, 0], history[0]))
    axial, plastic = np.array(found).T
    return axial, plastic


def test_snow_in_confined_compression_hardens() -> None:
    """Elastic to J = 0.975, from there on stress exp(xi (1 - J_P)) (2 mu + lambda) (s^2 - s) with J_P = J / 0.975."""
    mu, lam, critical = *SNOW.lame, 0.975
    logs = np.linspace(-0.0025, -0.215, 86)
    axial, plastic = _compress(logs)
    J = np.exp(logs)
    elastic = critical < J
    stretch = np.where(elastic, J, critical)
    ratio = np.where(elastic, 1.0, J / critical)
    expected = np.exp(10 * (1 - ratio)) * (2 * mu + lam) * (stretch**2 - stretch)
    assert 8 < elastic.sum() < 12
    assert plastic == pytest.approx(ratio, rel=1e-12)
    assert axial == pytest.approx(expected, rel=1e-6)
    at = [int(np.argmin(np.abs(logs - value))) for value in TABLE]
    assert logs[at] == pytest.approx(list(TABLE), abs=1e-12)
    assert axial[at] == pytest.approx(list(TABLE.values()), rel=1e-4)


def test_hardening_of_compacted_snow_is_held() -> None:
    """Pressed beyond a plastic ratio of 0.8, snow keeps the stress that it has there: exp(2) times that at yield."""
    axial, plastic = _compress(np.linspace(-0.01, -0.4, 40))
    assert plastic[-1] == plastic[-10] == 0.8
    yielding = (2 * SNOW.mu + SNOW.lam) * (0.975**2 - 0.975)
    assert axial[-1] == axial[-10] == pytest.approx(np.exp(2.0) * yielding, rel=1e-12)


@pytest.mark.parametrize("angle", [20.0, 30.0, 45.0])
def test_sand_in_simple_shear_slides_at_its_slope(angle: float) -> None:
    """Under steady shear of constant volume tau_xy / -tau_yy tends to 3 alpha / sqrt2 (validation case V11)."""
    material = SandMaterial(youngs_modulus=1e4, poissons_ratio=0.3, density=1600.0, friction_angle=angle)
    sine = np.sin(np.radians(angle))
    # 3 / sqrt2 of the cone's slope in triaxial compression
    exact = 2 * np.sqrt(3) * sine / (3 - sine)
    # the elastic strain, of the order of the pressure's, turns the stress out of the direction of shear
    for pressed, tolerance in ((1e-3, 1e-2), (1e-4, 1e-3)):
        _, stress = _shear(material, np.exp(-2 * pressed) * np.eye(3)[None], 50 * pressed, 100)
        assert -stress[-1, 0, 1] / stress[-1, 1, 1] == pytest.approx(exact, rel=tolerance)
        assert np.trace(stress[-1]) == pytest.approx(-3 * (2 * MU + 3 * LAM) * pressed, rel=1e-9)


def test_volume_correction_uses_up_what_was_gained() -> None:
    """Loosened sand bears no pressure until the volume that it gained is used up."""
    stretched, squeezed = np.exp(2 * 0.05), np.exp(-2 * 0.02)
    b, surplus, tau = update(SAND, stretched * np.eye(3)[None], np.zeros(1))
    assert surplus[0] == pytest.approx(0.15, rel=1e-12)
    assert np.allclose(b, np.eye(3), atol=1e-15)
    assert not tau.any()
    b, surplus, tau = update(SAND, squeezed * np.eye(3)[None], surplus)
    assert surplus[0] == pytest.approx(0.09, rel=1e-12)
    assert not tau.any()
    b, surplus, tau = update(SAND, np.exp(-2 * 0.05) * np.eye(3)[None], surplus)
    assert surplus[0] == 0.0
    strain = (0.09 - 0.15) / 3
    assert np.allclose(b[0], np.exp(2 * strain) * np.eye(3), rtol=1e-12)
    assert np.allclose(tau[0], (2 * MU + 3 * LAM) * strain * np.eye(3), rtol=1e-11, atol=1e-10)


def test_sand_inside_the_cone_is_elastic_and_shear_keeps_volume() -> None:
    """A state inside the cone is left as it is; one outside keeps its volume and the direction of its deviator."""
    limit = SAND.cone_slope * (3 * LAM + 2 * MU) / (2 * MU) * 0.09
    direction = np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    for factor, kept in ((0.9, 0.9), (3.0, 1.0)):
        strain = -0.03 + factor * limit * direction
        b, surplus, _ = update(SAND, np.diag(np.exp(2 * strain))[None], np.zeros(1))
        expected = -0.03 + kept * limit * direction
        assert np.allclose(0.5 * np.log(np.diagonal(b[0])), expected, rtol=1e-11)
        assert surplus[0] == 0.0
