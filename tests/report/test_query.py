"""Choosing runs by the names of their components."""

from pathlib import Path

import pytest

from tests.report.content import fill
from zoobench.db.store import Store
from zoobench.errors import UnknownNameError
from zoobench.report.query import Choice, choose_results


@pytest.mark.parametrize(
    ("choice", "count"),
    [
        (Choice(), 13),
        (Choice(env="ice"), 6),
        (Choice(env="des*", method="random"), 3),
        (Choice(env="ice, desert", fidelity="smoke"), 1),
        (Choice(method="diff*,random", env="ice"), 6),
    ],
)
def test_names_and_globs_choose_runs(tmp_path: Path, choice: Choice, count: int) -> None:
    """An axis that is not named does not narrow the choice."""
    with Store(fill(tmp_path / "runs.db"), create=False) as store:
        assert len(choose_results(store, choice)) == count


def test_a_name_that_no_run_has_is_an_error_with_a_suggestion(tmp_path: Path) -> None:
    """A typing mistake must not look like an empty result."""
    with Store(fill(tmp_path / "runs.db"), create=False) as store, pytest.raises(UnknownNameError, match="desert"):
        choose_results(store, Choice(env="dessert"))


def test_a_choice_can_be_typed_again() -> None:
    """The options that it stands for, for the footer of a table."""
    assert Choice(env="ice", method="random").options() == ["--env", "ice", "--method", "random"]
