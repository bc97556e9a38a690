"""The question whether a medium is large enough can be answered either way."""

import numpy as np
import pytest

from zoobench.errors import UsageError
from zoobench.spec import Ref
from zoobench.verify.reach import SHIFTS, reach

SMOKE = Ref("smoke")
TASKS = [Ref("movement-speed"), Ref("turning")]


@pytest.mark.slow
def test_a_tank_that_is_too_small_is_found() -> None:
    """A swimmer between walls a centimetre away feels them; one row for each task and controller.

    Within 60 frames: before, and at a coarse grid, the change is still of the size of the noise.
    """
    rows = list(reach([Ref("ocean")], TASKS, fidelity=SMOKE, frames=60, controllers=2, scale=0.55))
    assert [(row.task, row.controller) for row in rows] == [(t.name, n) for t in TASKS for n in (0, 1)]
    assert not all(row.is_enough for row in rows)
    for row in rows:
        assert row.change == pytest.approx(row.score_doubled - row.score, abs=1e-15)
        assert (row.length, row.width) == pytest.approx((0.55 * 0.3125, 0.55 * 0.1875))
        assert row.wall < 0.02
        assert row.particles_doubled > 3.5 * row.particles
        assert row.noise > 0.0
        assert row.seconds_doubled > row.seconds > 0.0


def test_a_bed_that_nothing_reaches_is_enough() -> None:
    """Sand carries no waves: after few frames nothing has come back from walls of any distance."""
    rows = list(reach([Ref("desert")], TASKS, fidelity=SMOKE, frames=5, controllers=1))
    assert all(row.is_enough for row in rows)
    assert all(row.wall > 0.03 for row in rows)


def test_the_shifts_are_within_a_cell() -> None:
    """And all different, the first of them none."""
    shifts = np.array(SHIFTS)
    assert shifts[0].tolist() == [0.0, 0.0]
    assert ((shifts >= 0.0) & (shifts < 1.0)).all()
    assert len({tuple(shift) for shift in SHIFTS}) == len(SHIFTS)


@pytest.mark.parametrize("given", [{"frames": 0}, {"controllers": 0}, {"scale": 0.0}])
def test_what_compares_nothing_is_refused(given: dict[str, float]) -> None:
    """Before anything is simulated."""
    with pytest.raises(UsageError, match="compare nothing"):
        next(reach([Ref("desert")], TASKS, **given))  # type: ignore[arg-type]


def test_bare_ground_has_no_size() -> None:
    """There is no medium to double."""
    with pytest.raises(UsageError, match="no medium"):
        next(reach([Ref("ground")], TASKS))
