"""The parts of a body that can meet."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.sim.model.body_parts import MOST_BLOCKS, BodyParts
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.rest_cells import RestCells


def _parts(cubes: Array, shift: Array | float = 0.0, per_cell: int = 8) -> tuple[RestCells, BodyParts]:
    """Cells and parts of a body of such cubes `[particles, 3]` of the lattice, its particles shifted in them [m]."""
    edge = scenes.SPACING / round(per_cell ** (1 / 3))
    sites = (cubes + 0.5) * edge
    body = ElasticBody.passive(scenes.SOFT, sites + shift, np.full(len(cubes), edge**3))
    body = replace(body, site_offsets=sites - body.positions)
    fidelity = replace(scenes.fidelity(), robot="lagrangian", particles_per_cell=per_cell)
    cells = RestCells.of(body, fidelity)
    return cells, BodyParts.of(cells, body, fidelity)


def _box(*edges: int) -> Array:
    return np.stack(np.meshgrid(*[np.arange(n) for n in edges], indexing="ij"), axis=-1).reshape(-1, 3)


def test_every_cell_is_in_one_part() -> None:
    """Parts follow each other in the list of cells, and those with a common node are not apart."""
    cells, parts = _parts(_box(20, 6, 6))
    assert sorted(parts.members.tolist()) == list(range(len(cells.nodes)))
    nodes = [
        set(cells.nodes[parts.members[begin:end]].ravel().tolist())
        for begin, end in zip(parts.first[:-1], parts.first[1:], strict=True)
    ]
    assert all(nodes)
    apart = {(a, b) for a in range(len(nodes)) for b in range(a) if not nodes[a] & nodes[b]}
    assert apart
    assert {(max(pair), min(pair)) for pair in parts.apart.tolist()} == apart


def test_legs_across_a_gap_are_apart() -> None:
    """Two legs within one block of cells are parts of their own; a body that is small in all directions has one."""
    assert len(_parts(_box(4, 4, 4))[1].apart) == 0
    comb = _box(4, 12, 4)
    comb = comb[(comb[:, 1] >= 8) | (comb[:, 0] == 0) | (comb[:, 0] == 3)]
    cells, parts = _parts(comb)
    leg = [
        cells.places[cells.nodes[parts.members[begin:end]].ravel()]
        for begin, end in zip(parts.first[:-1], parts.first[1:], strict=True)
    ]
    low = [number for number, places in enumerate(leg) if places[:, 1].min() == 0.0]
    assert len(low) == 2
    assert low in parts.apart.tolist()


def test_a_large_body_has_few_blocks() -> None:
    """As pairs of parts are looked at in every frame."""
    assert len(_parts(_box(40, 20, 20))[1].first) - 1 <= MOST_BLOCKS


def test_parts_beside_each_other_at_rest_are_not_apart() -> None:
    """Where limbs fill their cubes in part, their particles may lie as close at rest as those that meet."""
    comb = _box(5, 12, 4)
    comb = comb[(comb[:, 1] >= 8) | (comb[:, 0] <= 1) | (comb[:, 0] >= 3)]
    towards = np.where(comb[:, 1:2] >= 8, 0, np.select([comb[:, :1] == 1, comb[:, :1] == 3], [1, -1], 0))
    offsets = np.zeros(comb.shape)
    offsets[:, :1] = 0.45 * scenes.EDGE * towards
    (_, free), (_, close) = _parts(comb), _parts(comb, offsets)
    assert len(close.apart) < len(free.apart)


@pytest.mark.parametrize("per_cell", [8, 27])
def test_particles_of_thin_parts_have_a_share(per_cell: int) -> None:
    """All of a push on a flat face, less than a third on a spike, nothing where a cell has no particle."""
    count = round(per_cell ** (1 / 3))
    cubes = np.concatenate([_box(4 * count, 4 * count, 4 * count), [[4 * count, 2 * count, 2 * count]]])
    cells, parts = _parts(cubes, per_cell=per_cell)
    share = np.zeros(len(cubes))
    cell, lane = (cells.particles >= 0).nonzero()
    share[cells.particles[cell, lane]] = parts.share[cell, lane]
    face = (cubes[:, 0] == 0) & (np.abs(cubes[:, 1:] - 2 * count) < count).all(axis=1)
    assert share[face].min() == pytest.approx(1.0)
    assert share[-1] < 1 / 3
    assert (parts.share[cells.particles < 0] == 0.0).all()


def test_many_pieces_are_few_parts() -> None:
    """Loose cubes are as many parts as blocks, so that pairs of parts stay few."""
    loose = 3 * _box(8, 8, 8)
    assert len(_parts(loose)[1].first) - 1 <= MOST_BLOCKS
