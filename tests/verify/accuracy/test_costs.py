"""Timing every simulation of the study."""

from dataclasses import replace

import pytest

from zoobench.errors import UsageError
from zoobench.spec import Ref
from zoobench.verify.accuracy import costs as module
from zoobench.verify.accuracy.costs import costs
from zoobench.verify.accuracy.plan import StudyPlan, specs


def test_each_fidelity_is_timed_once_and_shifts_not_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rates are positive and ordered, gradients dearer, particles more on the finer grid."""
    monkeypatch.setattr(module, "ENOUGH_SECONDS", 0.001)
    plan = StudyPlan(
        levels=("draft",), around="draft", draws=(1,), close=1, knobs=("particles_per_cell=1",), shifts=(0.5,)
    )
    wanted = specs([Ref("ground")], [Ref("turning")], plan)
    told: list[str] = []
    found = list(costs(wanted, repeats=2, on_case=told.append))
    assert told == ["ground draft", "ground draft[particles_per_cell=1]"]
    for cost in found:
        assert 0 < cost.forward_least <= cost.forward <= cost.forward_most
        assert cost.gradient > cost.forward
    assert found[0].particles > 4 * found[1].particles
    with pytest.raises(UsageError, match="at least 1"):
        next(costs([replace(spec) for spec in wanted], repeats=0))
