"""Small cells of any component."""

import pytest

from zoobench import registry
from zoobench.cell.scene_fault import scene_fault
from zoobench.cell.task_fault import task_fault
from zoobench.errors import UnknownNameError
from zoobench.registry import Kind
from zoobench.testing import WITH_OBJECT, small_cell


@pytest.mark.parametrize("task", registry.names(Kind.TASK))
def test_a_task_is_where_it_makes_sense(task: str) -> None:
    """Also where bare ground is not enough, and there is room for what is about the robot."""
    spec = small_cell(task="mix[turning=1]" if task == "mix" else task)
    assert not task_fault(spec)
    assert not scene_fault(spec)


def test_a_task_has_what_it_is_for() -> None:
    """What is carried lies on the back, what is caught flies, what is lifted is below a gripper."""
    given = {task: small_cell(task=task) for task in ("carry", "catch", "lift", "topple")}
    assert given["carry"].env.kwargs["object_place"] == "back"
    assert given["catch"].env.kwargs["object_speed_up"] == 1.2
    assert given["lift"].design.name == "gripper"
    assert given["topple"].env.kwargs["object"] == "column"


def test_what_is_held_reaches_for_a_place() -> None:
    """Unless a task is named."""
    assert small_cell(design="arm").task.name == "reach"
    assert small_cell(design="arm", task="shape").task.name == "shape"


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
