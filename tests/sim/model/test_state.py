"""Tensors of a simulation: shapes, slots and the state at time zero."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.sim import scenes
from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.sim.model.scene import MediumBed
from zoobench.sim.model.state import BodyState, Matter, Parameters, initial_matter


@pytest.mark.parametrize(
    ("name", "strained", "with_history"), [("ground", 0, 0), ("sand", 784, 784), ("water", 0, 784)]
)
def test_a_scene_has_the_tensors_of_its_medium(name: str, strained: int, with_history: int) -> None:
    """None without a medium; a fluid without shear strength has neither b nor stress."""
    matter = initial_matter(scenes.SCENES[name](), 2, np.zeros(3), torch.float64, "cpu")
    assert matter.b.shape[:3] == matter.tau.shape[:3] == (1, 2, strained)
    assert matter.history.shape == (1, 2, with_history)
    assert (matter.history == (name == "water")).all()


def test_medium_starts_with_its_velocity() -> None:
    """A bed that moves does so from time zero; one without velocities rests."""
    scene = scenes.medium_scene()
    assert scene.medium is not None
    given = np.random.default_rng(1).normal(size=(784, 3))
    moving = replace(scene, medium=replace(scene.medium, velocities=given))
    assert not initial_matter(scene, 1, np.zeros(3), torch.float64, "cpu").v[0, 0, 216:].any()
    assert np.array_equal(initial_matter(moving, 2, np.zeros(3), torch.float64, "cpu").v[0, 1, 216:].numpy(), given)


def test_initial_state_is_that_of_the_scene() -> None:
    """Positions from the grid's first node, F = I, and sand with the stress of its initial strain."""
    scene = scenes.medium_scene()
    bed = scenes.medium_bed()
    strains = np.tile([-0.01, -0.02, -0.03], (bed.particle_count, 1))
    scene = replace(scene, medium=MediumBed.at_rest(scenes.SAND, bed.positions, bed.volumes, strains))
    origin = np.array([-0.1, -0.2, -0.3])
    matter = initial_matter(scene, 2, origin, torch.float64, "cpu")
    assert np.allclose(matter.x[0, 1, :216].numpy() + origin, scene.robot.positions, rtol=1e-15)
    assert np.array_equal(matter.F[0, 1].numpy(), np.tile(np.eye(3), (216, 1, 1)))
    mu, lam = lame_parameters(1e5, 0.2)
    expected = [2 * mu * -0.01 - 0.06 * lam, 2 * mu * -0.02 - 0.06 * lam, 2 * mu * -0.03 - 0.06 * lam, 0, 0, 0]
    assert matter.tau[0, 0, 5].tolist() == pytest.approx(expected)
    assert matter.b[0, 0, 5].tolist() == pytest.approx([*np.exp([-0.02, -0.04, -0.06]), 0, 0, 0])


def test_slots_are_copied_out_and_in() -> None:
    """A checkpoint is a copy: later changes do not reach it, and it is restored unchanged."""
    matter = Matter.zeros(3, 2, 4, 5, True, torch.float64, "cpu")
    for tensor in matter.tensors():
        tensor[1] = 7
    saved = matter.copy_slot(1)
    for tensor in matter.tensors():
        tensor.fill_(9)
    matter.load_slot(2, saved)
    assert all((tensor[2] == 7).all() and (tensor[1] == 9).all() for tensor in matter.tensors())


def test_bytes_of_a_slot_are_those_of_its_tensors() -> None:
    """8 rows of four numbers per particle, 9 where there is a solid medium, and the window."""
    solid = Matter.zeros(3, 2, 4, 5, True, torch.float32, "cpu")
    assert solid.bytes_per_slot() == 2 * (4 * 4 * 9 * 9 + 4 * 8)
    fluid = Matter.zeros(3, 2, 4, 5, False, torch.float32, "cpu")
    assert fluid.bytes_per_slot() == 2 * (4 * 4 * 9 * 8 + 4 * 8)


@pytest.mark.parametrize("solid", [False, True])
def test_views_of_the_packed_state_do_not_overlap(solid: bool) -> None:
    """Each holds what was written into it after all others were; a fluid has no strain, and nothing else is
    written."""
    matter = Matter.zeros(2, 2, 3, 4, solid, torch.float64, "cpu")
    names = ("x", "v", "C", "F", "history", *(("b", "tau") if solid else ()))
    rng = np.random.default_rng(1)
    written = {name: torch.as_tensor(rng.uniform(1, 2, getattr(matter, name).shape)) for name in names}
    for name, values in written.items():
        getattr(matter, name)[:] = values
    assert all(torch.equal(getattr(matter, name), values) for name, values in written.items())
    assert int((matter.state != 0).sum()) == sum(values.numel() for values in written.values())
    assert matter.F.shape == (2, 2, 3, 3, 3)
    body = Parameters.zeros(2, 3, 7, torch.float64, "cpu")
    for value, view in enumerate((body.mass, body.volume, body.stiffness, body.tension, body.fibre), start=1):
        view[:] = value
    assert body.body[1, 0].tolist() == [[1, 2, 3, 4], [5, 5, 5, 0]]
    assert body.body[1, 3].tolist() == [[1, 2, 0, 0], [0, 0, 0, 0]]


def test_body_state_fills_in_what_is_not_given() -> None:
    """Arrays not given are the robot's, once per world."""
    scene = scenes.ground_scene()
    arrays = BodyState(stiffness=np.full((2, 216), 0.3)).filled(scene, 2)
    assert set(arrays) == {"stiffness", "density_ratio", "occupancy", "muscle_membership", "fibres"}
    assert (arrays["stiffness"] == 0.3).all()
    assert np.array_equal(arrays["fibres"][1], scene.robot.fibres)
