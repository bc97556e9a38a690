"""Small cells of any component."""

import pytest

from zoobench.cell.task_fault import task_fault
from zoobench.errors import UnknownNameError
from zoobench.testing import WITH_OBJECT, small_cell


def test_a_task_with_an_object_has_one_before_the_robot() -> None:
    """Unless an environment is named; any other task is on bare ground."""
    assert small_cell(task="push").env == small_cell(environment=WITH_OBJECT).env
    assert not task_fault(small_cell(task="push"))
    assert task_fault(small_cell(task="push", environment="ground"))
    assert "object" not in small_cell(task="turning").env.kwargs


def test_an_axis_that_does_not_exist_is_refused() -> None:
    """With those that do."""
    with pytest.raises(UnknownNameError, match="environment"):
        small_cell(env="ice")
