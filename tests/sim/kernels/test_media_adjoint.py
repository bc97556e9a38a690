"""The adjoints of the media's laws against differences, where principal values meet included."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim.kernels.lanes import rounded, symmetric, tensors
from tests.sim.kernels.law_kernels import water_all
from tests.sim.kernels.media_laws import (
    MU,
    SOLIDS,
    Solid,
    Triple,
    assemble,
    constants,
    rest_history,
    states,
    states_of_size,
    update,
    update_adjoint,
)
from zoobench.sim.kernels.power_series import NEAR
from zoobench.sim.launcher import law_of
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.laws.snow import SnowMaterial
from zoobench.sim.model.laws.water import WaterMaterial

EVERY_SOLID = pytest.mark.parametrize("name", SOLIDS)
DISTANCES = (1e-4, 1e-5, 1e-6, 1e-7)


def _adjoints(b: np.ndarray, rng: np.random.Generator) -> Triple:
    return symmetric(rng.normal(size=b.shape)), rng.normal(size=len(b)), symmetric(rng.normal(size=b.shape)) / MU


def _value(material: Solid, b: np.ndarray, history: np.ndarray, adjoints: Triple) -> np.ndarray:
    elastic, after, tau = update(material, b, history)
    total: np.ndarray = (elastic * adjoints[0]).sum((1, 2)) + after * adjoints[1] + (tau * adjoints[2]).sum((1, 2))
    return total


def _errors(material: Solid, b: np.ndarray, history: np.ndarray) -> np.ndarray:
    """Relative error of the adjoint along random symmetric directions, best over the distances."""
    rng = np.random.default_rng(9)
    adjoints = _adjoints(b, rng)
    step, more = symmetric(rng.normal(size=b.shape)), rng.normal(size=len(b))
    if not isinstance(material, SandMaterial) and not rest_history(material, 1).any():
        more *= 0.0  # clay and mud have no past
    back, history_adjoint = update_adjoint(material, b, history, adjoints)
    assert np.abs(back - np.swapaxes(back, 1, 2)).max() <= 1e-12 * np.abs(back).max()
    exact = (back * step).sum((1, 2)) + history_adjoint * more
    # what a pull and a step of this size could at most give
    scale = 1e-3 * np.linalg.norm(step, axis=(1, 2)) * np.linalg.norm(adjoints[2] * MU, axis=(1, 2))
    errors = []
    for e in DISTANCES:
        derivative = _value(material, b + e * step, history + e * more, adjoints)
        derivative -= _value(material, b - e * step, history - e * more, adjoints)
        errors.append(np.abs(derivative / (2 * e) - exact) / np.maximum(np.abs(exact), scale))
    best: np.ndarray = np.min(errors, axis=0)
    return best


@EVERY_SOLID
def test_adjoint_matches_differences(name: str) -> None:
    """In elastic, yielding and loose states, with and without a past."""
    material = SOLIDS[name]
    assert _errors(material, *states(material, 300)).max() <= 1e-6


@pytest.mark.parametrize("size", [2e-3, 0.02, 0.09, 0.11])
@EVERY_SOLID
def test_adjoint_matches_differences_at_every_size(name: str, size: float) -> None:
    """Of strain, by the series and beyond them, with every kind of past."""
    material = SOLIDS[name]
    assert _errors(material, *states_of_size(material, 200, size)).max() <= 1e-6


# sand's yield divides as that of clay and mud does; each compiles its own law in 32 bits
@pytest.mark.slow
@pytest.mark.parametrize("name", SOLIDS)
def test_adjoint_of_small_strains_keeps_its_digits(name: str) -> None:
    """In 32 bits it is that of 64 to 5e-6 at strains of some thousandths, where yield divides by the strain."""
    material = SOLIDS[name]
    b, history = states_of_size(material, 300, 3e-3)
    given = rounded(32, b, history, *_adjoints(b, np.random.default_rng(14)))
    b, history, adjoints = given[0], given[1], (given[2], given[3], given[4])
    exact, single = (update_adjoint(material, b, history, adjoints, precision) for precision in (64, 32))
    for one, other in zip(single, exact, strict=True):
        assert np.abs(one - other).max() <= 5e-6 * np.abs(other).max()


@EVERY_SOLID
def test_series_and_eigenvectors_meet(name: str) -> None:
    """On both sides of the border between them, law and adjoint are the same to rounding: two derivations agree."""
    material = SOLIDS[name]
    if isinstance(material, SnowMaterial):
        material = replace(material, critical_compression=0.2, critical_stretch=0.2)
    rng = np.random.default_rng(13)
    b, history = states_of_size(material, 300, 1.0)
    adjoints = _adjoints(b, rng)
    sides = []
    for size in (NEAR * (1 - 1e-14), NEAR * (1 + 1e-14)):
        trial, past = np.eye(3) + size * (b - np.eye(3)), history
        if isinstance(material, SandMaterial):
            past = size * history
        sides.append((*update(material, trial, past), *update_adjoint(material, trial, past, adjoints)))
    for inner, outer in zip(*sides, strict=True):
        assert np.abs(inner - outer).max() <= 2e-13 * max(1.0, np.abs(outer).max())


SPECTRA = {
    "sand": [[-0.03, -0.03, -0.03], [-0.03, -0.03, -0.05], [-0.4, -0.02, -0.02]],
    "clay": [[0.01, 0.01, 0.01], [-0.03, -0.03, -0.05], [-0.4, -0.02, -0.02], [0.3, 0.3, -0.1]],
    "mud": [[-0.03, -0.03, -0.03], [0.02, 0.02, 0.03], [-0.4, -0.02, -0.02], [0.3, 0.3, -0.1]],
    "snow": [
        [0.002, 0.002, 0.002],
        [-0.01, -0.01, 0.003],
        [-0.1, -0.01, -0.01],
        [-0.1, -0.1, 0.05],
        [0.02, 0.02, 0.02],
    ],
}


@EVERY_SOLID
def test_adjoint_is_right_where_eigenvalues_meet(name: str) -> None:
    """Two or three equal eigenvalues and nearly equal ones, inside the yield surface and on it."""
    material = SOLIDS[name]
    turn = np.linalg.qr(np.random.default_rng(10).normal(size=(3, 3)))[0]
    b = assemble(turn, np.exp(2 * np.array(SPECTRA[name])))
    b = symmetric(np.concatenate([b, b * (1 + 1e-9 * np.diag([1.0, 0.0, -1.0]))]))
    assert _errors(material, b, rest_history(material, len(b))).max() <= 1e-6


def test_adjoint_of_sand_under_pressure_is_right_without_strain() -> None:
    """A negative surplus is pressure before any strain: it makes F = I an inner point of the cone."""
    b = np.stack([np.eye(3), (1 + 1e-9) * np.eye(3) - 2e-9 * np.diag([0.0, 0.0, 1.0])])
    assert _errors(SOLIDS["sand"], b, np.full(2, -0.05)).max() <= 1e-6


@EVERY_SOLID
def test_adjoint_is_right_at_rest(name: str) -> None:
    """At F = I: the two-sided derivative of clay and snow; for sand at the tip and mud at J = 1 that of loosening."""
    material, count = SOLIDS[name], 40
    rng = np.random.default_rng(11)
    b, history = np.tile(np.eye(3), (count, 1, 1)), rest_history(material, count)
    adjoints = _adjoints(b, rng)
    step = symmetric(rng.normal(size=b.shape))
    step += (1.0 - np.trace(step, axis1=1, axis2=2))[:, None, None] / 3 * np.eye(3)
    back, _ = update_adjoint(material, b, history, adjoints)
    assert np.isfinite(back).all()
    exact = (back * step).sum((1, 2))
    e = 1e-5
    here, near, far = (_value(material, b + k * e * step, history, adjoints) for k in (0, 1, 2))
    assert np.abs((4 * near - far - 3 * here) / (2 * e) - exact).max() <= 1e-6 * np.abs(exact).max()


def test_adjoint_of_sand_is_finite_at_rest() -> None:
    """F = I without pressure is the tip of the cone: the derivative is that of loosening, and finite."""
    rest = np.eye(3)[None]
    back, surplus_adjoint = update_adjoint(SOLIDS["sand"], rest, np.zeros(1), (rest, np.ones(1), rest))
    # the surplus gains tr(b) / 2
    assert np.allclose(back, rest / 2, atol=1e-15)
    assert surplus_adjoint[0] == 1.0


def test_derivative_of_water_pressure_matches_differences() -> None:
    """To 1e-8 of the bulk modulus, compressed and loose."""
    material = WaterMaterial(bulk_modulus=1e4, density=1000.0)
    J, e = np.concatenate([np.linspace(0.6, 0.99, 40), [1.01, 1.2]]), 1e-6

    def both(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        given = tensors(64, at, 0 * at, 0 * at, constants(material))
        water_all(*given, law_of(material))
        return given[1].numpy(), given[2].numpy()

    derivative = both(J)[1]
    expected = (both(J + e)[0] - both(J - e)[0]) / (2 * e)
    assert np.abs(derivative - expected).max() <= 1e-8 * np.abs(derivative).max()
