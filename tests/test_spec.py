"""Budgets as text."""

import pytest

from zoobench.spec import Budget


@pytest.mark.parametrize("text", ["1234567 substeps", "2000000 substeps", "0.00001 seconds", "1.5 seconds"])
def test_a_budget_survives_as_text(text: str) -> None:
    """Every digit is there, so that two budgets are never shown, or taken, as one."""
    budget = Budget.parse(text)
    assert Budget.parse(str(budget)) == budget
    assert "e+" not in str(budget)
