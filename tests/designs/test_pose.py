"""The pose of bodies from files."""

import numpy as np
import pytest

from zoobench.arrays import Array, Mask
from zoobench.designs.pose import Direction, directions, mirror_symmetry, turned

SIZE = np.array([2.0, 5.0, 3.0])


@pytest.mark.parametrize(
    ("ahead", "up", "side", "expected"),
    [
        ("auto", "z", 0, ("y", "z")),
        ("auto", "-y", 0, ("z", "-y")),
        ("-x", "y", 0, ("-x", "y")),
        ("auto", "auto", 0, ("y", "z")),
        ("auto", "auto", 2, ("y", "x")),
        ("auto", "auto", 1, ("z", "x")),
        ("z", "auto", 0, ("z", "y")),
        ("-x", "auto", 0, ("-x", "z")),
    ],
)
def test_what_is_left_open_is_chosen(ahead: Direction, up: Direction, side: int, expected: tuple[str, str]) -> None:
    """The most symmetric axis goes from side to side, the longer of the others ahead; what is given stays."""
    assert directions(ahead, up, SIZE, lambda axis: 1.0 if axis == side else 0.8) == expected


def test_z_is_up_and_x_ahead_among_equals() -> None:
    """As in most CAD tools."""
    assert directions("auto", "auto", np.ones(3), lambda _: 1.0) == ("x", "z")


def test_symmetry_is_the_share_of_mirrored_points_inside() -> None:
    """A wedge is symmetric along its width alone."""

    def inside(points: Array) -> Mask:
        return np.asarray((points[:, 1] < points[:, 0]) & (np.abs(points - 0.5) < 0.5).all(axis=1))

    points = np.random.default_rng(0).uniform(size=(4000, 3))
    points = points[inside(points)]
    assert mirror_symmetry(points, inside, 2) == pytest.approx(1.0, abs=0.01)
    assert mirror_symmetry(points, inside, 0) == pytest.approx(0.5, abs=0.05)


def test_turning_keeps_right_handed_axes() -> None:
    """What is ahead becomes x, what is up becomes y, and the rest z with the same handedness."""
    axes = turned(np.eye(3), "-y", "z")
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_array_equal(axes[1], [-1.0, 0.0, 0.0])
    np.testing.assert_array_equal(axes[2], [0.0, 1.0, 0.0])
