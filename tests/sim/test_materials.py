"""The kernels' constitutive laws against their NumPy twins, and their adjoints against differences."""

import numpy as np
import pytest

from tests.sim import scenes
from tests.sim.law_kernels import fibre_all, neo_hookean_all, sand_all, sand_back_all, symmetric, tensors
from zoobench.sim import materials_numpy as twins
from zoobench.sim.materials import SMALLEST_J
from zoobench.sim.scene import lame_parameters

MU, LAM = lame_parameters(1e4, 0.3)
SLOPE = scenes.SAND.cone_slope
PRECISIONS = pytest.mark.parametrize(("precision", "tolerance"), [(64, 1e-12), (32, 1e-6)])


def _deformations(count: int = 200, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    F = np.eye(3) + 0.3 * rng.normal(size=(3 * count, 3, 3))
    return F[np.linalg.det(F) > 0.2][:count]


def _relative(found: np.ndarray, expected: np.ndarray, scale: float) -> float:
    """Largest error of a tensor relative to its norm, or to the law's own scale where that is larger."""
    axes = tuple(range(1, expected.ndim))
    size = np.maximum(np.sqrt(np.square(expected).sum(axes)), scale)
    return float((np.abs(found - expected).max(axes) / size).max())


def _neo_hookean(F: np.ndarray, pull: np.ndarray, precision: int = 64) -> tuple[np.ndarray, np.ndarray]:
    given, pulled, stress, back = tensors(precision, F, pull, 0 * F, 0 * F)
    neo_hookean_all(given, pulled, stress, back, MU, LAM)
    return stress.double().numpy(), back.double().numpy()


def _fibre(F: np.ndarray, fibre: np.ndarray, pull: np.ndarray, tension: float, precision: int = 64) -> list[np.ndarray]:
    zeros = (0 * F, 0 * F, np.zeros(len(F)), 0 * fibre)
    given = tensors(precision, F, fibre, pull, *zeros)
    fibre_all(*given, tension)
    return [t.double().numpy() for t in given[3:]]


def _sand(b: np.ndarray, surplus: np.ndarray, precision: int = 64) -> list[np.ndarray]:
    given = tensors(precision, b, surplus, 0 * b, 0 * surplus, 0 * b)
    sand_all(*given, MU, LAM, SLOPE)
    return [t.double().numpy() for t in given[2:]]


def _fibres(count: int) -> np.ndarray:
    d = np.random.default_rng(3).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def _sand_states(count: int, seed: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Random trial states: elastic, sheared and loose, some with log-volume to use up."""
    rng = np.random.default_rng(seed)
    turns = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    strain = 0.2 * rng.normal(size=(count, 3)) * rng.uniform(0, 1, (count, 1)) - 0.1 * rng.uniform(0, 1, (count, 1))
    b = symmetric(np.einsum("pij,pj,pkj->pik", turns, np.exp(2 * strain), turns))
    return b, np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0, 0.2, count))


@PRECISIONS
def test_laws_agree_with_their_twins(precision: int, tolerance: float) -> None:
    """Neo-Hookean, fibre and sand stress, elastic b and surplus."""
    kind = np.float64 if precision == 64 else np.float32
    F, pull = _deformations().astype(kind).astype(float), np.zeros((200, 3, 3))
    d = _fibres(200).astype(kind).astype(float)
    assert _relative(_neo_hookean(F, pull, precision)[0], twins.neo_hookean(F, MU, LAM), MU) <= tolerance
    assert _relative(_fibre(F, d, pull, 512.0, precision)[0], twins.fibre_stress(F, 512.0, d), 512.0) <= tolerance
    b, surplus = (a.astype(kind).astype(float) for a in _sand_states(500))
    found, expected = _sand(b, surplus, precision), twins.sand_update(b, surplus, MU, LAM, SLOPE)
    assert _relative(found[0], expected[0], 1.0) <= tolerance
    assert np.abs(found[1] - expected[1]).max() <= tolerance
    assert _relative(found[2], expected[2], MU) <= tolerance


def test_rest_is_free_of_stress() -> None:
    """At F = I passive matter and sand bear nothing, exactly."""
    rest = np.eye(3)[None]
    assert not _neo_hookean(rest, rest)[0].any()
    b, surplus, stress = _sand(rest, np.zeros(1))
    assert np.array_equal(b, rest)
    assert not stress.any()
    assert surplus[0] == 0.0


def test_laws_are_objective_and_isotropic() -> None:
    """tau(QF) = Q tau(F) Q^T and tau(FQ) = tau(F); a fibre turns with the rest pose."""
    F, none = _deformations(), np.zeros((200, 3, 3))
    Q = np.linalg.qr(np.random.default_rng(5).normal(size=(200, 3, 3)))[0]
    Q *= np.linalg.det(Q)[:, None, None]
    back = np.swapaxes(Q, 1, 2)
    stress = _neo_hookean(F, none)[0]
    assert _relative(_neo_hookean(Q @ F, none)[0], Q @ stress @ back, MU) <= 1e-12
    assert _relative(_neo_hookean(F @ Q, none)[0], stress, MU) <= 1e-12
    d = _fibres(200)
    active = _fibre(F, d, none, 700.0)[0]
    assert _relative(_fibre(Q @ F, d, none, 700.0)[0], Q @ active @ back, 700.0) <= 1e-12
    turned = np.einsum("pji,pj->pi", Q, d)
    assert _relative(_fibre(F @ Q, turned, none, 700.0)[0], active, 700.0) <= 1e-12
    b, surplus = _sand_states(200)
    elastic, left, tau = _sand(b, surplus)
    for found, expected in zip(_sand(symmetric(Q @ b @ back), surplus), (elastic, left, tau), strict=True):
        rotated = Q @ expected @ back if expected.ndim == 3 else expected
        assert np.abs(found - rotated).max() <= 1e-11 * max(1.0, np.abs(expected).max())


def test_adjoints_of_elastic_laws_match_differences() -> None:
    """Of neo-Hookean stress by F; of fibre stress by F, tension and fibre."""
    rng = np.random.default_rng(6)
    F, d = _deformations(), _fibres(200)
    pull, step, turn = symmetric(rng.normal(size=F.shape)), rng.normal(size=F.shape), rng.normal(size=d.shape)
    e = 1e-6

    def check(plus: np.ndarray, minus: np.ndarray, exact: np.ndarray) -> None:
        slope = ((plus - minus) * pull).sum((1, 2)) / (2 * e)
        assert np.abs(slope - exact).max() <= 1e-7 * np.abs(exact).max()

    back = _neo_hookean(F, pull)[1]
    check(_neo_hookean(F + e * step, pull)[0], _neo_hookean(F - e * step, pull)[0], (back * step).sum((1, 2)))
    _, F_back, tension_back, fibre_back = _fibre(F, d, pull, 3.0)
    at = [_fibre(F + s * e * step, d, pull, 3.0)[0] for s in (1, -1)]
    check(at[0], at[1], (F_back * step).sum((1, 2)))
    at = [_fibre(F, d, pull, 3.0 + s * e)[0] for s in (1, -1)]
    check(at[0], at[1], tension_back)
    at = [_fibre(F, d + s * e * turn, pull, 3.0)[0] for s in (1, -1)]
    check(at[0], at[1], (fibre_back * turn).sum(1))


def test_guard_of_an_inverted_element() -> None:
    """Below the smallest J stress and adjoint stay finite and log J is held, for flat and point-like matter too."""
    F = np.stack([np.diag([0.02, 1.0, 1.0]), np.diag([-0.5, 1.0, 1.0]), np.diag([0.0, 0.0, 1.0]), np.zeros((3, 3))])
    pull = np.tile(np.eye(3), (4, 1, 1))
    stress, back = _neo_hookean(F, pull)
    held = MU * (F @ np.swapaxes(F, 1, 2) - np.eye(3)) + LAM * np.log(SMALLEST_J) * np.eye(3)
    assert np.allclose(stress, held, rtol=1e-14)
    assert np.allclose(back, 2 * MU * F, rtol=1e-14)


@PRECISIONS
def test_sand_never_leaves_its_yield_cone(precision: int, tolerance: float) -> None:
    """|dev tau| <= -alpha tr tau after the return of 10,000 random states, to 1e-5 relative; no tension anywhere."""
    del tolerance
    b, surplus = _sand_states(10_000)
    _, left, tau = _sand(b, surplus, precision)
    pressure = -np.trace(tau, axis1=1, axis2=2)
    deviator = tau + pressure[:, None, None] / 3 * np.eye(3)
    size = np.sqrt(np.square(deviator).sum((1, 2)))
    # round-off of the deviator is that of the whole stress
    noise = 10 * (1e-16 if precision == 64 else 1e-7) * MU
    assert (size <= SLOPE * pressure * (1 + 1e-5) + noise).all()
    assert (pressure >= -noise).all()
    assert (left >= 0).all()
    sheared = size >= SLOPE * pressure * (1 - 1e-4) - noise
    assert 1000 < int((sheared & (pressure > 100 * noise)).sum()) < 9900


def test_volume_correction_uses_up_what_was_gained() -> None:
    """Loosened sand bears no pressure until the volume that it gained is used up."""
    stretched, squeezed = np.exp(2 * 0.05), np.exp(-2 * 0.02)
    b, surplus, tau = _sand(stretched * np.eye(3)[None], np.zeros(1))
    assert surplus[0] == pytest.approx(0.15, rel=1e-12)
    assert np.allclose(b, np.eye(3), atol=1e-15)
    assert not tau.any()
    b, surplus, tau = _sand(squeezed * np.eye(3)[None], surplus)
    assert surplus[0] == pytest.approx(0.09, rel=1e-12)
    assert not tau.any()
    b, surplus, tau = _sand(np.exp(-2 * 0.05) * np.eye(3)[None], surplus)
    assert surplus[0] == 0.0
    strain = (0.09 - 0.15) / 3
    assert np.allclose(b[0], np.exp(2 * strain) * np.eye(3), rtol=1e-12)
    assert np.allclose(tau[0], (2 * MU + 3 * LAM) * strain * np.eye(3), rtol=1e-11, atol=1e-10)


def test_sand_inside_the_cone_is_elastic_and_shear_keeps_volume() -> None:
    """A state inside the cone is left as it is; one outside keeps its volume and the direction of its deviator."""
    limit = SLOPE * (3 * LAM + 2 * MU) / (2 * MU) * 0.09
    direction = np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    for factor, kept in ((0.9, 0.9), (3.0, 1.0)):
        strain = -0.03 + factor * limit * direction
        b, surplus, _ = _sand(np.diag(np.exp(2 * strain))[None], np.zeros(1))
        expected = -0.03 + kept * limit * direction
        assert np.allclose(0.5 * np.log(np.diagonal(b[0])), expected, rtol=1e-11)
        assert surplus[0] == 0.0


def _sand_value(b: np.ndarray, surplus: np.ndarray, pulls: tuple[np.ndarray, ...]) -> np.ndarray:
    elastic, left, tau = _sand(b, surplus)
    total: np.ndarray = (elastic * pulls[0]).sum((1, 2)) + left * pulls[1] + (tau * pulls[2]).sum((1, 2))
    return total


def _sand_errors(b: np.ndarray, surplus: np.ndarray) -> np.ndarray:
    """Relative error of the adjoint along random symmetric directions, best over the distances."""
    rng = np.random.default_rng(9)
    count = len(b)
    pulls = (symmetric(rng.normal(size=b.shape)), rng.normal(size=count), symmetric(rng.normal(size=b.shape)) / MU)
    step, more = symmetric(rng.normal(size=b.shape)), rng.normal(size=count)
    given = tensors(64, b, surplus, *pulls, 0 * b, 0 * surplus)
    sand_back_all(*given, MU, LAM, SLOPE)
    back, surplus_back = given[5].numpy(), given[6].numpy()
    assert np.abs(back - np.swapaxes(back, 1, 2)).max() <= 1e-12 * np.abs(back).max()
    exact = (back * step).sum((1, 2)) + surplus_back * more
    # what a pull and a step of this size could at most give
    scale = 1e-3 * np.linalg.norm(step, axis=(1, 2)) * np.linalg.norm(pulls[2] * MU, axis=(1, 2))
    errors = []
    for e in (1e-4, 1e-5, 1e-6, 1e-7):
        slope = _sand_value(b + e * step, surplus + e * more, pulls) - _sand_value(
            b - e * step, surplus - e * more, pulls
        )
        errors.append(np.abs(slope / (2 * e) - exact) / np.maximum(np.abs(exact), scale))
    best: np.ndarray = np.min(errors, axis=0)
    return best


def test_adjoint_of_sand_matches_differences() -> None:
    """In elastic, sheared and loose states, with and without volume to use up."""
    assert _sand_errors(*_sand_states(300)).max() <= 1e-6


def test_adjoint_of_sand_is_right_where_eigenvalues_meet() -> None:
    """Two or three equal eigenvalues, F = I under pressure included, inside the cone and on it."""
    turn = np.linalg.qr(np.random.default_rng(10).normal(size=(3, 3)))[0]
    spectra = np.exp(2 * np.array([[-0.03, -0.03, -0.03], [-0.03, -0.03, -0.05], [-0.4, -0.02, -0.02], [0, 0, 0]]))
    b = np.einsum("ij,pj,kj->pik", turn, spectra, turn)
    b = symmetric(np.concatenate([b, b * (1 + 1e-9 * np.diag([1.0, 0.0, -1.0]))]))
    b[3] = np.eye(3)
    # a negative surplus is pressure before any strain: it makes F = I an inner point of the cone
    surplus = np.where(np.arange(8) % 4 == 3, -0.05, 0.0)
    assert _sand_errors(b, surplus).max() <= 1e-6


def test_adjoint_of_sand_is_finite_at_rest() -> None:
    """F = I without pressure is the tip of the cone: the derivative is that of loosening, and finite."""
    rest = np.eye(3)[None]
    given = tensors(64, rest, np.zeros(1), rest, np.ones(1), rest, 0 * rest, np.zeros(1))
    sand_back_all(*given, MU, LAM, SLOPE)
    # the surplus gains tr(b) / 2
    assert np.allclose(given[5].numpy(), rest / 2, atol=1e-15)
    assert given[6].item() == 1.0
