"""The gripper."""

import numpy as np
import pytest

from zoobench.designs.gripper import Gripper
from zoobench.errors import UsageError
from zoobench.sim.model.fidelity import Fidelity


@pytest.mark.parametrize("fingers", [2, 3, 4])
def test_its_fingers_leave_the_opening_free(fingers: int) -> None:
    """No matter below the base is nearer to the axis than half the opening, and every finger has four muscles."""
    body = Gripper(fingers=fingers).body(Fidelity(1 / 64))
    assert body.anchored is not None
    free = body.positions[~body.anchored]
    assert np.hypot(free[:, 0], free[:, 2]).min() > 0.035 - body.edge / 2
    assert body.muscle_count == 4 * fingers
    assert body.muscle_membership[body.anchored].sum(axis=1).max() < 0.5
    volumes = (body.volumes @ body.muscle_membership).reshape(fingers, 4)
    np.testing.assert_allclose(volumes.sum(axis=1), volumes.sum() / fingers, rtol=0.05)


@pytest.mark.parametrize("given", [{"fingers": 5}, {"opening": 0.0}, {"fingers": 4, "opening": 0.02}])
def test_impossible_grippers_are_refused(given: dict[str, float]) -> None:
    """Before any body is made."""
    with pytest.raises(UsageError):
        Gripper(**given)  # type: ignore[arg-type]
