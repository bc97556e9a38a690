"""The tables that people read."""

from tests.verify.accuracy.study import LEVELS, balance, cost, ladder, sample, scores
from zoobench.verify.accuracy.accuracy_tables import (
    choice_table,
    energy_table,
    knob_table,
    level_table,
    reference_table,
    step_table,
)
from zoobench.verify.accuracy.analyse import analyse
from zoobench.verify.accuracy.records import Measurements
from zoobench.verify.accuracy.verdicts import energies, knobs, steps


def test_every_table_is_rectangular_and_says_what_was_measured() -> None:
    """One row per level, step and knob; percent, with the uncertainty of the reference."""
    knob = sample("standard[courant=0.25]", scores("standard"))
    measured = ladder(knob=knob)
    measured = Measurements(measured.samples, (*measured.costs, cost("standard[courant=0.25]", 400.0)))
    found = analyse(measured)
    tables = (
        level_table(found.levels),
        reference_table(found.references),
        step_table(list(steps(found))),
        knob_table(list(knobs(found))),
        choice_table(list(knobs(found))),
        energy_table(list(energies(Measurements((), (), balances=(balance("draft", 0.2),))))),
    )
    assert [len(rows) for _, rows in tables] == [len(LEVELS), 1, len(LEVELS) - 1, 1, 1, 1]
    assert all(len(row) == len(columns) for columns, rows in tables for row in rows)
    level = dict(zip(*[tables[0][0], tables[0][1][0]], strict=True))
    assert level["score error"] == "71 % ± 30 %"
    assert level["s per simulated s"] == "0.1 (0.09 to 0.12)"
    assert tables[1][1][0][3] == "4 of 4"
    assert tables[3][1][0][-1] == "no difference for more"
    assert tables[5][1][0] == ("ground", "draft", "2", "25.0 %", "20.0 %", "30.0 %", "0.0 %", "10.0 %", "15.0 %")
    assert (tables[4][0][-1], tables[4][1][0][-1]) == ("courant=0.25", f"= {tables[3][1][0][4]}, x 2")


def test_scores_that_do_not_converge_are_marked() -> None:
    """In the references, and where the finest level has no error."""
    wild = Measurements(tuple(map(sample, LEVELS[1:], [[0.01], [0.03], [0.02]])), ())
    found = analyse(wild)
    assert reference_table(found.references)[1][0][3] == "not converged (0 of 1)"
    assert level_table(found.levels)[1][-1][3] == "not known"
