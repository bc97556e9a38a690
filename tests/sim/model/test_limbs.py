"""The parts of a body that can meet."""

from dataclasses import replace

import numpy as np

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.limbs import MOST_BLOCKS, Limbs
from zoobench.sim.model.rest_cells import RestCells


def _parts(cubes: Array) -> tuple[RestCells, Limbs]:
    """Cells and parts of a body of such cubes `[particles, 3]` of the lattice."""
    body = ElasticBody.passive(scenes.SOFT, (cubes + 0.5) * scenes.EDGE, np.full(len(cubes), scenes.EDGE**3))
    cells = RestCells.of(body, replace(scenes.fidelity(), robot="lagrangian"))
    return cells, Limbs.of(cells, scenes.SPACING)


def _box(*edges: int) -> Array:
    return np.stack(np.meshgrid(*[np.arange(n) for n in edges], indexing="ij"), axis=-1).reshape(-1, 3)


def test_every_cell_is_in_one_part() -> None:
    """Parts follow each other in the list of cells, and those with a common node are not apart."""
    cells, limbs = _parts(_box(20, 6, 6))
    assert sorted(limbs.members.tolist()) == list(range(len(cells.nodes)))
    nodes = [
        set(cells.nodes[limbs.members[begin:end]].ravel().tolist())
        for begin, end in zip(limbs.first[:-1], limbs.first[1:], strict=True)
    ]
    assert all(nodes)
    apart = {(a, b) for a in range(len(nodes)) for b in range(a) if not nodes[a] & nodes[b]}
    assert apart
    assert {(max(pair), min(pair)) for pair in limbs.apart.tolist()} == apart


def test_legs_across_a_gap_are_apart() -> None:
    """Two legs within one block of cells are parts of their own; a body that is small in all directions has one."""
    assert len(_parts(_box(4, 4, 4))[1].apart) == 0
    comb = _box(4, 12, 4)
    comb = comb[(comb[:, 1] >= 8) | (comb[:, 0] == 0) | (comb[:, 0] == 3)]
    cells, limbs = _parts(comb)
    leg = [
        cells.places[cells.nodes[limbs.members[begin:end]].ravel()]
        for begin, end in zip(limbs.first[:-1], limbs.first[1:], strict=True)
    ]
    low = [number for number, places in enumerate(leg) if places[:, 1].min() == 0.0]
    assert len(low) == 2
    assert low in limbs.apart.tolist()


def test_a_large_body_has_few_blocks() -> None:
    """As pairs of parts are looked at in every frame."""
    assert len(_parts(_box(40, 20, 20))[1].first) - 1 <= MOST_BLOCKS
