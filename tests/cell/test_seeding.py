"""Seeds depend on the named axes only."""

from dataclasses import replace

import pytest

from tests.harness.helpers import spec
from zoobench.cell.seeding import METHOD_AXES, STUDY_AXES, generator
from zoobench.spec import Budget, Ref


def _draw(axes: tuple[str, ...], **changes: object) -> float:
    return generator(replace(spec(), **changes), "draw", axes).random()  # type: ignore[arg-type]


def test_an_axis_that_is_not_named_does_not_matter() -> None:
    """A study has the same controllers in every environment, for any method."""
    assert _draw(STUDY_AXES) == _draw(STUDY_AXES, method=Ref("diffphysics", 1), env=Ref("ice", 1))


@pytest.mark.parametrize("axis", METHOD_AXES)
def test_each_named_axis_matters(axis: str) -> None:
    """Every named axis changes the numbers."""
    other = 5 if axis == "seed" else Ref("other", 1)
    assert _draw(METHOD_AXES) != _draw(METHOD_AXES, **{axis: other})


def test_a_longer_run_starts_from_the_same_draws() -> None:
    """Budget and fidelity do not change the method's numbers."""
    assert _draw(METHOD_AXES) == _draw(METHOD_AXES, budget=Budget("substeps", 99), fidelity=Ref("paper", 1))


def test_purposes_are_independent() -> None:
    """Two purposes with the same axes have different numbers, and each is reproducible."""
    assert generator(spec(), "a").random() != generator(spec(), "b").random()
    assert generator(spec(), "a").random() == generator(spec(), "a").random()


def test_the_numbers_do_not_change_between_releases() -> None:
    """This value is part of the schema."""
    assert generator(spec(), "method", ("env", "seed")).integers(0, 2**32) == 2746865597
