"""Added mass by a panel method against closed forms."""

import numpy as np
import pytest

from zoobench.arrays import Array
from zoobench.sim.model.potential_flow import added_per_area, added_volume, areas, potentials, slender_growth


def _ellipsoid(radii: tuple[float, float, float], count: int) -> Array:
    """The surface of an ellipsoid in triangles: a cube's, whose faces have `count` squared squares, blown up."""
    line = np.tan(np.linspace(-np.pi / 4, np.pi / 4, count + 1))
    u, v = np.meshgrid(line, line, indexing="ij")
    face = np.stack([u, v, np.ones_like(u)], axis=-1)
    corners = face[:-1, :-1], face[1:, :-1], face[1:, 1:], face[:-1, 1:]
    halves = np.concatenate(
        [np.stack([corners[k] for k in some], axis=2).reshape(-1, 3, 3) for some in ((0, 1, 2), (0, 2, 3))]
    )
    turned = [np.roll(halves, k, axis=2) for k in range(3)]
    whole = np.concatenate([*turned, *(-each[:, ::-1] for each in turned)])
    return whole / np.linalg.norm(whole, axis=2, keepdims=True) * radii


@pytest.mark.parametrize(
    ("radii", "exact"),
    [
        pytest.param((0.05, 0.05, 0.05), (0.5, 0.5, 0.5), marks=pytest.mark.slow),
        ((0.1, 0.02, 0.02), (0.0591, 0.8943, 0.8943)),
    ],
)
def test_added_mass_is_that_of_lamb(radii: tuple[float, float, float], exact: tuple[float, float, float]) -> None:
    """Of a sphere and of a spheroid five times as long as wide, by the water displaced."""
    triangles = _ellipsoid(radii, 10)
    assert np.abs(areas(triangles).sum(axis=0)).max() < 1e-12
    volume = float((triangles.mean(axis=1) * areas(triangles)).sum() / 3)
    assert volume == pytest.approx(4 / 3 * np.pi * np.prod(radii), rel=0.03)
    found = added_volume(triangles, potentials(triangles)) / volume
    assert np.diag(found) == pytest.approx(exact, rel=0.05)
    assert np.abs(found - np.diag(np.diag(found))).max() < 1e-3


def test_a_sphere_takes_water_along_everywhere_alike() -> None:
    """Along its own normal every triangle has half a radius of water."""
    triangles = _ellipsoid((0.05, 0.05, 0.05), 6)
    phi = added_per_area(triangles, potentials(triangles))
    assert phi == pytest.approx(np.full(len(phi), 0.025), rel=0.05)


@pytest.mark.slow
def test_growth_is_that_of_the_slices_of_a_slender_body() -> None:
    """Of one with flat slices, sides see its height and the top its width; what widens ahead is positive."""
    edge, (long, high, thick) = 0.006, (0.15, 0.04, 0.02)
    triangles = _ellipsoid((long, high, thick), 40)
    found, middles = slender_growth(triangles, edge), triangles.mean(axis=1)
    normals = areas(triangles) / np.linalg.norm(areas(triangles), axis=1, keepdims=True)
    inner = np.abs(middles[:, 0]) < 0.6 * long
    share = np.sqrt(1.0 - (middles[inner, 0, None] / long + np.array([3, -3]) * edge / long) ** 2)
    slope = np.pi / 2 * (share[:, 0] - share[:, 1]) / (6 * edge)
    for axis, half in ((2, high), (1, thick)):
        facing = np.abs(normals[inner, axis]) > 0.999
        assert facing.sum() > 20
        assert found[inner][facing] == pytest.approx(half * slope[facing], rel=0.1, abs=0.02)


def test_growth_finds_three_quarters_of_an_edge_across_the_flow() -> None:
    """Over the front of a plate the sum of growth by area is that of pi a^2, of a slice that begins there."""
    half, edge, count = 0.06, 0.004, 61
    ends = np.linspace(-half, half, count)
    x, y = np.meshgrid(ends, ends, indexing="ij")
    places = np.stack([x, y, np.zeros_like(x)], axis=-1)
    low, ahead, up, far = places[:-1, :-1], places[1:, :-1], places[:-1, 1:], places[1:, 1:]
    upper = np.concatenate(
        [np.stack([low, ahead, far], 2).reshape(-1, 3, 3), np.stack([low, far, up], 2).reshape(-1, 3, 3)]
    )
    triangles = np.concatenate([upper, upper[:, ::-1]])
    found, sizes = slender_growth(triangles, edge), np.linalg.norm(areas(triangles), axis=1)
    front = triangles.mean(axis=1)[:, 0] > 0.0
    assert -(found * sizes)[front].sum() == pytest.approx(0.75 * np.pi * half**2, rel=0.05)
    assert (found * sizes)[~front].sum() == pytest.approx(0.75 * np.pi * half**2, rel=0.05)
