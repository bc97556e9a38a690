"""The NumPy laws are the derivatives of their energies: tau = dPsi/dF F^T."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.kernels.media_laws import CLAY, MUD, SAND, SNOW, Solid, twin_update
from zoobench.sim.model.laws.clay import ClayMaterial
from zoobench.sim.model.laws.elastic import fibre_stress, lame_parameters, neo_hookean, neo_hookean_energy
from zoobench.sim.model.laws.hencky import quadratic_energy
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.laws.snow import SnowMaterial
from zoobench.sim.model.laws.water import WaterMaterial

MU, LAM = lame_parameters(1e4, 0.3)
FIBRE = np.array([0.6, 0.0, 0.8])


# steep cones and far yield surfaces, so that every state is elastic
SOLIDS: dict[str, Solid] = {
    "sand": replace(SAND, friction_angle=89.9),
    "clay": replace(CLAY, yield_stress=1e5),
    "mud": replace(MUD, yield_stress=1e5),
    "snow": replace(SNOW, critical_compression=0.9, critical_stretch=2.0),
}
WATER = WaterMaterial(bulk_modulus=1e4, density=1000.0)


def _strain(F: np.ndarray) -> np.ndarray:
    return 0.5 * np.log(np.linalg.eigvalsh(F @ np.swapaxes(F, -1, -2)))


def _elastic(material: Solid, F: np.ndarray) -> np.ndarray:
    """Stress of a solid medium in a state that does not yield; snow is hardened."""
    b, history = F @ np.swapaxes(F, -1, -2), np.full(len(F), 0.9 if isinstance(material, SnowMaterial) else 0.0)
    elastic, after, stress = twin_update(material, b, history)
    assert np.allclose(elastic, b, rtol=1e-10)
    assert np.allclose(after, history, rtol=1e-12)
    return stress


def _water(F: np.ndarray) -> np.ndarray:
    tau: np.ndarray = -WATER.pressure(np.linalg.det(F))[:, None, None] * np.eye(3)
    return tau


Law = Callable[[np.ndarray], np.ndarray]
LAWS: dict[str, tuple[Law, Law]] = {
    "neo-hookean": (lambda F: neo_hookean_energy(F, MU, LAM), lambda F: neo_hookean(F, MU, LAM)),
    "fibre": (lambda F: 350.0 * np.square(F @ FIBRE).sum(-1), lambda F: fibre_stress(F, 700.0, FIBRE)),
    "hencky": (lambda F: quadratic_energy(_strain(F), MU, LAM), partial(_elastic, SOLIDS["sand"])),
    "water": (lambda F: WATER.energy(_strain(F)), _water),
}
LAWS |= {
    name: (lambda F, m=material: m.energy(_strain(F), 0.9), partial(_elastic, material))  # type: ignore[misc]
    for name, material in SOLIDS.items()
}


@pytest.mark.parametrize("name", LAWS)
def test_stress_is_the_derivative_of_the_energy(name: str) -> None:
    """To 1e-6 by central differences in all nine components of F."""
    energy, stress = LAWS[name]
    rng = np.random.default_rng(1)
    F = 0.8 * np.eye(3) + 0.05 * rng.normal(size=(50, 3, 3))
    derivative = np.zeros_like(F)
    e = 1e-6
    for i in range(3):
        for j in range(3):
            step = np.zeros((3, 3))
            step[i, j] = e
            derivative[:, i, j] = (energy(F + step) - energy(F - step)) / (2 * e)
    expected = derivative @ np.swapaxes(F, 1, 2)
    assert np.abs(stress(F) - expected).max() <= 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("name", [*scenes.MEDIA])
def test_principal_stress_is_the_derivative_of_the_energy(name: str) -> None:
    """By each principal strain, compressed and stretched, at three plastic ratios of snow."""
    material, e = scenes.MEDIA[name], 1e-6
    strain = np.random.default_rng(2).uniform(-0.1, 0.1, (60, 3))
    plastic = np.repeat([0.8, 1.0, 1.2], 20)
    derivative = np.stack(
        [
            (material.energy(strain + d, plastic) - material.energy(strain - d, plastic)) / (2 * e)
            for d in e * np.eye(3)
        ],
        axis=1,
    )
    expected = material.stress(strain, plastic)
    assert np.abs(derivative - expected).max() <= 1e-6 * np.abs(expected).max()


def test_drucker_prager_keeps_what_it_is_told_to() -> None:
    """The ratio kept is 1 inside the cone, below 1 outside and 0 when loose; every case by hand."""
    # mu = lambda = 1 and a cone of slope 0.5
    sine = 3 * 0.5 / (2 * np.sqrt(2 / 3) + 0.5)
    sand = SandMaterial(2.5, 0.25, 1.0, float(np.degrees(np.arcsin(sine))))
    assert (*sand.lame, sand.cone_slope) == pytest.approx((1.0, 1.0, 0.5))
    strain = np.array([[-0.1, -0.1, -0.1], [0.2, -0.1, -0.25], [0.1, 0.1, 0.1]])
    elastic, left, keep = sand.radial_return(strain, np.array([0.0, 0.0, 0.02]))
    # cone: |dev| <= -0.5 (3 + 2) / 2 tr
    size = np.linalg.norm(strain[1] - strain[1].mean())
    assert keep == pytest.approx([1.0, 1.25 * 0.15 / size, 0.0])
    assert keep[1] < 1.0
    assert elastic[0] == pytest.approx(strain[0])
    assert elastic.sum(1) == pytest.approx([-0.3, -0.15, 0.0])
    assert left == pytest.approx([0.0, 0.0, 0.32])


def test_von_mises_keeps_what_it_is_told_to() -> None:
    """Clay scales the deviator back to y / 2 mu and leaves the volume; by hand."""
    clay = ClayMaterial(2.5, 0.25, 1.0, 0.2)
    strain = np.array([[0.05, 0.0, -0.05], [0.25, 0.05, -0.15], [0.5, 0.5, 0.5]])
    elastic, history, keep = clay.radial_return(strain, np.zeros(3))
    assert keep == pytest.approx([1.0, 0.1 / (0.2 * np.sqrt(2)), 1.0])
    assert elastic[0] == pytest.approx(strain[0])
    assert elastic[1] == pytest.approx([0.05 + 0.1 / np.sqrt(2), 0.05, 0.05 - 0.1 / np.sqrt(2)])
    assert elastic[2] == pytest.approx(strain[2])
    assert not history.any()


def test_snow_keeps_what_it_is_told_to() -> None:
    """Stretches are clamped and the rest goes to the plastic ratio, which is held too; by hand."""
    strain = np.log([[0.99, 1.0, 1.005], [0.9, 1.0, 1.1], [0.5, 0.5, 0.5]])
    elastic, plastic = SNOW.returned(strain, np.array([0.9, 0.9, 0.9]))
    assert np.exp(elastic) == pytest.approx(np.array([[0.99, 1.0, 1.005], [0.975, 1.0, 1.0075], [0.975] * 3]))
    assert plastic == pytest.approx([0.9, 0.9 * (0.9 / 0.975) * (1.1 / 1.0075), 0.8])
