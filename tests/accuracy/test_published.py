"""What comes with the package, and what is chosen by it."""

from pathlib import Path

import pytest

from tests.verify.accuracy.study import TASK
from zoobench import registry
from zoobench.accuracy import levels, tolerance
from zoobench.cli.options import coarsest_fidelity
from zoobench.harness.request import RunRequest
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSelection, RunSpec

ROWS = levels.published().levels
KNOWN = tolerance.known_levels([Ref.parse(env) for env in dict.fromkeys(row.env for row in ROWS)], [TASK])


def test_every_environment_has_levels() -> None:
    """With costs, and the file says which commit measured it."""
    assert levels.published().origin
    assert {Ref.parse(row.env).name for row in ROWS} == set(registry.names(Kind.ENV))
    assert all(row.seconds for row in ROWS if row.fidelity in ("draft", "standard"))


@pytest.mark.parametrize(("designs", "is_draft"), [("panda,baby-seal", False), ("panda", True)])
def test_draft_orders_gaits_of_a_panda_but_not_a_panda_and_a_seal(tmp_path: Path, designs: str, is_draft: bool) -> None:
    """On the ground the seal leads by 14 to 33 % at draft, and the panda at fine; as `run` chooses."""
    asked = RunRequest(RunSelection("ground", TASK, designs), decide=1.25)
    said: list[str] = []
    cells = asked.cells(str(tmp_path / "none.db"), coarsest_fidelity, said.append)
    assert {cell.fidelity.name == "draft" for cell in cells if isinstance(cell, RunSpec)} == {is_draft}
    assert "baby-seal" in said[0]


@pytest.mark.parametrize("env", sorted({row.env for row in KNOWN}))
def test_no_reference_is_taken_for_exact(env: str) -> None:
    """Its error is stated at each level, or that it was not measured, with the command that does."""
    reason = tolerance.choose(Ref.parse(env), Ref(TASK), 2.0, None).reason
    known = [row.unknown is not None for row in KNOWN if row.env == env]
    assert reason.count("reference known to ") == known.count(True)
    assert reason.count("error of the reference not measured") == known.count(False)
    assert ("To measure it: zoobench verify accuracy run" in reason) == (not all(known))
