"""The motion of a rollout."""

import numpy as np

from tests.conformance.cells import cell
from zoobench.cell.motion import motion_of
from zoobench.cell.problem import Problem
from zoobench.sim.model.rollout import Rollout


def test_a_motion_is_the_chosen_worlds_in_double_precision() -> None:
    """Trajectory, labels and work of these worlds; leaves only if a gradient is needed."""
    body = Problem(cell()).body
    rng = np.random.default_rng(0)
    shape = (4, 3, body.particle_count, 3)
    rollout = Rollout(
        positions=rng.normal(size=shape).astype(np.float32),
        velocities=rng.normal(size=shape).astype(np.float32),
        actuation=rng.normal(size=(3, 3, body.muscle_count)),
        tension=np.zeros((3, 3, body.particle_count)),
        muscle_potential=rng.normal(size=(4, 3, body.muscle_count)),
        body={
            "occupancy": rng.uniform(size=(3, body.particle_count)),
            "density_ratio": rng.uniform(0.9, 1.1, (3, body.particle_count)),
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
    masses = 1000.0 * rollout.body["density_ratio"] * rollout.body["occupancy"] * body.volumes
    motion = motion_of(rollout, body, 1000.0, slice(1, 3), gradient=True)
    np.testing.assert_array_equal(motion.positions.detach().numpy(), rollout.positions[:, 1:])
    np.testing.assert_array_equal(motion.velocities.detach().numpy(), rollout.velocities[:, 1:])
    np.testing.assert_array_equal(motion.masses.detach().numpy(), masses[1:])
    np.testing.assert_array_equal(motion.existing.detach().numpy(), rollout.body["occupancy"][1:])
    np.testing.assert_array_equal(motion.head.numpy(), body.head)
    np.testing.assert_array_equal(motion.tail.numpy(), body.tail)
    np.testing.assert_array_equal(motion.rest.numpy(), body.positions)
    expected = -rollout.actuation[:, 1:] * np.diff(rollout.muscle_potential[:, 1:], axis=0)
    np.testing.assert_array_equal(motion.muscle_work.numpy(), expected)
    assert str(motion.positions.dtype) == str(motion.muscle_work.dtype) == "torch.float64"
    assert motion.positions.requires_grad
    assert not motion_of(rollout, body, 1000.0, slice(0, 1)).positions.requires_grad
