"""Shares of the energy."""

from dataclasses import replace

import pytest

from tests.verify.accuracy.study import balance
from zoobench.spec import Ref
from zoobench_verify.accuracy.energy_rows import energies
from zoobench_verify.accuracy.records import Measurements


def test_energy_is_shared_out_among_where_it_went() -> None:
    """Of 2 J, 0.5 are taken back, 0.4 stored, 0.6 lost to viscosity, 0.2 to contact and 0.3 without a cause."""
    levels = ("standard", "draft[courant=0.1]", "draft")
    given = (*(balance(level, 0.2) for level in levels), balance("draft", 0.2, "ice"))
    old = replace(given[0], fidelity=Ref("draft", 99))
    rows = list(energies(Measurements((), balances=(*given, old))))
    assert [row.fidelity for row in rows] == ["draft", "draft[courant=0.1]", "standard", "draft"]
    assert [row.env for row in rows] == ["ground"] * 3 + ["ice"]
    row = rows[0]
    shares = (row.back, row.stored, row.viscous, row.plastic, row.contact, row.unexplained)
    assert shares == pytest.approx((0.25, 0.2, 0.3, 0.0, 0.1, 0.15))
    assert sum(shares) == pytest.approx(1.0)
    assert [row.env for row in energies(Measurements((), balances=given), ["ice"])] == ["ice"]
