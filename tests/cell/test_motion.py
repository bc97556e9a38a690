"""The motion of a rollout."""

import numpy as np
import pytest
import torch

from tests.conformance.cells import cell
from zoobench.cell.motion import MotionAdjoint, motion_of, with_states
from zoobench.cell.problem import Problem
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Scene


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A robot with two objects ahead."""
    return Problem(cell(environment="ground[object=box,object_count=2]", task="push"))


def _rollout(scene: Scene) -> Rollout:
    """Random numbers for three worlds in three frames."""
    rng, count, muscles = np.random.default_rng(0), scene.elastic.particle_count, scene.robot.muscle_count
    shape = (4, 3, count, 3)
    return Rollout(
        positions=rng.normal(size=shape).astype(np.float32),
        velocities=rng.normal(size=shape).astype(np.float32),
        actuation=rng.normal(size=(3, 3, muscles)),
        tension=np.zeros((3, 3, count)),
        muscle_potential=rng.normal(size=(4, 3, muscles)),
        body={
            "occupancy": rng.uniform(size=(3, count)),
            "density_ratio": rng.uniform(0.9, 1.1, (3, count)),
        },
        divergences={},
        tears={},
        counts=np.ones((3, 3), np.int64),
        retries=np.zeros(3, np.int64),
        guarded=np.zeros(3, np.int64),
        smallest_j=np.ones(3),
        stops=np.zeros((3, 3), bool),
        asleep=np.zeros((3, 3, 0), bool),
        offsets=np.zeros((4, 3, 3)),
    )


def test_a_motion_is_the_chosen_worlds_in_double_precision(problem: Problem) -> None:
    """Trajectory, labels and work of these worlds; leaves only if a gradient is needed."""
    body, rollout, robot = problem.body, _rollout(problem.scene), problem.scene.slice_of("robot")
    existing = rollout.body["occupancy"][:, robot]
    masses = problem.density * rollout.body["density_ratio"][:, robot] * existing * body.volumes
    motion = motion_of(rollout, body, problem.scene, slice(1, 3), gradient=True)
    np.testing.assert_array_equal(motion.positions.detach().numpy(), rollout.positions[:, 1:, robot])
    np.testing.assert_array_equal(motion.velocities.detach().numpy(), rollout.velocities[:, 1:, robot])
    np.testing.assert_array_equal(motion.masses.detach().numpy(), masses[1:])
    np.testing.assert_array_equal(motion.existing.detach().numpy(), existing[1:])
    np.testing.assert_array_equal(motion.head.numpy(), body.head)
    np.testing.assert_array_equal(motion.tail.numpy(), body.tail)
    np.testing.assert_array_equal(motion.rest.numpy(), body.positions)
    expected = -rollout.actuation[:, 1:] * np.diff(rollout.muscle_potential[:, 1:], axis=0)
    np.testing.assert_array_equal(motion.muscle_work.detach().numpy(), expected)
    assert str(motion.positions.dtype) == str(motion.muscle_work.dtype) == "torch.float64"
    assert motion.positions.requires_grad
    assert motion.muscle_work.requires_grad
    assert not motion_of(rollout, body, problem.scene, slice(0, 1)).positions.requires_grad


def test_objects_are_found_by_name(problem: Problem) -> None:
    """The same worlds, with their own masses, of which the environment gives the sum; the first is the task's."""
    rollout, scene = _rollout(problem.scene), problem.scene
    motion = motion_of(rollout, problem.body, scene, slice(1, 3), gradient=True)
    assert list(motion.objects) == ["object", "object-1"]
    assert motion.object is motion.objects["object"]
    for each in scene.objects:
        found, own = motion.objects[each.name], scene.slice_of(each.name)
        np.testing.assert_array_equal(found.positions.detach().numpy(), rollout.positions[:, 1:, own])
        np.testing.assert_array_equal(found.velocities.detach().numpy(), rollout.velocities[:, 1:, own])
        np.testing.assert_array_equal(found.rest.numpy(), each.body.positions)
        assert found.masses.sum().item() == pytest.approx(0.08)
        assert found.positions.requires_grad


def test_states_of_all_particles_are_shared_out(problem: Problem) -> None:
    """To the robot and to every object; what does not change stays."""
    rollout, scene = _rollout(problem.scene), problem.scene
    motion = motion_of(rollout, problem.body, scene, slice(0, 1))
    states = [torch.as_tensor(each[:2, 1:2].astype(np.float64)) for each in (rollout.positions, rollout.velocities)]
    other = with_states(motion, *states)
    again = motion_of(rollout, problem.body, scene, slice(1, 2))
    for one, two in zip((other, *other.objects.values()), (again, *again.objects.values()), strict=True):
        assert torch.equal(one.positions, two.positions[:2])
        assert torch.equal(one.velocities, two.velocities[:2])
    assert torch.equal(other.masses, motion.masses)


def test_an_adjoint_has_a_part_for_every_particle(problem: Problem) -> None:
    """In the order of the scene's; nothing where the scalar does not depend on it."""
    rollout, scene = _rollout(problem.scene), problem.scene
    motion = motion_of(rollout, problem.body, scene, slice(0, 2), gradient=True)
    far = motion.objects["object-1"]
    value = 2.0 * motion.positions[-1].sum() + 3.0 * far.positions[1, :, :, 0].sum() - far.velocities[0].sum()
    adjoint = MotionAdjoint.of(value, motion)
    expected = np.zeros((2, 4, 2, scene.elastic.particle_count, 3))
    expected[0, -1, :, scene.slice_of("robot")] = 2.0
    expected[0, 1, :, scene.slice_of("object-1"), 0] = 3.0
    expected[1, 0, :, scene.slice_of("object-1")] = -1.0
    np.testing.assert_array_equal(adjoint.positions, expected[0])
    np.testing.assert_array_equal(adjoint.velocities, expected[1])
    assert adjoint.masses.shape == adjoint.occupancy.shape == (2, scene.robot.particle_count)
    assert adjoint.muscle_work.shape == motion.muscle_work.shape
    assert not adjoint.muscle_work.any()


def test_the_adjoint_of_the_work_joins_the_worlds(problem: Problem) -> None:
    """Of every frame, world and muscle, in the order of the worlds."""
    rollout, scene = _rollout(problem.scene), problem.scene
    weights = np.random.default_rng(1).normal(size=rollout.muscle_work.shape)
    parts = []
    for world in range(3):
        motion = motion_of(rollout, problem.body, scene, slice(world, world + 1), gradient=True)
        value = (motion.muscle_work * torch.as_tensor(weights[:, world : world + 1])).sum()
        parts.append(MotionAdjoint.of(value, motion))
    np.testing.assert_array_equal(MotionAdjoint.joined(parts).muscle_work, weights)
