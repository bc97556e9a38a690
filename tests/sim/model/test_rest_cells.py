"""Cells and nodes of bodies in their rest frame."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tests.sim import scenes
from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.sim.model.elastic_bodies import ElasticBody
from zoobench.sim.model.lattice import fill_box
from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.sim.model.rest_cells import WEAKEST, RestCells


def _body(cubes: Array) -> ElasticBody:
    """A passive body of the cubes with these indices."""
    positions = (np.asarray(cubes) + 0.5) * scenes.EDGE + 0.25
    return ElasticBody.passive(scenes.SOFT, positions, np.full(len(positions), scenes.EDGE**3))


def _block(*size: int) -> Array:
    """Indices of the cubes of a block."""
    return np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), axis=-1).reshape(-1, 3)


def test_a_block_has_the_cells_and_nodes_of_its_grid() -> None:
    """Four cubes along each axis are two cells, and three nodes."""
    cells = RestCells.of(_body(_block(4, 4, 4)), scenes.fidelity())
    assert len(cells.nodes) == 8
    assert len(cells.places) == 27
    assert len(cells.slopes) == 1
    assert sorted(cells.particles.ravel().tolist()) == list(range(64))


def test_a_linear_field_has_its_gradient_and_its_values() -> None:
    """Of places that are moved by an affine map, gradients, the map to F and weights give it back in every cell, full
    or not."""
    rng = np.random.default_rng(0)
    body = _body(_block(5, 3, 4)[rng.permutation(60)[:45]])
    offsets = rng.uniform(-0.2, 0.2, (45, 3)) * scenes.EDGE
    body = replace(body, positions=body.positions - offsets, site_offsets=offsets)
    cells = RestCells.of(body, scenes.fidelity())
    turn, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    moved = (cells.places @ turn.T + shift)[cells.nodes]
    has = cells.particles >= 0
    found = np.einsum("cir,cikl->clrk", moved, cells.slopes[cells.shape])
    assert np.abs(found[has] - turn).max() <= 1e-12
    mapped = (cells.places @ turn.T).T @ cells.deformation_map()
    np.testing.assert_allclose(mapped.reshape(3, 45, 3), np.broadcast_to(turn[:, None], (3, 45, 3)), atol=1e-12)
    there = np.einsum("cil,cir->clr", cells.weights, moved)
    expected = body.positions @ turn.T + shift
    assert np.abs(there[has] - expected[cells.particles[has]]).max() <= 1e-12


def test_what_nodes_have_of_particles_has_its_sum_and_its_centre() -> None:
    """Of a block of one and a half cells, whose density differs from particle to particle."""
    body = _body(_block(3, 2, 2))
    masses = np.random.default_rng(1).uniform(0.5, 1.5, body.particle_count)
    cells = RestCells.of(body, scenes.fidelity())
    found = cells.on_nodes(masses)
    assert found.sum() == pytest.approx(masses.sum(), rel=1e-12)
    assert found @ cells.places == pytest.approx(masses @ body.positions, rel=1e-12)


def _rod(length: int, thick: int, fill: float, poissons_ratio: float) -> ElasticBody:
    """A rod four cubes wide, of whose uppermost cubes a share is filled."""
    body = _body(_block(length, thick, 4))
    outer = body.positions[:, 1] > body.positions[:, 1].max() - 0.5 * scenes.EDGE
    offsets = outer[:, None] * (0.0, 0.5 * (1.0 - fill) * scenes.EDGE, 0.0)
    volumes = np.where(outer, fill, 1.0) * body.volumes
    material = replace(body.material, poissons_ratio=poissons_ratio)
    return replace(body, positions=body.positions - offsets, site_offsets=offsets, volumes=volumes, material=material)


def _curvature(thick: int, fill: float, poissons_ratio: float) -> float:
    """Of a rod that is bent by a moment, by a beam's: E I / M [-].

    Of two lengths the difference, as loads are none of a beam's near the ends.
    """
    short, long = (_bending_compliance(_rod(length, thick, fill, poissons_ratio)) for length in (8, 12))
    moment_of_area = (thick - 1 + fill) ** 3 * 4 * scenes.EDGE**4 / 12.0
    return (long - short) * moment_of_area / (4 * scenes.EDGE)


@pytest.mark.parametrize(
    ("thick", "fill", "known"),
    [
        (1, 1.0, 0.005),
        (2, 1.0, 0.005),
        (3, 1.0, 0.011),
        (4, 1.0, 0.005),
        (2, 0.5, 0.102),
        (3, 0.5, 0.03),
        (4, 0.5, 0.011),
    ],
)
def test_a_rod_bends_as_beams_do(thick: int, fill: float, known: float) -> None:
    """Of half a cell to two cells: of full cubes 1.00, 1.00, 0.99 and 1.00, with strain at the cubes' sites 0.80, 0.90,
    0.96 and 0.97. Cubes that are filled in half count whole."""
    assert _curvature(thick, fill, 0.2) == pytest.approx(1.0, abs=known)


@pytest.mark.parametrize("thick", [1, 2, 3, 4])
def test_a_rod_that_hardly_changes_its_volume_does_not_go_limp(thick: int) -> None:
    """With a Poisson's ratio of 0.49 it bends by 1.23, 1.00, 0.95 and 0.88 of what a beam does."""
    assert 0.87 < _curvature(thick, 1.0, 0.49) < 1.24


def test_a_body_of_unequal_volumes_has_mirrored_slopes() -> None:
    """What is symmetric stays so."""
    cubes = _block(3, 3, 4)
    volumes = np.random.default_rng(1).uniform(0.2, 1.0, (3, 3, 2))
    body = _body(cubes)
    body = replace(body, volumes=np.concatenate([volumes, volumes[:, :, ::-1]], axis=2).ravel() * body.volumes)
    cells = RestCells.of(body, scenes.fidelity())
    found = {
        int(p): cells.slopes[cells.shape[c], :, :, lane] for (c, lane), p in np.ndenumerate(cells.particles) if p >= 0
    }
    flipped = [1, 0, 3, 2, 5, 4, 7, 6]  # nodes, of which the last index is that along z
    for p, (x, y, z) in enumerate(cubes.tolist()):
        twin = found[int(np.flatnonzero((cubes == (x, y, 3 - z)).all(axis=1))[0])]
        np.testing.assert_allclose(found[p], twin[flipped] * (1.0, 1.0, -1.0), rtol=1e-12)


def _bending_compliance(body: ElasticBody) -> float:
    """Angle between the ends per moment, of a free rod along x with E = 1 that is bent in the plane of x and y
    [1/Pa/m^3]."""
    cells = RestCells.of(body, scenes.fidelity())
    mu, lam = lame_parameters(1.0, body.material.poissons_ratio)
    count = 3 * len(cells.places)
    stiffness = np.zeros((count, count))
    for nodes, shape, particles in zip(cells.nodes, cells.shape, cells.particles, strict=True):
        own = (3 * nodes[:, None] + np.arange(3)).ravel()
        for lane in np.flatnonzero(particles >= 0):
            g = cells.slopes[shape, :, :, lane]
            gradient = np.einsum("il,rk->rlik", g, np.eye(3)).reshape(9, 24)  # row r, column l of the gradient
            strain = (gradient + gradient.reshape(3, 3, 24).transpose(1, 0, 2).reshape(9, 24)) / 2
            trace = gradient[[0, 4, 8]].sum(axis=0)
            volume = body.volumes[particles[lane]]
            stiffness[np.ix_(own, own)] += volume * (2.0 * mu * strain.T @ strain + lam * np.outer(trace, trace))
    along = cells.places[:, 0]
    force = np.zeros((len(along), 3))
    for end, sign in ((along.min(), 1.0), (along.max(), -1.0)):
        at = np.flatnonzero(np.abs(along - end) < 1e-9)
        arm = cells.places[at, 1] - cells.places[at, 1].mean()
        force[at, 0] = sign * arm / (arm @ arm)
    return float(force.ravel() @ np.linalg.pinv(stiffness, rcond=1e-10) @ force.ravel())


def test_limbs_across_a_gap_have_nodes_of_their_own() -> None:
    """Two legs below a belly share the belly's nodes alone; without the belly they share none."""
    leg, up, aside = _block(1, 2, 2), np.array([0, 2, 0]), np.array([2, 0, 0])
    belly, legs = _block(3, 2, 2) + up, np.concatenate([leg, leg + aside])
    joined = RestCells.of(_body(np.concatenate([belly, legs])), scenes.fidelity())
    apart = RestCells.of(_body(legs), scenes.fidelity())
    assert len(apart.places) == 16
    low = joined.places[:, 1] < joined.places[:, 1].mean() - 1e-9
    assert low.sum() == 8, "the nodes between the legs are not one"


def test_cubes_that_touch_at_a_corner_hold_together() -> None:
    """Thin parts that run askew through the lattice do not fall apart."""
    cells = RestCells.of(_body(np.array([[0, 0, 0], [1, 1, 1], [2, 2, 2]])), scenes.fidelity())
    assert len(cells.places) == 15


def test_few_particles_join_the_cell_beside_them() -> None:
    """They move with the nodes of the neighbour with which they share most, and have no nodes of their own."""
    body = _body(np.concatenate([_block(2, 2, 2), [[2, 0, 0], [3, 0, 0]]]))
    cells = RestCells.of(body, scenes.fidelity())
    of = _nodes_of_particles(cells)
    assert of[8] == of[9] == of[0]
    assert len(cells.places) == 8
    at = cells.weights.transpose(0, 2, 1) @ cells.places[cells.nodes]
    has = cells.particles >= 0
    assert np.abs(at[has] - body.positions[cells.particles[has]]).max() <= 1e-12


def test_few_particles_that_hold_others_together_stay_where_they_are() -> None:
    """A spike over two cells does not lose its tip, nor a body with a narrow waist its tail. Weak points hold their
    nodes, too."""
    ahead = np.array([2, 0, 0])
    spike = RestCells.of(_body(np.concatenate([_block(2, 2, 2), _block(3, 1, 1) + ahead])), scenes.fidelity())
    of = _nodes_of_particles(spike)
    assert len(of[0] & of[8]) == len(of[9] & of[10]) == 4
    assert (spike.particles <= WEAKEST).sum() == 6 + 7
    for cells in (1, 2, 3):
        waist, tail = _block(2 * cells, 1, 1) + ahead, _block(2, 2, 2) + (cells + 1) * ahead
        of = _nodes_of_particles(RestCells.of(_body(np.concatenate([_block(2, 2, 2), waist, tail])), scenes.fidelity()))
        chain = [0, *range(8, 8 + 2 * cells, 2), 8 + 2 * cells]
        assert [len(of[one] & of[other]) for one, other in pairwise(chain)] == [4] * (cells + 1)


def _nodes_of_particles(cells: RestCells) -> dict[int, set[int]]:
    """The nodes of every particle's cell."""
    return {p: set(cells.nodes[c].tolist()) for c in range(len(cells.nodes)) for p in cells.particles[c].tolist()}


def test_a_layer_of_particles_holds_the_nodes_of_a_cell() -> None:
    """Fewer of 27 do not, as four in a row along an edge, about which the nodes beyond them would swing."""
    fine = replace(scenes.fidelity(), particles_per_cell=27)
    edge = fine.particle_edge

    def found(*beyond: tuple[int, int, int]) -> int:
        positions = (np.concatenate([_block(3, 3, 3), np.array(beyond)]) + 0.5) * edge
        body = ElasticBody.passive(scenes.SOFT, positions, np.full(len(positions), edge**3))
        return len(RestCells.of(body, fine).places)

    body = _body(np.array([[x, y, z] for x in range(2) for y in range(2) for z in range(2)]))
    alone = ElasticBody.passive(scenes.SOFT, (body.positions - 0.25) * edge / scenes.EDGE, body.volumes)
    assert (RestCells.of(alone, fine).particles <= WEAKEST).any(axis=1).all()
    layer = [(3, y, z) for y in range(3) for z in range(3)]
    assert found(*layer[:8]) == 8
    assert found(*layer) == 12


def test_twenty_seven_particles_a_cell_are_four_groups() -> None:
    """Groups of a cell have the same eight nodes, and lanes without a particle repeat one that is there."""
    fine = replace(scenes.fidelity(), particles_per_cell=27)
    positions = fill_box(np.zeros(3), np.full(3, scenes.SPACING), scenes.SPACING, 27)
    body = ElasticBody.passive(scenes.SOFT, positions, np.full(27, fine.particle_edge**3))
    cells = RestCells.of(body, fine)
    assert cells.nodes.shape == (4, 8)
    assert (cells.nodes == cells.nodes[0]).all()
    assert (cells.particles < 0).sum() == 5
    assert np.isfinite(cells.slopes).all()


def test_particles_of_no_lattice_are_refused() -> None:
    """With what to choose instead."""
    body = _body(_block(2, 2, 2))
    with pytest.raises(UsageError, match="robot=mpm"):
        RestCells.of(replace(body, positions=body.positions * 1.3), scenes.fidelity())
