"""The block: size, mass and muscles."""

import numpy as np
import pytest

from zoobench.designs.block import Block
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import PARTICLES_PER_CELL, Fidelity


@pytest.mark.parametrize("particles_per_cell", PARTICLES_PER_CELL)
@pytest.mark.parametrize("spacing", [1 / 32, 1 / 64, pytest.param(1 / 100, marks=pytest.mark.slow)])
def test_it_weighs_what_its_box_holds(spacing: float, particles_per_cell: int) -> None:
    """Length times width times height on every lattice, also if the edges are no multiple of the spacing."""
    for block, volume in ((Block(), 2.5e-4), (Block(length=0.0837, width=0.0419, height=0.0523), 1.834107e-4)):
        body = block.body(Fidelity(spacing, particles_per_cell=particles_per_cell))
        assert body.volumes.sum() == pytest.approx(volume, rel=0.02)
        assert (np.abs(body.positions[:, [0, 2]]) < (block.length / 2, block.width / 2)).all()
        assert 0.0 < body.positions[:, 1].min() <= body.positions[:, 1].max() < block.height


def test_its_muscles_are_named_from_the_tail() -> None:
    """Row by row, left before right, bottom before top; without a division its word is left out."""
    assert Block().muscles[:5] == (
        "row-1-left-bottom",
        "row-1-left-top",
        "row-1-right-bottom",
        "row-1-right-top",
        "row-2-left-bottom",
    )
    assert Block(rows=3, layers=1).muscles[2:4] == ("row-2-left", "row-2-right")
    assert Block(rows=1, columns=1, layers=1).muscles == ("row-1",)


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("columns", [1, 2])
@pytest.mark.parametrize("layers", [1, 2])
def test_a_muscle_is_where_its_name_says(rows: int, columns: int, layers: int) -> None:
    """Shares sum up to 1, and the names agree with the sides."""
    block = Block(rows=rows, columns=columns, layers=layers)
    body = block.body(Fidelity(1 / 64))
    np.testing.assert_allclose(body.muscle_membership.sum(axis=1), 1.0, atol=1e-12)
    for muscle, share in zip(body.muscles, body.muscle_membership.T, strict=True):
        x, y, z = body.positions[share > 0.6].T
        words = muscle.split("-")
        row = int(words[1])
        assert -0.05 + (row - 1) * 0.1 / rows <= x.min() <= x.max() <= -0.05 + row * 0.1 / rows
        for word, on_its_side in (("left", z < 0.0), ("right", z > 0.0), ("bottom", y < 0.025), ("top", y > 0.025)):
            assert word not in words or on_its_side.all()


def test_its_ends_are_labelled() -> None:
    """A quarter of the length each, the head in front."""
    body = Block().body(Fidelity(1 / 64))
    assert body.positions[body.head, 0].min() > 0.025
    assert body.positions[body.tail, 0].max() < -0.025
    assert body.head.sum() == body.tail.sum() > 0


@pytest.mark.parametrize("wrong", [{"rows": 0}, {"rows": 9}, {"columns": 3}, {"layers": 0}, {"height": 0.0}])
def test_what_makes_no_block_is_refused(wrong: dict[str, int]) -> None:
    """With the remedy."""
    with pytest.raises(UsageError, match="Give"):
        Block(**wrong)
