"""Scenes that cannot be made, or not with the step that is asked for, are refused before anything is simulated."""

import pytest

from tests.conformance.cells import cell
from zoobench.cell.problem import Problem
from zoobench.cell.scene_fault import scene_fault
from zoobench.errors import UsageError
from zoobench.harness.grid import GridSpec, Skip, expand


@pytest.mark.parametrize(
    ("environment", "design", "told"),
    [
        ("ground[object=box,object_place=below]", "block", "has no room below a robot that stands on the ground"),
        ("ground[object=box,object_place=below,object_size=0.09]", "gripper", "parts of a robot that hangs 0.0"),
        ("ground[object=sheet]", "block", "0.8 cells of 0.01562 m"),
        ("ground[object=ball,object_speed=0.5]", "particle", "beside the bodies of a design space"),
        ("ground[obstacle=post,obstacle_opening=0.001]", "block", "less than a cell"),
        ("ground[object=box,object_stiffness=1e12]", "block", "The object needs steps of"),
        ("ground[youngs_modulus=1e13]", "block", "The robot needs steps of"),
        ("ground", "arm[clearance=10]", "does not fit into the arena"),
    ],
)
def test_a_scene_that_cannot_be_made_is_skipped_with_its_reason(environment: str, design: str, told: str) -> None:
    """In the plan of a grid, as what the run itself would say."""
    spec = cell(environment=environment, design=design, fidelity="draft")
    assert told in scene_fault(spec)
    axes = (spec.env,), (spec.task,), (spec.design,), (spec.controller,), (spec.method,)
    (skip,) = expand(GridSpec(*axes, (0,), spec.budget, spec.fidelity, spec.frames))
    assert isinstance(skip, Skip)
    assert told in skip.reason


def test_a_body_that_is_drawn_has_no_object_thrown_at_it() -> None:
    """Not from Python either."""
    with pytest.raises(UsageError, match="Choose a fixed design"):
        Problem(cell(environment="ground[object=ball,object_speed=0.5]", design="particle"))


@pytest.mark.parametrize(
    ("environment", "design"),
    [
        ("ground", "block"),
        ("ground[object=box]", "block"),
        ("ground[object=ball,object_place=below,object_size=0.05]", "gripper"),
        ("ground[object=box]", "caterpillar[length=0.001]"),
    ],
)
def test_what_has_room_is_not_refused(environment: str, design: str) -> None:
    """A body that cannot be made has its own error."""
    assert not scene_fault(cell(environment=environment, design=design, fidelity="draft"))


@pytest.mark.parametrize(
    ("environment", "design", "fidelity", "told"),
    [
        ("ground", "block", "smoke[step=0.004]", "2.24 of the largest stable one"),
        ("ground", "voxel", "smoke[step=0.004]", "Ask for 0.00089 s, or for none"),
        ("ocean", "block", "smoke[step=0.007]", "The robot sets the limit"),
        ("ground", "caterpillar", "smoke[grid_spacing=0.3]", "shorter than a cell of 0.3 m"),
    ],
)
def test_a_fidelity_that_the_robot_is_not_simulated_with_is_refused(
    environment: str, design: str, fidelity: str, told: str
) -> None:
    """A step that is not stable, and cells that are larger than the robot."""
    assert told in scene_fault(cell(environment=environment, design=design, fidelity=fidelity))


@pytest.mark.parametrize("fidelity", ["smoke[step=0.001]", "smoke[grid_spacing=0.04]", "smoke[particles_per_cell=4]"])
def test_a_fidelity_with_settings_that_hold_is_not_refused(fidelity: str) -> None:
    """A stable step, larger cells and fewer particles."""
    assert not scene_fault(cell(fidelity=fidelity))
