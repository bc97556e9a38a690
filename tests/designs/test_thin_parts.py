"""Bodies with parts that are thinner than a particle."""

import numpy as np
import pytest
from scipy.ndimage import binary_opening

from zoobench import registry
from zoobench.arrays import Array, Mask
from zoobench.designs.sampling import Shape
from zoobench.designs.thin_parts import Thickness, coarsest, whole_sample
from zoobench.registry import Kind
from zoobench.spec import Ref


def test_thickness_is_the_volume_that_cubes_fill() -> None:
    """Against openings by scipy, on random matter; the share decreases with the cube."""
    cells = np.zeros((16, 14, 12), bool)
    cells[1:9, 2:9, 3:8] = cells[8:15, 5:6, 2:9] = cells[3:6, 9:12, 4:10] = True
    points = 0.5 * np.argwhere(cells)
    found = Thickness.of(points, 0.5)
    for span in range(1, 7):
        opened = binary_opening(np.pad(cells, 8), np.ones((span,) * 3))
        assert found.share(0.5 * span) == pytest.approx(opened.sum() / cells.sum())
    assert (np.diff(found.shares) <= 0.0).all()
    assert found.share(10.0) == 0.0


def test_the_coarsest_fidelity_that_holds_a_body_is_named() -> None:
    """By its name, or none if all are too coarse."""
    assert "'standard'" in coarsest(lambda fidelity: fidelity.grid_spacing < 1 / 90)
    assert "finer fidelity than those" in coarsest(lambda _: False)


@pytest.mark.parametrize(("foot", "noted"), [(0.012, "draft standard paper"), (0.024, "draft"), (0.036, "")])
def test_soles_that_a_level_does_not_resolve_are_noted(foot: float, noted: str) -> None:
    """A plate on four square feet of this edge [m]: where no disc of two cells fits in most of them."""

    def inside(points: Array) -> Mask:
        aside = np.abs(np.abs(points[:, [0, 2]]) - 0.03).max(axis=1) <= foot / 2
        found: Mask = (np.abs(points[:, [0, 2]]).max(axis=1) <= 0.05) & ((points[:, 1] >= 0.02) | aside)
        return found & (points[:, 1] >= 0.0) & (points[:, 1] <= 0.05)

    shape = Shape.standing(inside, 0.1, 0.05, 0.1)
    for level in ("draft", "standard", "paper"):
        notes = whole_sample("table", shape, registry.create(Kind.FIDELITY, Ref(level))).notes
        assert any("contact area" in note for note in notes) == (level in noted), (level, notes)
