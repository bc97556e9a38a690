"""Solutions over several times their frames: what is kept, and what becomes of the robot."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench.cell.episode import Evaluation
from zoobench.cell.problem import Problem
from zoobench.errors import Divergence, UsageError
from zoobench.spec import RunSpec
from zoobench.studies.lasting_study import LastingRow, _end, _last_state, lasting

TORN = Divergence(0, 7, 50, "distance of neighbours by that at rest", 5.0, 4.0, 3, (0.1, 0.2, 0.3), "")


def _draw(spec: RunSpec) -> tuple[float, ...]:
    return tuple(Problem(spec, worlds=1).initial(np.random.default_rng(0)).tolist())


def test_a_gait_goes_on_as_it_began() -> None:
    """The score is that of the whole long episode, and the gap of its own frames that of the run itself."""
    spec = cell()
    own = Problem(spec, worlds=1).evaluate(np.array(_draw(spec)))
    long = Problem(replace(spec, frames=18), worlds=1).evaluate(np.array(_draw(spec)))
    found = lasting(4, spec, _draw(spec), 3)
    assert (found.frames, found.score, found.unit) == (18, long.score, "m/s")
    assert found.home_gap == own.metrics["wall_gap"].value
    assert found.wall_gap == long.metrics["wall_gap"].value
    assert found.key == spec.key()


@pytest.mark.parametrize(("sees", "is_known"), [("all", False), ("body", True)])
def test_a_policy_that_sees_the_clock_begins_otherwise(sees: str, is_known: bool) -> None:
    """Its time left is that of the long episode, so that nothing is said of its own."""
    spec = cell(controller=f"policy-network[sees={sees},hidden=2]")
    assert (lasting("a", spec, _draw(spec), 3).home_gap is not None) == is_known


def test_a_table_of_frames_has_none_beyond_it() -> None:
    """That is said, and nothing is simulated; a table that is long enough is."""
    for frames, end in ((6, "not defined: its table has 6 frames"), (18, "")):
        spec = cell(controller=f"trajectory[frames={frames}]")
        found = lasting("a", spec, _draw(spec), 3)
        assert (found.score is None) == bool(end)
        assert found.end in (end, "turned away")


def test_what_cannot_be_done_says_why() -> None:
    """A target that leaves the arena has no longer episode; a run of other versions has none either."""
    spec = cell(environment="shallow-water", task="waypoint-following[path=straight,speed=0.3]", frames=100)
    assert "not defined: The target leaves the arena" in lasting("a", spec, (), 3).end
    with pytest.raises(UsageError, match="no version 99"):
        lasting("a", replace(spec, env=replace(spec.env, version=99)), (), 3)


@pytest.mark.parametrize(
    ("reward", "failure", "gap", "end"),
    [
        ([1.0, 1.0, 1.0], None, 9.0, ""),
        ([1.0, 0.5, -0.1], None, 9.0, "turned away"),
        ([-1.0, -1.0, -1.0], None, 9.0, ""),
        ([1.0, 0.5, -0.1], None, 2.9, "at a wall"),
        ([], TORN, 9.0, "torn in frame 7"),
        ([], TORN, 2.9, "at a wall"),
        ([], replace(TORN, quantity="det F"), 9.0, "diverged in frame 7"),
    ],
)
def test_a_word_says_what_became_of_it(reward: list[float], failure: Divergence | None, gap: float, end: str) -> None:
    """The wall before all else; errors on a path are below zero throughout and turn nobody away."""
    assert _end(Evaluation(0.0, {}, np.array(reward), failure), gap, 1) == end


def test_a_robot_in_pieces_meets_no_wall() -> None:
    """Gaps count up to the state in which it was found torn."""
    assert (_last_state(TORN, 20), _last_state(None, 20)) == (8, 20)


def test_a_row_is_told_in_a_line() -> None:
    """Its score or error, what became of it, or both."""
    row = LastingRow(4, "k", "turning-v1", 18, 0.25, "at a wall", 1.0, None, "m/s")
    assert (row.title, row.result) == ("run 4", "score 0.25 m/s, at a wall")
    assert replace(row, run="best", score=None).result == "at a wall"
    error = replace(row, task="waypoint-following-v1", score=-0.25, unit="m")
    assert error.result == "error 0.25 m, at a wall"
