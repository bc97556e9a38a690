"""Feasibility: pieces and thickness against scipy.ndimage, the constraint, and the messages."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from scipy import ndimage

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.block import Block
from zoobench.designs.feasibility import feasible
from zoobench.designs.space import Form
from zoobench.sim.model.fidelity import Fidelity

SHAPE = (13, 7, 9)
Grid = NDArray[np.int64]


@cache
def box(particles_per_cell: int = 1) -> tuple[Body, Grid]:
    """A block of 13 x 7 x 9 cells, and each particle's cell `[particle_count, 3]`."""
    h = 0.01
    body = Block(length=13 * h, height=7 * h, width=9 * h).body(Fidelity(h, particles_per_cell=particles_per_cell))
    low = np.array([-6.5, 0.0, -4.5]) * h
    return body, np.floor((body.positions - low) / h + 1e-6).astype(int)


def form_of(occupancy: Array) -> Form:
    """A form with this occupancy `[worlds, particle_count]`."""
    worlds, count = occupancy.shape
    full = torch.tensor(occupancy, requires_grad=True)
    ones = torch.ones(worlds, count, dtype=torch.float64)
    return Form(full, ones, ones[..., None], torch.eye(3, dtype=torch.float64)[0].expand(worlds, count, 3))


def filled(*places: tuple[slice | int, slice | int, slice | int], particles_per_cell: int = 1) -> Array:
    """Occupancy 1 in these cells and 0 elsewhere `[1, particle_count]`."""
    grid = np.zeros(SHAPE)
    for place in places:
        grid[place] = 1.0
    return np.array([grid[tuple(box(particles_per_cell)[1].T)]])


EVERY = slice(None)


@pytest.mark.parametrize("share", [0.7, 0.8, 0.9])
def test_pieces_and_thickness_are_those_of_scipy(share: float) -> None:
    """On random matter: labels over faces and edges of what cubes of two open, and the largest cube by erosion."""
    body, cells = box()
    solid = np.random.default_rng(0).random((5, *SHAPE)) < share
    occupancy = solid[:, cells[:, 0], cells[:, 1], cells[:, 2]] * 0.9
    built, reports = feasible(form_of(occupancy), body, connected=True)
    for world, report in enumerate(reports):
        thick = ndimage.binary_opening(solid[world], np.ones((2, 2, 2)))
        labels, count = ndimage.label(thick, ndimage.generate_binary_structure(3, 2))
        sizes = np.bincount(labels.ravel())[1:]
        assert report.components == count
        assert report.mass_kept == pytest.approx(sizes.max() / sizes.sum())
        kept = built.occupancy[world].detach().numpy() > 0.0
        assert kept.sum() == sizes.max()
        (label,) = np.unique(labels[tuple(cells[kept].T)])
        largest = max(
            n for n in range(2, 8) if n == 2 or ndimage.binary_erosion(labels == label, np.ones([n] * 3)).any()
        )
        assert report.thickness == largest


@pytest.mark.parametrize(("particles_per_cell", "thickness"), [(1, 3), (8, 6), (27, 9)])
def test_thickness_counts_particles(particles_per_cell: int, thickness: int) -> None:
    """A plate of three cells on every cubic lattice."""
    occupancy = filled((EVERY, slice(2, 5), EVERY), particles_per_cell=particles_per_cell)
    _, (report,) = feasible(form_of(occupancy), box(particles_per_cell)[0], connected=True)
    assert (report.components, report.mass_kept, report.thickness, report.fault) == (1, 1.0, thickness, "")


def test_a_face_centred_lattice_has_pieces_and_thickness_too() -> None:
    """Two bodies of two cells each, one cell apart."""
    body, _ = box(4)
    occupancy = filled((slice(0, 4), EVERY, EVERY), (slice(5, 13), EVERY, EVERY), particles_per_cell=4)
    _, (report,) = feasible(form_of(occupancy), body, connected=True)
    assert (report.components, report.fault) == (2, "")
    assert report.mass_kept == pytest.approx(8 / 12, rel=0.005)  # the faces cut through cells of the lattice
    assert report.thickness >= 4


def test_only_the_largest_piece_is_built() -> None:
    """The other is emptied; soft neighbours and all other gradients are unchanged."""
    body, cells = box()
    occupancy = np.full((1, body.particle_count), 0.3)
    occupancy[0, cells[:, 0] < 3] = 0.8
    occupancy[0, cells[:, 0] > 8] = 0.9
    form = form_of(occupancy)
    built, (report,) = feasible(form, body, connected=True)
    small = cells[:, 0] < 3
    np.testing.assert_array_equal(built.occupancy.detach().numpy(), np.where(small, 0.0, occupancy))
    (gradient,) = torch.autograd.grad(built.occupancy.sum(), form.occupancy)
    np.testing.assert_array_equal(gradient.numpy(), ~small[None])
    assert report.components == 2
    assert report.mass_kept == pytest.approx(4 * 0.9 / (4 * 0.9 + 3 * 0.8))
    assert built.stiffness is form.stiffness


def test_without_the_constraint_all_pieces_stay() -> None:
    """They are reported, and the form is unchanged."""
    form = form_of(filled((slice(0, 3), EVERY, EVERY), (slice(6, 13), EVERY, EVERY)))
    built, (report,) = feasible(form, box()[0], connected=False)
    assert torch.equal(built.occupancy, form.occupancy)
    assert (report.components, report.fault) == (2, "")


@pytest.mark.parametrize("connected", [True, False])
def test_what_is_thin_is_not_built(connected: bool) -> None:
    """A thread between two blocks and a fin on one of them go; the blocks, two pieces then, stay as they are."""
    blocks = ((slice(0, 4), EVERY, EVERY), (slice(8, 13), EVERY, EVERY))
    threaded = filled(*blocks, (slice(4, 8), 3, 4), (slice(5, 8), EVERY, 2))
    built, (report,) = feasible(form_of(threaded), box()[0], connected=connected)
    assert (report.components, report.fault) == (2, "")
    expected = filled(*blocks[1:] if connected else blocks)
    np.testing.assert_array_equal(built.occupancy.detach().numpy(), expected)


def test_mass_decides_which_piece_is_the_largest() -> None:
    """A dense piece of fewer particles is kept."""
    body, cells = box()
    dense = replace(body, density_ratio=np.where(cells[:, 0] < 3, 5.0, 1.0))
    form = form_of(filled((slice(0, 3), EVERY, EVERY), (slice(6, 13), EVERY, EVERY)))
    built, (report,) = feasible(form, dense, connected=True)
    assert built.occupancy.detach().numpy()[0, cells[:, 0] > 5].sum() == 0.0
    assert report.mass_kept == pytest.approx(15 / 22)


def test_of_equal_pieces_the_first_is_kept() -> None:
    """Also if their masses differ by rounding."""
    body, cells = box()
    occupancy = filled((slice(0, 4), EVERY, EVERY), (slice(9, 13), EVERY, EVERY))
    occupancy[0, cells[:, 0] > 8] *= 1.0 - 1e-13
    for twin in (occupancy, occupancy[:, ::-1].copy()):
        built, _ = feasible(form_of(twin), body, connected=True)
        kept = np.flatnonzero(built.occupancy.detach().numpy()[0])
        assert kept[0] == np.flatnonzero(twin[0])[0]
        assert len(kept) == 4 * 7 * 9


def test_nothing_is_a_fault_that_explains_itself() -> None:
    """No particle is more than half occupied; the other world is unaffected."""
    occupancy = np.vstack([np.full(box()[0].particle_count, 0.5), filled((EVERY, EVERY, EVERY))])
    built, (empty, whole) = feasible(form_of(occupancy), box()[0], connected=True)
    assert (empty.components, empty.mass_kept, empty.thickness) == (0, 0.0, 0)
    assert "no particle is more than half occupied, the fullest is 0.5" in empty.fault
    assert not whole.fault
    np.testing.assert_array_equal(built.occupancy.detach().numpy(), occupancy)


@pytest.mark.parametrize("place", [(EVERY, 3, EVERY), (EVERY, 3, 3), (6, 3, 3)], ids=["sheet", "thread", "speck"])
def test_what_is_one_particle_thin_is_a_fault(place: tuple[slice | int, slice | int, slice | int]) -> None:
    """The message has the thickness found and needed."""
    _, (report,) = feasible(form_of(filled(place)), box()[0], connected=True)
    assert report.thickness == 1
    assert "it is 1 particle of 10 mm across at its thickest, and 2 are needed" in report.fault


def test_a_body_of_few_particles_has_a_report() -> None:
    """One particle, and workspaces that are sheets or threads."""
    for count in (1, 2, 9):
        block = Block(length=0.01 * count, width=0.01, height=0.01)
        body = block.body(Fidelity(0.01, particles_per_cell=1))
        assert body.particle_count == count
        _, (report,) = feasible(form_of(np.ones((1, count))), body, connected=True)
        assert (report.components, report.thickness) == (0, 1)
        assert "too thin" in report.fault
