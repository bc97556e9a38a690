"""What is said of stored and published runs that others start from."""

from dataclasses import replace

from tests.report.content import make_spec
from zoobench.db.published import PublishedRun
from zoobench.harness.starts import words_of
from zoobench.spec import Ref


def test_a_published_run_is_told_in_a_line() -> None:
    """Its board, method and seed with the score, or the error of a path."""
    best = PublishedRun("mine", "k", make_spec(), (), 3.0, "m/s")
    assert words_of(best) == "of the leaderboard mine: diffphysics, seed 0, score 3 m/s"
    path = replace(make_spec(), task=Ref("waypoint-following", 1))
    error = replace(best, spec=path, score=-0.02, unit="m", at_wall=True)
    assert words_of(error) == "of the leaderboard mine: diffphysics, seed 0, error 0.02 m, at a wall"
