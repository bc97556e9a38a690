"""The barycenter space: the ends of the simplex, volume kept between them, and gradients."""

from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from scipy.spatial import KDTree

from tests.designs.test_mixture import COUNT, ORCA, TUNA, mixture, workspace
from zoobench.designs.barycenter import barycenter_space, keep_volume
from zoobench.designs.sdf_lerp import sdf_lerp
from zoobench.designs.wasserstein import barycenter

SPACE = barycenter_space()
KNOWN: dict[tuple[bytes, int], torch.Tensor] = {}
"""Barycenters of the space by weights and iterations: no grid of particles changes them."""


@pytest.fixture(autouse=True)
def _transported_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same weights are transported once for all tests that ask for no gradient."""

    def remembered(densities: torch.Tensor, weights: torch.Tensor, **rest: Any) -> torch.Tensor:
        if weights.requires_grad:
            return barycenter(densities, weights, **rest)
        key = weights.numpy().tobytes(), rest["iterations"]
        if key not in KNOWN:
            KNOWN[key] = barycenter(densities, weights, **rest)
        return KNOWN[key]

    monkeypatch.setattr("zoobench.designs.barycenter.barycenter", remembered)


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Intersection over union of two sets of particles [-]."""
    return float((one & other).sum() / (one | other).sum())


@pytest.mark.usefixtures("few_iterations")
def test_fibres_are_ahead() -> None:
    """Everywhere."""
    assert (mixture(SPACE, np.full(COUNT, 0.25), 32).fibres[0] == torch.tensor([1.0, 0.0, 0.0])).all()


@pytest.mark.parametrize(("cells", "least"), [(64, 0.88), pytest.param(128, 0.95, marks=pytest.mark.slow)])
@pytest.mark.parametrize("end", [0, *(pytest.param(end, marks=pytest.mark.slow) for end in range(1, COUNT))])
def test_an_end_of_the_simplex_is_a_primitive(end: int, cells: int, least: float) -> None:
    """Nearly all of its particles and few others, its tissues and its volume."""
    body = workspace(cells)
    tissues = SPACE.primitives.tissues(body)
    form = mixture(SPACE, np.eye(COUNT)[end], cells)
    occupancy = form.occupancy[0].numpy()
    assert overlap(occupancy > 0.5, tissues.distances[end].numpy() < 0.0) >= least
    assert (occupancy * body.volumes).sum() == pytest.approx(SPACE.primitives.volumes[end], rel=1e-9)
    np.testing.assert_allclose(form.stiffness[0], tissues.stiffness[end], atol=1e-12)
    np.testing.assert_allclose(form.muscle_membership[0], tissues.membership[end], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("cells", [64, pytest.param(128, marks=pytest.mark.slow)])
def test_volume_is_kept_between_primitives(cells: int) -> None:
    """From the orca to the tuna, where SDF-Lerp loses more than 5 %; on a fine grid by the particles that are half
    there or more, too: it is no haze that keeps it."""
    body, volumes = workspace(cells), SPACE.primitives.volumes
    for share in (0.25, 0.5, 0.75):
        weights = np.zeros(COUNT)
        weights[[ORCA, TUNA]] = 1.0 - share, share
        occupancy = mixture(SPACE, weights, cells).occupancy[0].numpy()
        assert (occupancy * body.volumes).sum() == pytest.approx(weights @ volumes, rel=1e-9)
        if cells == 128:
            assert ((occupancy > 0.5) * body.volumes).sum() == pytest.approx(weights @ volumes, rel=0.05)


@pytest.mark.slow
def test_space_is_empty_or_full() -> None:
    """Few particles have an intermediate occupancy: up to 1.25 times those of the primitives by SDF-Lerp."""

    def skin(occupancy: NDArray[np.float64]) -> float:
        return float(((occupancy > 0.1) & (occupancy < 0.9)).sum() / (occupancy >= 0.9).sum())

    occupancy = mixture(SPACE, np.full(COUNT, 0.25), 128).occupancy[0].numpy()
    ends = torch.as_tensor(np.tile(100.0 * np.eye(COUNT), (1, 3)))
    own = [skin(end.numpy()) for end in sdf_lerp().form(ends, workspace(128)).occupancy]
    assert skin(occupancy) <= 1.25 * np.mean(own)
    assert occupancy.max() > 0.99
    assert occupancy.min() < 1e-6


@pytest.mark.slow
def test_left_and_right_are_mirror_images() -> None:
    """For any coefficients, so that a body does not turn by itself."""
    body = workspace(64)
    parameters = torch.tensor(SPACE.initial(np.random.default_rng(3), body)[None])
    occupancy = SPACE.form(parameters, body).occupancy[0].numpy()
    twin = KDTree(body.positions).query(body.positions * (1.0, 1.0, -1.0))[1]
    np.testing.assert_allclose(occupancy[twin], occupancy, atol=1e-9)


@pytest.mark.parametrize(
    ("parameters", "iterations"),
    [
        ([0.0] * 12, 10),
        ([60.0, -60.0, 0.0, 0.0] * 3, 10),
        ([800.0, 0.0, 0.0, -800.0] * 3, 10),
        pytest.param([800.0, 0.0, 0.0, -800.0] * 3, 100, marks=pytest.mark.slow),
    ],
)
def test_gradients_are_finite_everywhere(
    parameters: list[float], iterations: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the middle of the simplex, and at ends where a weight underflows; after all iterations at the farthest."""
    monkeypatch.setattr("zoobench.designs.barycenter._ITERATIONS", iterations)
    body = workspace(64)
    free = torch.tensor([parameters], dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(SPACE.form(free, body).occupancy.square().sum(), free)
    assert torch.isfinite(gradient).all()


@pytest.mark.slow  # test_spaces.py asks it of every space, on a coarser grid
@pytest.mark.usefixtures("few_iterations")
def test_empty_space_near_the_skin_has_a_gradient() -> None:
    """Of a particle just outside the surface."""
    body = workspace(64)
    free = torch.zeros((1, 12), dtype=torch.float64, requires_grad=True)
    occupancy = SPACE.form(free, body).occupancy[0]
    full = body.positions[occupancy.detach().numpy() > 0.5]
    gap = KDTree(full).query(body.positions)[0]
    outside = np.flatnonzero((occupancy.detach().numpy() < 0.5) & (gap < 1.1 * body.edge))
    assert len(outside) > 50
    for n in outside[:: len(outside) // 12]:
        (gradient,) = torch.autograd.grad(occupancy[n], free, retain_graph=True)
        assert gradient.abs().max() > 0.0


@pytest.mark.slow
def test_the_level_at_which_a_volume_is_kept() -> None:
    """For volumes from nearly empty to nearly full, with the gradient."""
    field = torch.as_tensor(np.random.default_rng(0).normal(size=40)).requires_grad_()
    volumes = torch.as_tensor(np.random.default_rng(1).uniform(0.5, 1.5, size=40))
    for share in (0.01, 0.4, 0.99):
        volume = (share * volumes.sum()).requires_grad_()
        assert (volumes * keep_volume(field, volumes, volume)).sum().item() == pytest.approx(volume.item(), rel=1e-12)
        assert torch.autograd.gradcheck(lambda f, v: keep_volume(f, volumes, v), (field, volume))
