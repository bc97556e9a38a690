"""Muscle groups derived from a shape."""

import numpy as np
import pytest

from zoobench.designs.grouping import CentredGroups, check_used, k_means, paired, slices
from zoobench.errors import SceneError
from zoobench.sim.model.fidelity import Fidelity


def test_k_means_finds_clumps_and_slices_cut_rods() -> None:
    """Four clusters are four groups; a rod has equal slices with fibres along it."""
    rng = np.random.default_rng(0)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    points = (corners[:, None] + rng.uniform(-0.1, 0.1, size=(4, 50, 3))).reshape(-1, 3)
    shares = k_means(points, 4).membership(points)
    assert sorted(shares.sum(axis=0)) == [50, 50, 50, 50]
    rod = rng.uniform((-1.0, -0.1, -0.1), (1.0, 0.1, 0.1), size=(400, 3))
    cut = slices(rod, 4)
    assert cut.directions[:, 0] == pytest.approx(1.0, abs=0.01)
    assert (cut.membership(rod).argmax(axis=1) == np.clip((rod[:, 0] + 1) * 2, 0, 3).astype(int)).mean() > 0.97


def test_fewer_points_than_groups_leave_a_group_empty() -> None:
    """Its centre is one of theirs, and each point has a muscle; as of a muscle without a particle it is refused."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    groups = k_means(points, 3)
    assert np.isfinite(groups.centres).all()
    assert sorted(groups.membership(points).sum(axis=0)) == [0.0, 1.0, 1.0]


def test_pairs_are_mirror_images_of_equal_volume() -> None:
    """Three rows of four in a spindle; a point in the middle plane belongs to both sides."""
    points = np.random.default_rng(0).uniform(-1.0, 1.0, size=(8000, 3)) * (3.0, 1.0, 1.0)
    points = points[np.hypot(points[:, 1], points[:, 2]) < 1.0 - np.abs(points[:, 0]) / 3.0]
    points = np.vstack([points, points * (1.0, 1.0, -1.0)])
    groups = paired(points, 12)
    shares = groups.membership(points)
    assert shares.mean(axis=0) == pytest.approx(1 / 12, abs=0.005)
    mirrored = groups.membership(points * (1.0, 1.0, -1.0)).reshape(-1, 3, 2, 2)[:, :, ::-1].reshape(-1, 12)
    np.testing.assert_array_equal(mirrored, shares)
    assert groups.names[0] == "row-1-left-bottom"
    assert points[shares[:, 0] > 0.5].max(axis=0)[[0, 2]].max() < 0.0
    middle = groups.membership(np.array([[0.1, 0.5, 0.0]]))[0]
    assert dict(zip(groups.names, middle, strict=True))["row-2-left-top"] == pytest.approx(0.5)
    assert middle.sum() == pytest.approx(1.0)


def test_a_body_too_short_for_its_rows_is_refused() -> None:
    """Of a plate across the way ahead, two points thick, no third row has any."""
    plate = np.indices((2, 20, 20)).reshape(3, -1).T.astype(float)
    assert np.isfinite(paired(plate, 8).membership(plate)).all()
    with pytest.raises(SceneError, match="3 rows"):
        paired(plate, 12)


def test_a_muscle_without_a_particle_is_refused() -> None:
    """The message names it."""
    with pytest.raises(SceneError, match="no particle for b at"):
        check_used(np.array([[1.0, 0.0]]), ("a", "b"), Fidelity(1 / 64), "body.stl")


def test_fibres_between_two_groups_turn_with_the_squared_distance() -> None:
    """The axis of x x^T / d1^2 + y y^T / d2^2 for two directions, at an angle of tan 2a = w sin 2b / (1 + w cos 2b)."""
    between = np.radians(60.0)
    directions = np.array([[1.0, 0.0, 0.0], [np.cos(between), np.sin(between), 0.0]])
    groups = CentredGroups(np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), directions, np.eye(3))
    weight = (1.0 / 2.0) ** 2  # of the second group, at 1 from the first and 2 from the second
    angle = np.arctan2(weight * np.sin(2 * between), 1.0 + weight * np.cos(2 * between)) / 2
    assert groups.fibres(np.array([[1.0, 0.0, 0.0]])) == pytest.approx(np.array([[np.cos(angle), np.sin(angle), 0.0]]))
