"""Costs of a simulated second."""

import pytest

from zoobench import registry
from zoobench.accuracy.rates import rate
from zoobench.registry import Kind
from zoobench.spec import Ref

DRAFT = Ref("draft")


@pytest.mark.parametrize("text", ["ocean", "ocean[water=grid]"])
def test_each_water_has_the_costs_that_were_measured_in_it(text: str) -> None:
    """Whether all of its parameters are given or those alone that are not the default."""
    named = Ref.parse(text)
    level = rate(named, DRAFT)
    assert level is not None
    assert level.env == text
    assert rate(registry.resolve(Kind.ENV, named), registry.resolve(Kind.FIDELITY, DRAFT)) == level


@pytest.mark.parametrize(
    ("env", "fidelity"), [("ocean[water=grid,depth=0.3]", "draft"), ("ocean", "draft[courant=0.5]")]
)
def test_what_was_not_measured_has_no_costs(env: str, fidelity: str) -> None:
    """Another arena or another step costs something else."""
    assert rate(Ref.parse(env), Ref.parse(fidelity)) is None
