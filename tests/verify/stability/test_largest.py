"""The study of the largest stable step."""

import pytest

from zoobench_verify.stability import largest


def test_bisection_finds_the_edge() -> None:
    """To half a per cent, from the stable side; the ends of the range where the edge lies beyond."""
    found = largest._bisect(lambda share: share < 1.7)
    assert 1.7 * (1 - 0.006) <= found < 1.7
    assert largest._bisect(lambda share: False) == 0.5
    assert largest._bisect(lambda share: True) == pytest.approx(4.0, rel=0.006)


@pytest.mark.slow
def test_prediction_of_isolated_particles_is_sharp() -> None:
    """For three Poisson's ratios the largest stable step is the predicted one to 1 %, for a spray not less."""
    rows = [row for row, _ in zip(largest.largest_steps(), range(4), strict=False)]
    assert [row.case for row in rows][-1] == "spray"
    assert all(row.verdict == "pass" for row in rows)
    assert all(abs(row.ratio - 1.0) <= 0.01 for row in rows[:3])


@pytest.mark.slow
def test_prediction_is_safe_for_every_scene() -> None:
    """Blocks, muscles, a robot, and every medium alone, in a block and in a box."""
    rows = list(largest.largest_steps())
    assert len(rows) >= 15
    assert all(row.verdict == "pass" for row in rows), [row for row in rows if row.verdict == "fail"]
