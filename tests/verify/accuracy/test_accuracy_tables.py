"""The tables that people read."""

from dataclasses import replace

from tests.verify.accuracy.study import TASK, balance, ladder, sample, scaled
from zoobench.accuracy.levels import KeptOrders
from zoobench_verify.accuracy.accuracy_tables import energy_table, knob_table, level_table, matrix_table, short_table
from zoobench_verify.accuracy.analyse import analyse
from zoobench_verify.accuracy.energy_rows import energies
from zoobench_verify.accuracy.records import Measurements


def test_every_table_is_rectangular_and_says_what_was_measured() -> None:
    """Percent, with the uncertainty of the reference, or that there is no figure of it."""
    found = analyse(ladder(others=[sample("draft[courant=0.25]", scaled(0.8))]))
    tables = (
        level_table(found.levels),
        matrix_table(found.matrix),
        knob_table(found.knobs),
        energy_table(list(energies(Measurements((), balances=(balance("draft", 0.2),))))),
        short_table(found.levels),
    )
    assert [len(rows) for _, rows in tables] == [3, 1, 1, 1, 3]
    assert all(len(row) == len(columns) for columns, rows in tables for row in rows)
    level = dict(zip(*[tables[0][0], tables[0][1][0]], strict=True))
    assert level["score error"] == "50 % ± 5 % or more"
    unchecked = level_table([replace(found.levels[0], unknown=None)])
    assert dict(zip(unchecked[0], unchecked[1][0], strict=True))["score error"] == "50 % ± not measured"
    assert level["score / finest"] == "0.50 (0.50 to 0.50)"
    assert level["finest / score where trained"] == "200 %"
    assert tables[1] == (
        ("env", "task", "trained at", "at draft", "at standard", "at paper"),
        [("ground", TASK, "draft", "100 %", "220 %", "210 %")],
    )
    assert tables[2][1] == [("ground", TASK, "20 %, 2 s")]
    assert tables[3][1] == [("ground", "draft", "2", "25.0 %", "20.0 %", "30.0 %", "0.0 %", "10.0 %", "15.0 %")]


def test_the_short_table_says_which_rankings_agree() -> None:
    """At any difference, above one, or at none that is known; of two bodies only where there are pairs of them."""
    row = analyse(ladder()).levels[0]
    for decides, text in {1.0: "any difference", 1.5: "above 50 %", None: "not known"}.items():
        one = replace(row, one_body=KeptOrders(decides, 96, ("caterpillar",)))
        two = replace(row, two_bodies=KeptOrders(decides, 20, ("caterpillar", "panda")))
        rows = short_table([one, two])[1]
        assert rows[0][3:] == ("50 % ± 5 % or more", f"{text} (96 pairs)", "not compared", "caterpillar")
        assert rows[1][5] == f"{text} (20 pairs)"
