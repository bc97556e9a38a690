"""The gain of one more level, and the effects of knobs."""

import pytest

from tests.verify.accuracy.study import balance, cost, ladder, sample, scores
from zoobench.verify.accuracy.analyse import analyse
from zoobench.verify.accuracy.records import Measurements
from zoobench.verify.accuracy.verdicts import energies, knobs, pareto, steps


def test_the_gain_of_one_more_level_is_the_ratio_of_the_errors() -> None:
    """First order: from 1/64 to 1/96 two thirds of the error, at twice the rate by construction."""
    first = next(iter(steps(analyse(ladder()))))
    assert (first.level, first.next_level) == ("draft", "standard")
    assert first.gain == pytest.approx(1.5)
    assert first.cost == pytest.approx(2.0)


def test_energy_is_shared_out_among_where_it_went() -> None:
    """Of 2 J, 0.5 are taken back, 0.4 stored, 0.6 lost to viscosity, 0.2 to contact and 0.3 without a cause."""
    levels = ("standard", "draft[courant=0.1]", "draft")
    given = (*(balance(level, 0.2) for level in levels), balance("draft", 0.2, "ice"))
    rows = list(energies(Measurements((), (), balances=given)))
    assert [row.fidelity for row in rows] == ["draft", "draft[courant=0.1]", "standard", "draft"]
    assert [row.env for row in rows] == ["ground"] * 3 + ["ice"]
    row = rows[0]
    shares = (row.back, row.stored, row.viscous, row.plastic, row.contact, row.unexplained)
    assert shares == pytest.approx((0.25, 0.2, 0.3, 0.0, 0.1, 0.15))
    assert sum(shares) == pytest.approx(1.0)
    assert [row.env for row in energies(Measurements((), (), balances=given), ["ice"])] == ["ice"]


@pytest.mark.parametrize(
    ("off", "rate", "verdict"),
    [
        (0.0, 200.0, "no difference at no cost"),
        (0.0, 400.0, "no difference for more"),
        (0.02, 100.0, "worse for less"),
        (-0.0104, 400.0, "better for more"),
    ],
)
def test_a_knob_is_judged_by_what_it_changes_and_costs(off: float, rate: float, verdict: str) -> None:
    """All scores moved by `off`, at another rate, around a level that costs 200 ns."""
    knob = sample("standard[courant=0.25]", [value + off for value in scores("standard")])
    measured = ladder(knob=knob)
    measured = Measurements(measured.samples, (*measured.costs, cost("standard[courant=0.25]", rate)))
    (row,) = knobs(analyse(measured))
    assert (row.home, row.knob) == ("standard", "courant=0.25")
    assert row.verdict == verdict


def test_the_front_holds_what_nothing_beats() -> None:
    """A knob that is slower and worse than a level is not on it."""
    bad = sample("standard[courant=0.1]", [value + 0.05 for value in scores("standard")])
    measured = ladder(bad=bad)
    measured = Measurements(measured.samples, (*measured.costs, cost("standard[courant=0.1]", 900.0)))
    found = analyse(measured)
    front = pareto([*found.levels, *found.knobs])
    assert [row.fidelity for row in front] == ["draft", "standard", "paper", "fine"]
