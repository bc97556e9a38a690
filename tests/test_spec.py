"""Budgets as text."""

import pytest

from zoobench.errors import UsageError
from zoobench.spec import Budget


def test_what_is_counted_is_counted_whole() -> None:
    """Half an iteration is refused, half a second is not."""
    for text in ("2.5 iterations", "0.5", "7.25 episodes"):
        with pytest.raises(UsageError, match="Give a whole number"):
            Budget.parse(text)
    assert Budget.parse("2e5") == Budget("substeps", 200000.0)


@pytest.mark.parametrize("text", ["1234567 substeps", "2000000 substeps", "0.00001 seconds", "1.5 seconds"])
def test_a_budget_survives_as_text(text: str) -> None:
    """With all digits, so that different budgets have different texts."""
    budget = Budget.parse(text)
    assert Budget.parse(str(budget)) == budget
    assert "e+" not in str(budget)
