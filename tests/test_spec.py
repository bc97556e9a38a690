"""Budgets as text."""

import pytest

from zoobench.errors import UnknownNameError, UsageError
from zoobench.spec import Budget, Ref, Selector, matching


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


def test_a_budget_beyond_counting_is_refused() -> None:
    """In a short message, not with three hundred digits."""
    with pytest.raises(UsageError, match=r"A budget of '1e300 substeps' cannot be counted\. Give at most"):
        Budget.parse("1e300 substeps")


@pytest.mark.parametrize("text", ["desert[depth=1,depth=2]", "desert[wave-length=1,wave_length=1]"])
def test_a_parameter_is_given_once(text: str) -> None:
    """As an option is; else one of its values would be lost without a word."""
    with pytest.raises(UsageError, match="is given twice"):
        Ref.parse(text)


@pytest.mark.parametrize("text", ["desert-v0", "desert-v00[depth=1]"])
def test_there_is_no_version_0(text: str) -> None:
    """It stands for the newest within zoobench alone; typed, it is a version that does not exist."""
    with pytest.raises(UsageError, match="versions count from 1"):
        Ref.parse(text)


@pytest.mark.parametrize(
    ("text", "count"),
    [("desert", 2), ("de*", 3), ("[dx]esert", 2), ("desert-v1", 1), ("de*[depth=2]", 2), ("desert-v2[depth=1],ice", 0)],
)
def test_a_selector_is_a_name_or_glob_with_version_and_parameters(text: str, count: int) -> None:
    """A version or a parameter that is not given may have any value."""
    refs = [Ref.parse(word) for word in ("desert-v1[depth=1]", "desert-v2[depth=2.0]", "den-v1[depth=2]")]
    selectors = Selector.parse_all(text)
    assert sum(any(selector.matches(ref) for selector in selectors) for ref in refs) == count


def test_a_pattern_that_fits_no_name_gets_did_you_mean() -> None:
    """Otherwise the names that it fits, in their order."""
    assert matching("w*", ["wave", "ice", "wall"], "case") == ["wave", "wall"]
    with pytest.raises(UnknownNameError, match=r"Unknown case 'wal'\. Did you mean 'wall'"):
        matching("wal", ["wave", "ice", "wall"], "case")


def test_a_setting_may_have_settings_of_its_own() -> None:
    """As the name of a solution has; commas in their brackets are its own, also beside several values."""
    name = "best:board/ground[obstacle=slot,opening=0.06]/speed/block"
    found = [each.params for each in Selector.parse_all(f"cmaes[lr=1|2,start={name},w=3],random")]
    assert found == [*((("lr", lr), ("start", name), ("w", 3)) for lr in (1, 2)), ()]


def test_several_values_of_a_parameter_are_a_selector_each() -> None:
    """All combinations of two such parameters; a bar elsewhere is part of the text."""
    text = "ground[friction=0.2|0.5,slope=1|2|3],ice,mesh[path=a|b]"
    found = [(each.name, dict(each.params)) for each in Selector.parse_all(text)]
    grounds = [{"friction": friction, "slope": slope} for friction in (0.2, 0.5) for slope in (1, 2, 3)]
    assert found == [
        *(("ground", params) for params in grounds),
        ("ice", {}),
        ("mesh", {"path": "a"}),
        ("mesh", {"path": "b"}),
    ]
    with pytest.raises(UsageError):
        Selector.parse_all("ground[friction=0.2|]")
