"""What comes with the package, and what is chosen by it."""

import pytest

from tests.verify.accuracy.study import TASK
from zoobench import registry
from zoobench.accuracy import levels, tolerance
from zoobench.registry import Kind
from zoobench.spec import Ref

ROWS = levels.published().levels
KNOWN = tolerance.known_levels([Ref.parse(env) for env in dict.fromkeys(row.env for row in ROWS)], [TASK])


def test_every_environment_has_levels() -> None:
    """With costs, and the file says which commit measured it."""
    assert levels.published().origin
    assert {Ref.parse(row.env).name for row in ROWS} == set(registry.names(Kind.ENV))
    assert all(row.seconds for row in ROWS if row.fidelity in ("draft", "standard"))


@pytest.mark.parametrize("env", sorted({row.env for row in KNOWN}))
def test_no_reference_is_taken_for_exact(env: str) -> None:
    """Its error is stated at each level, or that it was not measured, with the command that does."""
    reason = tolerance.choose(Ref.parse(env), Ref(TASK), 2.0, None).reason
    known = [row.unknown is not None for row in KNOWN if row.env == env]
    assert reason.count("reference known to ") == known.count(True)
    assert reason.count("error of the reference not measured") == known.count(False)
    assert ("To measure it: zoobench verify accuracy run" in reason) == (not all(known))
