"""Added mass by a panel method against closed forms."""

import numpy as np
import pytest

from zoobench.arrays import Array
from zoobench.sim.model.potential_flow import added_per_area, added_volume, areas, growth, potentials


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
    ("radii", "exact"), [((0.05, 0.05, 0.05), (0.5, 0.5, 0.5)), ((0.1, 0.02, 0.02), (0.0591, 0.8943, 0.8943))]
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
    """Along its own normal every triangle has half a radius of water, which does not grow in any direction."""
    triangles = _ellipsoid((0.05, 0.05, 0.05), 6)
    phi = added_per_area(triangles, potentials(triangles))
    assert phi == pytest.approx(np.full(len(phi), 0.025), rel=0.05)
    assert np.abs(growth(triangles, phi, 0.02)).max() < 0.05


def test_growth_is_a_gradient_along_the_surface() -> None:
    """Of values that rise steadily it is their slope, less the part across the surface."""
    triangles, slope = _ellipsoid((0.05, 0.05, 0.05), 12), np.array([1.0, -2.0, 0.5])
    found = growth(triangles, triangles.mean(axis=1) @ slope, 0.01)
    normals = areas(triangles) / np.linalg.norm(areas(triangles), axis=1, keepdims=True)
    along = slope - (normals @ slope)[:, None] * normals
    assert np.abs(found - along).max() < 0.15 * np.linalg.norm(slope)
    assert np.abs((found * normals).sum(axis=1)).max() < 1e-12
