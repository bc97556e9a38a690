"""Tasks against environments, before anything is simulated: targets in the arena, and objects."""

import math
from pathlib import Path

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.cell.robot import Robot
from zoobench.cell.task_fault import sense_fault, task_fault
from zoobench.errors import UsageError
from zoobench.harness import suites
from zoobench.harness.grid import GridSpec, Skip, expand
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec


def test_a_target_that_leaves_the_arena_is_refused() -> None:
    """With time, place, size and remedy, from the frame on in which half the robot's length reaches the wall."""
    spec = cell(environment="shallow-water", task="waypoint-following[path=straight,speed=0.3]", frames=200)
    fault = task_fault(spec)
    robot = Robot.of(spec.design, spec.controller, registry.create(Kind.FIDELITY, spec.fidelity), spec.task)
    # it starts at 0.35 of 0.625 m, and the run-up costs 0.2 s
    seconds = (0.65 * 0.625 - np.ptp(robot.body.positions[:, 0]) / 2) / 0.3 + 0.2
    assert f"after {math.ceil(seconds / 0.008) * 0.008:.3g} s" in fault
    assert "0.625 m by 0.375 m" in fault
    assert "lower speed" in fault
    with pytest.raises(UsageError, match="leaves the arena"):
        Problem(spec)


@pytest.mark.parametrize(
    "change",
    [
        {"frames": 100},
        {"environment": "ground"},
        {"environment": "shallow-water[length=1.0]"},
        {"environment": "desert"},
        {"task": "velocity-tracking[path=straight,speed=0.1]"},
        {"task": "movement-speed"},
        {"task": "mix[movement-speed=1,speed=9]"},
    ],
)
def test_the_remedies_help(change: dict[str, str]) -> None:
    """Fewer frames, more room, an arena without end, less speed; a task without target is not asked."""
    given = {
        "environment": "shallow-water",
        "task": "waypoint-following[path=straight,speed=0.3]",
        "frames": 200,
    } | change
    assert not task_fault(cell(**given))  # type: ignore[arg-type]


def test_a_mixture_is_as_its_tasks() -> None:
    """Only those with a weight."""
    task = "mix[waypoint-following=1,path=straight,speed=0.3]"
    assert "leaves the arena" in task_fault(cell(environment="shallow-water", task=task, frames=200))


def test_a_path_from_a_file_is_checked_alike(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It must stay inside and last as long as the episode; the plan skips the run with the reason."""
    monkeypatch.chdir(tmp_path)
    Path("path.csv").write_text("t,x,z\n0,0,0\n0.4,0,0.02\n0.8,0,0.3\n")
    spec = cell(environment="shallow-water", task="velocity-tracking[target=path.csv]", frames=100)
    assert "leaves the arena" in task_fault(spec)
    assert "ends at 0.8 s" in task_fault(cell(task="velocity-tracking[target=path.csv]", frames=101))
    axes = ((spec.env,), (spec.task,), (spec.design,), (spec.controller,), (spec.method,), (0,))
    (run,) = expand(GridSpec(*axes, spec.budget, spec.fidelity, spec.frames))
    assert isinstance(run, Skip)
    assert "leaves the arena" in run.reason


@pytest.mark.parametrize(
    "task", [name for name in registry.names(Kind.TASK) if registry.get(Kind.TASK, name).needs_object]
)
def test_a_task_with_an_object_needs_one(task: str) -> None:
    """In the environment, which the reason names; the plan skips the run with it, and no problem can be made."""
    spec = cell(environment="ice", task=task)
    fault = task_fault(spec)
    assert f"The task '{task}' needs an object, and 'ice' has none here" in fault
    advised = fault.split("'")[-2]
    assert not sense_fault(Ref.parse(advised), Ref(task)), "what is advised is possible"
    assert "--env" not in fault  # Python has no options
    with pytest.raises(UsageError, match="needs an object"):
        Problem(spec)
    axes = ((spec.env,), (spec.task,), (spec.design,), (spec.controller,), (spec.method,), (0,))
    (run,) = expand(GridSpec(*axes, spec.budget, spec.fidelity, spec.frames))
    assert isinstance(run, Skip)
    assert run.reason == fault
    usual = tuple(sorted(registry.get(Kind.TASK, task).usual_settings.items()))
    assert not task_fault(cell(environment=str(Ref("ice", 0, usual)), task=task))


@pytest.mark.parametrize(
    ("task", "environment", "design", "told"),
    [
        ("climb", "ground", "caterpillar", "climb on level ground. Give a slope"),
        ("climb", "desert", "caterpillar", "climb on level ground"),
        ("carry", "ground[object=box]", "block", "The object is ahead on the ground"),
        ("carry", "ground[object=box,object_height=0.001]", "block", "The object is ahead on the ground"),
        ("carry", "desert[object=box,object_place=left]", "block", "The object is left on the ground"),
        ("catch", "ground[object=ball]", "block", "Nothing is thrown"),
        ("mix[movement-speed=1,turning=0.2]", "ground", "arm", "'arm' is held at its base, and 'mix' needs a body"),
        ("jump", "ground", "arm", "'arm' is held at its base, and 'jump' needs a body that is free"),
        ("movement-speed", "ice", "gripper", "'gripper' is held at its base"),
        ("waypoint-following", "ground", "arm", "'arm' is held at its base"),
    ],
)
def test_a_task_that_makes_no_sense_is_refused(task: str, environment: str, design: str, told: str) -> None:
    """By the plan and the run, with what would make sense."""
    spec = cell(environment=environment, task=task, design=design)
    assert told in task_fault(spec)
    with pytest.raises(UsageError, match=told):
        Problem(spec)


@pytest.mark.parametrize(
    ("task", "environment", "design"),
    [
        ("climb", "ground[slope=10]", "caterpillar"),
        ("climb", "desert[relief=0.02]", "caterpillar"),
        ("climb", "ground[obstacle=shaft,obstacle_distance=0,obstacle_length=0.15]", "caterpillar"),
        ("climb", "ground[object=box]", "caterpillar"),
        ("climb", "ocean", "fish"),
        ("carry", "ground[object=box,object_place=back]", "block"),
        ("carry", "ground[object=ball,object_place=below]", "gripper[base_speed=0.1]"),
        ("carry", "ocean[water=grid,object=box]", "fish"),
        ("carry", "ground[obstacle=pegs,object=beam,object_size=0.16,object_height=0.05]", "block"),
        ("catch", "ground[object=ball,object_speed=0.5]", "block"),
        ("lift", "ground[object=box]", "caterpillar"),
        ("movement-speed", "ground", "arm[base_speed=0.1]"),
        ("turning", "ground", "arm"),
        ("shape", "ground", "gripper"),
    ],
)
def test_a_task_that_may_make_sense_is_not_refused(task: str, environment: str, design: str) -> None:
    """Where it is in doubt, too."""
    assert not task_fault(cell(environment=environment, task=task, design=design))


def test_another_task_may_have_objects_about() -> None:
    """Things to go round; a task that knows no objects, as of an older package, is as one that needs none."""
    assert not task_fault(cell(environment="ground[object=box]"))
    assert task_fault(cell(environment="ground[object=none]", task="push"))


@pytest.mark.slow  # it builds every robot; `zoobench run` asks the same of the runs that it queues
@pytest.mark.parametrize("name", ["gaits", "paper"])
def test_no_cell_of_the_published_suites_is_refused(name: str) -> None:
    """Their targets stay inside for every robot."""
    cells = [suites.spec_of(item) for item in suites.load(name).cells]
    followed = [spec for spec in cells if "path" in spec.task.kwargs]
    assert followed
    assert not [spec for spec in followed if isinstance(spec, RunSpec) and task_fault(spec)]


def test_what_is_the_same_left_and_right_is_not_asked_to_turn() -> None:
    """The message names a body that can; one with sides, another task and a design space are not refused."""
    fault = task_fault(cell(environment="ocean", task="turning", design="orca"))
    assert "orca[paired=true]" in fault
    for design, task in (
        ("orca[paired=true]", "turning"),
        ("orca", "movement-speed"),
        ("sdf-lerp", "turning"),
        ("voxel[base=orca]", "turning"),
    ):
        assert not task_fault(cell(environment="ocean", task=task, design=design))


@pytest.mark.parametrize("design", ["caterpillar", "baby-seal", "panda", "fish", "block"])
def test_animals_on_land_are_asked_to_turn(design: str) -> None:
    """They have muscles left and right."""
    assert not task_fault(cell(environment="ground", task="turning", design=design))
