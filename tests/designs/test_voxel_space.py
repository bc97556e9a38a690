"""The voxel-based space: particles that share a voxel."""

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree

from zoobench.designs.voxel_space import VoxelSpace
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity

FINE = Fidelity(1 / 160)


def test_particles_of_a_voxel_are_alike() -> None:
    """A box of 8 x 4 x 4 voxels has 128 different particles, each voxel a cube with the given edge."""
    space = VoxelSpace()
    body = space.body(FINE)
    assert space.parameter_count(body) == 128 * 10
    form = space.form(torch.as_tensor(space.initial(np.random.default_rng(0), body)[None]), body)
    values, voxel = np.unique(form.occupancy[0].numpy(), return_inverse=True)
    assert len(values) == 128
    for number in range(128):
        members = voxel == number
        assert np.ptp(body.positions[members], axis=0).max() < 0.0125
        assert np.ptp(form.stiffness[0].numpy()[members]) == 0.0
        assert np.ptp(form.muscle_membership[0].numpy()[members], axis=0).max() == 0.0


def test_left_and_right_voxels_are_mirror_images() -> None:
    """Also if the edge does not divide the box."""
    space = VoxelSpace(edge=0.011)
    body = space.body(FINE)
    rows = np.random.default_rng(1).normal(size=(1, space.parameter_count(body)))
    value = space.form(torch.as_tensor(rows), body).occupancy[0].numpy()
    gap, twin = KDTree(body.positions).query(body.positions * (1, 1, -1))
    assert gap.max() < 1e-9
    # particles share a voxel where their twins do: there are as many pairs of voxels as voxels on either side
    values, voxel = np.unique(value, return_inverse=True)
    pairs = np.unique(np.column_stack([voxel, voxel[twin]]), axis=0)
    assert len(values) > 100
    assert len(pairs) == len(values)


def test_voxels_finer_than_particles_are_particles() -> None:
    """Voxels without particles have no parameters."""
    space = VoxelSpace(edge=0.002)
    body = space.body(Fidelity(1 / 64))
    assert space.parameter_count(body) == body.particle_count * 10


def test_one_voxel_may_hold_all() -> None:
    """The coarsest space has one row of parameters."""
    space = VoxelSpace(edge=0.5)
    assert space.parameter_count(space.body(Fidelity(1 / 64))) == 10


@pytest.mark.parametrize("edge", [0.0, -1.0, 1e-9, 2.0])
def test_edges_that_make_no_voxels_are_refused(edge: float) -> None:
    """With the remedy."""
    with pytest.raises(UsageError, match="Give an edge"):
        VoxelSpace(edge=edge)
