"""The Wasserstein barycenter against POT, against a closed form, and against finite differences."""

import itertools

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from zoobench.designs.primitives import Primitives
from zoobench.designs.wasserstein import barycenter, convolve, gaussian

WEIGHTS = ([0.5, 0.2, 0.3], [0.0, 0.6, 0.4], [1.0, 0.0, 0.0])
REGULARISATION = 0.003


def slices() -> torch.Tensor:
    """Orca, shark and clownfish in their plane of symmetry, as densities `[3, 40, 20]`."""
    x, y = np.meshgrid(np.linspace(-0.055, 0.055, 40), np.linspace(0.0, 0.055, 20), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    animals = Primitives("orca+shark+clownfish", 0.1).animals
    inside = np.stack([(animal.distance(points) <= 0.0).reshape(x.shape) for animal in animals])
    return torch.as_tensor(inside / inside.sum(axis=(1, 2), keepdims=True))


def ours(densities: torch.Tensor, weights: list[float], iterations: int, **options: int) -> NDArray[np.float64]:
    """The barycenter of slices one voxel thick, with POT's kernel."""
    kernels = [gaussian(n, (n - 1) * np.sqrt(REGULARISATION / 2.0)) for n in densities.shape[1:]]
    shares = torch.tensor(weights, dtype=torch.float64)
    kernels.append(gaussian(1, 1.0))
    return barycenter(densities[..., None], shares, kernels, iterations=iterations, **options)[..., 0].numpy()


@pytest.mark.slow
@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize(("name", "options"), [("", {"debiased": False}), ("_debiased", {"refinements": 10})])
def test_the_barycenter_of_slices_is_that_of_pot(weights: list[float], name: str, options: dict[str, int]) -> None:
    """The same numbers after as many iterations; debiased, with POT's ten refinements in each."""
    ot = pytest.importorskip("ot")
    densities = slices()
    theirs = getattr(ot.bregman, f"convolutional_barycenter2d{name}")(
        densities.numpy(), REGULARISATION, np.array(weights), numItermax=100, stopThr=0.0, stabThr=1e-300, warn=False
    )
    np.testing.assert_allclose(ours(densities, weights, 100, **options), theirs, rtol=1e-9, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("weights", WEIGHTS)
def test_fewer_refinements_lead_to_the_same_barycenter(weights: list[float]) -> None:
    """Three are cheaper than POT's ten; what they converge to differs by less than 2 % of the mass after as many
    iterations as a design space takes."""
    densities = slices()
    three, ten = ours(densities, weights, 100), ours(densities, weights, 100, refinements=10)
    assert np.abs(three - ten).sum() <= 0.02


@pytest.mark.slow
def test_the_barycenter_of_one_density_is_that_density() -> None:
    """Debiased, which is what debiasing is for: 3 % of the mass are misplaced, and less with more iterations; without,
    at least three times as much, and no less."""
    densities = slices()

    def misplaced(place: int, iterations: int, debiased: bool) -> float:
        found = ours(densities, np.eye(3)[place].tolist(), iterations, debiased=debiased)
        return float(np.abs(found - densities[place].numpy()).sum()) / 2.0

    for place in range(3):
        crisp, blurred = misplaced(place, 300, True), misplaced(place, 300, False)
        assert crisp <= 0.03
        assert blurred >= 3.0 * crisp
        if place == 0:
            assert misplaced(place, 900, True) < 0.8 * crisp
            assert misplaced(place, 900, False) > 0.99 * blurred


def test_a_gaussian_half_way_between_two_gaussians() -> None:
    """In three dimensions: the mean position by the weights, and the common width (Janati et al. 2020, theorem 2)."""
    counts, width = (28, 14, 14), 2.0
    grid = torch.stack(torch.meshgrid(*[torch.arange(n, dtype=torch.float64) for n in counts], indexing="ij"))

    def bump(centre: list[float]) -> torch.Tensor:
        away = grid - torch.tensor(centre, dtype=torch.float64).reshape(3, 1, 1, 1)
        density = torch.exp(-(away**2).sum(dim=0) / (2.0 * width**2))
        return density / density.sum()

    two = torch.stack([bump([8.0, 6.0, 7.0]), bump([20.0, 8.0, 7.0])])
    weights = torch.tensor([0.25, 0.75], dtype=torch.float64)
    found = barycenter(two, weights, [gaussian(n, 1.0) for n in counts], iterations=400)
    assert (found - bump([17.0, 7.5, 7.0])).abs().sum() <= 0.01


def test_mass_is_kept() -> None:
    """A density with sum 1 for any weights."""
    for weights in WEIGHTS:
        assert ours(slices(), weights, 300).sum() == pytest.approx(1.0, abs=1e-5)


def test_an_axis_at_a_time_is_the_whole_kernel() -> None:
    """The separable convolution against the sum over all pairs of voxels."""
    counts = (4, 3, 5)
    fields = torch.as_tensor(np.random.default_rng(0).normal(size=(2, *counts)))
    voxels = np.array(list(itertools.product(*map(range, counts))), float)
    dense = np.exp(-((voxels[:, None] - voxels) ** 2 @ (1.0 / (2.0 * np.array([1.0, 0.7, 1.3]) ** 2))))
    kernels = [gaussian(n, w) for n, w in zip(counts, (1.0, 0.7, 1.3), strict=True)]
    expected = fields.numpy().reshape(2, -1) @ dense
    np.testing.assert_allclose(convolve(fields, kernels).numpy().reshape(2, -1), expected, rtol=1e-12)


@pytest.mark.parametrize("debiased", [False, True])
def test_the_gradient_is_exact(debiased: bool) -> None:
    """By the weights, against finite differences, also where the barycenter is nearly zero."""
    densities = slices()[:, ::2, ::2, None]
    kernels = [gaussian(n, 1.0) for n in densities.shape[1:]]
    weights = torch.tensor([0.5, 0.2, 0.3], dtype=torch.float64, requires_grad=True)
    probes = torch.as_tensor(np.random.default_rng(0).normal(size=(5, *densities.shape[1:])))

    def readings(weights: torch.Tensor) -> torch.Tensor:
        found = barycenter(densities, weights, kernels, iterations=30, debiased=debiased)
        return (probes * found).sum(dim=(1, 2, 3))

    assert torch.autograd.gradcheck(readings, weights, atol=1e-8, rtol=1e-6, fast_mode=True)
