"""Choosing runs by the names of their components."""

from pathlib import Path

import pytest

from tests.report.content import add_done, fill, make_spec
from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Ending, RunState
from zoobench.db.store import Store
from zoobench.errors import UnknownNameError
from zoobench.report.run_results import choose_results, origins
from zoobench.spec import RunSelection


@pytest.mark.parametrize(
    ("choice", "count"),
    [
        (RunSelection(), 13),
        (RunSelection(env="ice"), 6),
        (RunSelection(env="des*", method="random"), 3),
        (RunSelection(env="ice, desert", fidelity="smoke"), 1),
        (RunSelection(method="diff*,random", env="ice"), 6),
    ],
)
def test_names_and_globs_choose_runs(tmp_path: Path, choice: RunSelection, count: int) -> None:
    """An axis that is not named does not narrow the choice."""
    with Store(fill(tmp_path / "runs.db"), create=False) as store:
        assert len(choose_results(store, choice)) == count


def test_a_name_that_no_run_has_is_an_error_with_a_suggestion(tmp_path: Path) -> None:
    """A typing mistake must not look like an empty result."""
    with Store(fill(tmp_path / "runs.db"), create=False) as store, pytest.raises(UnknownNameError, match="desert"):
        choose_results(store, RunSelection(env="dessert"))


def test_a_choice_can_be_typed_again() -> None:
    """The options that it stands for, for the footer of a table."""
    assert RunSelection(env="ice", method="random").options() == ["--env", "ice", "--method", "random"]


def test_a_result_does_not_come_from_what_it_replaced(tmp_path: Path) -> None:
    """The origin of a run that was done again is the newest doing alone, not the code that it was done with before."""
    with Store(tmp_path / "runs.db") as store:
        run_id = add_done(store, make_spec(), 1.0)
        store.retry([run_id], states=[RunState.DONE])
        claim = store.claim(Owner.current(), provenance={"code": {"commit": "newer"}})
        assert claim is not None
        store.finish(claim, Ending(RunState.DONE), Batch())
        (origin,) = origins(store, choose_results(store, RunSelection()))
        assert origin.provenance == {"code": {"commit": "newer"}}
