"""Requirements on every controller."""

import pytest

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        ("fixed-sine[seed=-1]", "from 0 upwards"),
        ("policy-network[hidden=0]", "hidden"),
        ("sine-basis[phases=0]", "at least 1 phase"),
        ("sine-feedback[hidden=0]", "at least 1"),
        ("trajectory[frames=0]", "at least 1"),
    ],
)
def test_settings_that_mean_nothing_are_refused(controller: str, message: str) -> None:
    """With the remedy."""
    with pytest.raises(UsageError, match=message):
        registry.create(Kind.CONTROLLER, Ref.parse(controller))
