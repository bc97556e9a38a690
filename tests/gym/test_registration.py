"""Registration with Gymnasium."""

import subprocess
import sys

import gymnasium
import pytest

from zoobench import registry
from zoobench.gym.registration import name_of, register_envs
from zoobench.registry import Kind


def test_every_cell_has_a_name() -> None:
    """Environment, body and task in camel case; neither design spaces nor bodies from files; twice changes nothing."""
    register_envs()
    before = dict(gymnasium.registry)
    register_envs()
    assert gymnasium.registry == before
    ours = [name for name in before if name.startswith("zoobench/")]
    assert "zoobench/Ocean-Arm-Reach-v0" not in ours
    tasks = [name for name in registry.names(Kind.TASK) if name not in ("mix", "lift")]  # weights, and a gripper
    assert len({name for name in ours if "Panda" in name and "Ground" in name}) == len(tasks)
    assert before["zoobench/Ice-Panda-PushTo-v0"].kwargs["env"] == "ice[object=box]"
    assert "zoobench/Ocean-Panda-PushTo-v0" not in ours
    assert "zoobench/Desert-Caterpillar-Turning-v0" in ours
    assert "zoobench/ShallowWater-BabySeal-WaypointFollowing-v0" in ours
    assert not [name for name in ours if "Mesh" in name or "Voxel" in name or "Mix" in name]
    assert before["zoobench/Desert-Caterpillar-Turning-v0"].kwargs == {
        "env": "desert",
        "design": "caterpillar",
        "task": "turning",
    }
    assert before["zoobench/Desert-Caterpillar-Turning-v0"].max_episode_steps == 200
    assert name_of("shallow-water", "baby-seal", "turning") == "ShallowWater-BabySeal-Turning-v0"


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("Ground-Gripper-Lift", "ground[object=ball,object_place=below,object_size=0.05]"),
        ("Ice-Gripper-Spin", "ice[object=box,object_place=below]"),
        ("Ground-Arm-Push", "ground[object=box]"),
        ("Ground-Block-Carry", "ground[object=sheet,object_place=back,object_size=0.16]"),
        ("Ground-Block-Catch", "ground[object=ball,object_gap=0.15,object_speed=0.6,object_speed_up=1.2]"),
        ("Snow-Block-Topple", "snow[object=column,object_gap=0.0,object_size=0.16]"),
        ("Ground-Block-Kick", "ground[object=ball,object_gap=0.0]"),
        ("Desert-Panda-Climb", "desert[slope=10.0]"),
        ("Ocean-Fish-Climb", "ocean"),
    ],
)
def test_a_task_is_where_it_makes_sense(name: str, place: str) -> None:
    """With the object that it is for, where the robot can do something with it."""
    assert gymnasium.spec(f"zoobench/{name}-v0").kwargs["env"] == place


@pytest.mark.parametrize(
    "name", ["Ground-Arm-Lift", "Ground-Gripper-Carry", "Ground-Gripper-Catch", "Ground-Block-Lift", "Ground-Arm-Jump"]
)
def test_what_makes_no_sense_has_no_name(name: str) -> None:
    """Nothing is lifted from below who stands on it, or taken along by who is held."""
    with pytest.raises(gymnasium.error.NameNotFound):
        gymnasium.spec(f"zoobench/{name}-v0")


def test_importing_makes_the_names_known() -> None:
    """Without loading torch or the simulator's compiler."""
    code = """
import sys, gymnasium, zoobench.gym
gymnasium.spec("zoobench/Desert-Caterpillar-Turning-v0")
assert not {"torch", "taichi"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_without_gymnasium_it_says_what_to_do() -> None:
    """The message names the extra to install."""
    code = "import sys; sys.modules['gymnasium'] = None; import zoobench.gym"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode
    assert "zoobench[ppo]" in done.stderr
