"""The analysis, judged on measurements that follow known laws."""

import math

import numpy as np
import pytest

from tests.verify.accuracy.study import LEVELS, LIMITS, SLOPES, TASK, close, fidelity, ladder, sample, scores
from zoobench.verify.accuracy.analyse import BODY_LENGTH, LevelRow, analyse
from zoobench.verify.accuracy.plan import NUDGE
from zoobench.verify.accuracy.records import Measurements, grid_spacing


def rows(measurements: Measurements) -> dict[str, LevelRow]:
    """Levels and knobs by name."""
    found = analyse(measurements)
    return {row.fidelity: row for row in (*found.levels, *found.knobs)}


def test_errors_are_distances_to_the_limit() -> None:
    """Of first order in h by construction: the error at every level is the law's, the finest one's too."""
    for name, row in rows(ladder()).items():
        law = grid_spacing(fidelity(name)) * np.sqrt((SLOPES**2).mean() / (LIMITS**2).mean())
        assert row.error == pytest.approx(law, rel=1e-9)
    (reference,) = analyse(ladder()).references
    assert reference.converged == reference.draws == 4
    assert reference.order == pytest.approx(1.0)
    assert reference.scale == pytest.approx(math.sqrt((LIMITS**2).mean()))


def test_the_finest_level_is_not_its_own_judge() -> None:
    """Where nothing converges, the finest level has no error, and the reference states its uncertainty."""
    wild = [[0.01], [0.03], [0.02]]
    measured = Measurements(tuple(map(sample, LEVELS[1:], wild)), ())
    found = rows(measured)
    assert found["fine"].error is None
    assert found["paper"].error == pytest.approx(0.5)
    (reference,) = analyse(measured).references
    assert (reference.converged, reference.order) == (0, None)
    assert reference.unknown == pytest.approx(1.0)


def test_a_diverged_draw_is_left_out() -> None:
    """One NaN spoils neither the reference nor the errors of the others."""
    broken = scores("draft")
    broken[1] = math.nan
    measured = ladder()
    others = tuple(one for one in measured.samples if one.fidelity != fidelity("draft"))
    found = rows(Measurements((*others, sample("draft", broken)), ()))["draft"]
    assert found.error is not None
    assert found.draws == "3, 3"


def test_errors_below_the_noise_floor_are_marked() -> None:
    """Shifts that change the scores by 0.02 either way drown the error of every level."""
    up, down = (sample(f"standard[shift={shift}]", [value + sign * 0.02 for value in scores("standard")])
                for shift, sign in ((0.25, 1), (0.5, -1)))  # fmt: skip
    found = rows(ladder(up=up, down=down))
    assert found["fine"].at_floor
    assert found["fine"].floor == pytest.approx(0.02 / math.sqrt((LIMITS**2).mean()), rel=1e-9)
    assert set(found) == set(LEVELS)


def test_rank_correlation_tells_a_wrong_winner() -> None:
    """A knob that swaps first and last has another winner and a tau of its own."""
    measured = ladder(knob=sample("draft[courant=0.25]", scores("draft")[::-1]))
    found = rows(measured)
    assert (found["paper"].tau, found["paper"].winner) == (1.0, True)
    swapped = found["draft[courant=0.25]"]
    assert swapped.winner is False
    assert swapped.tau is not None
    assert swapped.tau < 1.0
    assert found["fine"].tau is None


def test_paths_and_gradients_are_compared_with_the_finest_level() -> None:
    """A path off by 5 mm at four of five points, a gradient turned by 0.1 rad."""
    found = rows(ladder(one=close("draft", 0.005, 0.1), two=close("fine", 0.0)))["draft"]
    assert found.path == pytest.approx(0.005 * math.sqrt(0.8) / BODY_LENGTH)
    assert found.shape == 0.0
    assert found.angle == pytest.approx(1 - math.cos(0.1))
    assert found.ratio == pytest.approx(1.0)


@pytest.mark.parametrize(("apart", "until"), [(1e-6, 0.032), (1e-3, 0.0)])
def test_chaos_is_where_a_nudge_grows_beyond_a_hundredth_of_the_error(apart: float, until: float) -> None:
    """Paths off by 5 mm, nudged ones by far less, and by more than a hundredth of it from the first point on."""
    nudged = close(f"draft[shift={NUDGE}]", 0.005 + apart)
    (reference,) = analyse(ladder(one=close("draft", 0.005), two=close("fine", 0.0), three=nudged)).references
    assert reference.chaos == pytest.approx(until)


def test_costs_are_those_of_a_simulated_second() -> None:
    """1,000 particles, 1,000 substeps a second, 100 ns each: 0.1 s."""
    found = rows(ladder())["draft"]
    assert found.seconds == pytest.approx(0.1)
    assert found.seconds_most == pytest.approx(0.12)
    assert found.gradient_seconds == pytest.approx(0.4)
    assert found.memory == 1.0
    assert sample("draft", [0.0]).scores[TASK] == [0.0]
