"""Target paths from a user's file."""

from pathlib import Path

import numpy as np
import pytest

from tests.tasks.motions import block, rigid
from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.tasks.target_file import FilePath

PARABOLA = "t,x,z\n" + "".join(f"{t},{3 + 0.2 * t},{-0.1 * t * t}\n" for t in (0.0, 0.1, 0.4, 0.9, 1.0))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_path_runs_smoothly_through_the_points_from_the_origin(here: Path) -> None:
    """A parabola is met exactly between its points too; three random points by position alone, with steady velocity."""
    (here / "path.csv").write_text(PARABOLA)
    path, times = FilePath("path.csv"), np.linspace(0.0, 1.0, 33)
    np.testing.assert_allclose(
        path.positions(times), np.stack([0.2 * times, 0 * times, -0.1 * times**2], 1), atol=1e-14
    )
    np.testing.assert_allclose(path.velocities(times)[:, 2], -0.2 * times, atol=1e-13)
    (here / "bent.csv").write_text("z, t, x\n0,0,0\n\n0.1,0.5,0.2\n-0.3,0.8,0.1\n")
    bent = FilePath("bent.csv")
    points = [[0, 0, 0], [0.2, 0, 0.1], [0.1, 0, -0.3]]
    np.testing.assert_allclose(bent.positions(np.array([0.0, 0.5, 0.8])), points, atol=1e-15)
    before, after = bent.velocities(np.array([0.5 - 1e-9, 0.5 + 1e-9]))
    np.testing.assert_allclose(before, after, atol=1e-6)


def test_two_points_are_a_straight_line(here: Path) -> None:
    """At constant speed."""
    (here / "line.csv").write_text("t,x,z\n0,0,0\n2,0.1,0\n")
    np.testing.assert_allclose(FilePath("line.csv").velocities(np.array([0.0, 0.7, 2.0]))[:, 0], 0.05, rtol=1e-12)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "no table"),
        ("0,0,0\n1,1,1\n", "has the columns 0, 0, 0"),
        ("t,x,y,z\n0,0,0,0\n", "has the columns t, x, y, z"),
        ("t,x,z\n0,0,0\n", "has 1 points"),
        ("t,x,z\n1,0,0\n2,0,0\n", "first time must be 0"),
        ("t,x,z\n0,0,0\n0.5,1,1\n0.5,2,2\n", "Line 4 of 'path.csv': 0.5 s is not later"),
        ("t,x,z\n0,0,0\n1,nan,0\n", "Line 3 of 'path.csv' is '1,nan,0'"),
        ("t,x,z\n0,0,0\n\n1,one,0\n", "Line 4 of 'path.csv' is '1,one,0'"),
        ("t,x,z\n0,0,0\n1,0\n", "Line 3 of 'path.csv' is '1,0'"),
        ("t,x,z\n0,-1e308,0\n1,1e308,0\n", "velocities that are no finite numbers"),
        ("t,x,z\n0,0,0\n1e-300,1e300,0\n1,0,0\n", "velocities that are no finite numbers"),
    ],
)
def test_what_is_no_path_is_refused(here: Path, content: str, message: str) -> None:
    """With the line and what was expected."""
    (here / "path.csv").write_text(content)
    with pytest.raises(UsageError, match=message):
        FilePath("path.csv")


def test_a_path_that_ends_before_the_episode_is_refused(here: Path) -> None:
    """Its last point may be at the very end."""
    (here / "path.csv").write_text(PARABOLA)
    path = FilePath("path.csv")
    assert np.isfinite(path.positions(np.array([125 * 0.008]))).all()
    with pytest.raises(UsageError, match=r"ends at 1 s, and the episode takes 1.008 s"):
        path.positions(np.arange(127) * 0.008)


@pytest.mark.parametrize("task", ["velocity-tracking", "waypoint-following"])
def test_a_task_takes_the_file_and_pins_its_content(here: Path, task: str) -> None:
    """Its targets are the file's; without a file, references are those of before."""
    (here / "line.csv").write_text("t,x,z\n0,2,0\n1,2.05,0\n")
    motion = rigid(block(), spin=0.0, velocity=(0.03, 0.0, 0.0), frames=100)
    ref = registry.resolve(Kind.TASK, Ref.parse(f"{task}[target=line.csv]"))
    assert str(ref.kwargs["target"]).startswith("line.csv@sha256-")
    reward = registry.create(Kind.TASK, ref).reward(motion).flatten().tolist()
    if task == "waypoint-following":  # 0.02 m/s faster than the robot
        assert reward == pytest.approx([-0.02 * 0.008 * frame for frame in range(1, 101)])
    else:  # of which the magnitude counts a tenth
        assert reward == pytest.approx([-0.1 * 0.02] * 100)
    assert "target" not in registry.resolve(Kind.TASK, Ref(task)).kwargs
    (here / "line.csv").write_text("t,x,z\n0,0,0\n1,1,1\n")
    with pytest.raises(UsageError, match="has changed"):
        registry.create(Kind.TASK, ref)
