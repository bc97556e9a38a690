"""The skin follows the particles."""

import numpy as np
import pytest

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.registry import Kind
from zoobench.render.skin import normals, skin
from zoobench.spec import Ref

pytest.importorskip("skimage")


def body(name: str = "fish") -> Body:
    """A design at `draft`."""
    made: Body = registry.create(Kind.DESIGN, Ref(name)).body(registry.create(Kind.FIDELITY, Ref("draft")))
    return made


def test_the_skin_moves_as_an_affine_motion_moves_its_particles() -> None:
    """Turned, stretched, sheared and carried away, every vertex is where the motion takes it, to rounding."""
    fish = body()
    cover = skin(fish)
    at_rest = cover.places @ fish.positions
    rng = np.random.default_rng(0)
    change, offset = np.eye(3) + rng.normal(0.0, 0.4, (3, 3)), rng.normal(size=3)
    np.testing.assert_allclose(
        cover.places @ (fish.positions @ change.T + offset), at_rest @ change.T + offset, atol=1e-9
    )


def test_the_skin_encloses_the_body() -> None:
    """Its volume is the body's to 3 %, its faces look outwards."""
    fish = body()
    cover = skin(fish)
    a, b, c = ((cover.places @ fish.positions)[cover.faces[:, corner]] for corner in range(3))
    assert abs((a * np.cross(b, c)).sum() / 6 / fish.volumes.sum() - 1) < 0.03


def test_values_stay_within_those_of_the_particles() -> None:
    """A constant stays what it is, and between 0 and 1 nothing leaves."""
    fish = body()
    cover = skin(fish)
    np.testing.assert_allclose(cover.shares @ np.ones(fish.particle_count), 1.0)
    values = cover.shares @ (fish.positions[:, 0] > 0).astype(float)
    assert 0.0 <= values.min() < 0.01
    assert 0.99 < values.max() <= 1.0 + 1e-12


def test_normals_of_an_octahedron_point_to_its_corners() -> None:
    """By symmetry."""
    corners = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    np.testing.assert_allclose(normals(corners, faces), corners, atol=1e-12)
