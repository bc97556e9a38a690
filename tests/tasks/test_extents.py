"""Edges, extents and areas of deforming bodies."""

import dataclasses

import pytest
import torch

from tests.tasks.motions import lattice, mapped, motion, scattered, yaw
from zoobench.tasks.extents import covered_area, edges, extent

BOX = lattice(spacing=0.0025)
STRETCH = torch.diag(torch.tensor([1.2, 0.7, 1.1], dtype=torch.float64))


def test_a_box_has_its_own_edges() -> None:
    """At the start and stretched, along all axes, to a fifth of a particle."""
    found = mapped(BOX, [STRETCH])
    for axis, (lower, upper) in enumerate([(-0.05, 0.05), (0.0, 0.05), (-0.02, 0.02)]):
        for state, factor in enumerate([1.0, float(STRETCH[axis, axis])]):
            low, high = (float(edge[state, 0]) for edge in edges(found, axis))
            assert (low, high) == pytest.approx((factor * lower, factor * upper), abs=0.0005)


def test_a_rectangle_has_its_own_area_however_it_is_turned() -> None:
    """The covariance of points in the middles of cells lacks that of a cell: h^2 / 12 of each side."""
    found = covered_area(mapped(BOX, [STRETCH, yaw(0.6)]))[:, 0]
    box = ((0.1**2 - 0.0025**2) * (0.04**2 - 0.0025**2)) ** 0.5
    assert found.tolist() == pytest.approx([box, 1.32 * box, box], rel=1e-3)
    assert float(found[2] / found[0]) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("away", [0.2, 1.0, 100.0])
def test_a_stray_particle_decides_nothing(away: float) -> None:
    """One of 640, however far away: extents grow by less than a millimetre, the area by less than 1 %."""
    rest = lattice()
    torn = rest.clone()
    torn[17] += torch.tensor([away, away, 0.3 * away])
    found = motion(rest, torch.stack([rest, torn]))
    for axis in range(3):
        growth = extent(found, axis)
        assert abs(float(growth[1] - growth[0])) < 1e-3
    area = covered_area(found)
    assert float(area[1] / area[0]) < 1.01


def test_matter_counts_by_its_occupancy() -> None:
    """What is empty may be anywhere, and two halves are a whole."""
    rest = scattered(40)
    doubled = torch.cat([rest, rest, rest + 5.0])
    still = motion(doubled, torch.stack([doubled, 1.1 * doubled]))
    occupancy = torch.cat([torch.full((80,), 0.5), torch.zeros(40)])[None].double()
    halves = dataclasses.replace(still, occupancy=occupancy, masses=occupancy)
    whole = motion(rest, torch.stack([rest, 1.1 * rest]))
    for axis in range(3):
        torch.testing.assert_close(extent(halves, axis), extent(whole, axis), rtol=1e-12, atol=1e-15)
    torch.testing.assert_close(covered_area(halves), covered_area(whole), rtol=1e-12, atol=0.0)
