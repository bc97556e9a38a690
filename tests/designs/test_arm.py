"""The arm."""

import numpy as np
import pytest

from zoobench import registry
from zoobench.designs.arm import Arm
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref


def test_its_base_is_held_and_its_muscles_run_along_the_rest() -> None:
    """The box of the anchor is that of the base; no muscle is in it, and every quarter of a row has equal volume."""
    body = Arm(rows=3).body(Fidelity(1 / 64))
    (anchor,) = body.anchor(np.zeros(3))
    assert body.anchored is not None
    assert anchor[0][1] == pytest.approx(0.03 + 0.125, abs=body.edge)
    assert not body.muscle_membership[body.anchored].any()
    volumes = body.volumes @ body.muscle_membership
    np.testing.assert_allclose(volumes[0::4], volumes[3::4], rtol=1e-9)
    assert len(body.muscles) == 12
    assert body.positions[body.head, 1].max() < body.positions[body.tail, 1].min()


@pytest.mark.parametrize("given", [{"rows": 0}, {"clearance": -1.0}, {"length": 0.0}])
def test_impossible_arms_are_refused(given: dict[str, float]) -> None:
    """Before any body is made."""
    with pytest.raises(UsageError):
        Arm(**given)  # type: ignore[arg-type]


def test_an_arm_that_hangs_too_high_is_told_how_high() -> None:
    """It is small enough itself."""
    grid = Fidelity(1 / 64)
    with pytest.raises(SceneError, match=r"5 m above the floor.*less clearance"):
        registry.create(Kind.ENV, Ref("ground")).scene(Arm(clearance=5.0).body(grid), grid)
