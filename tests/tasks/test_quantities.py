"""What scores are called when people read them."""

import pytest

from zoobench.spec import Ref
from zoobench.tasks.quantities import heading, quantity_of


@pytest.mark.parametrize(
    ("task", "score", "text"),
    [
        ("turning", -0.12345, "score -0.1235 m/s"),
        ("waypoint-following", -0.05, "error 0.05 m"),
        ("velocity-tracking", -0.05, "error 0.05 m/s"),
        ("final-position", 0.0, "error 0 m"),
        ("mix", 0.5, "score 0.5"),
        ("of a plug-in that is gone", -1.0, "score -1"),
    ],
)
def test_scores_of_paths_are_errors(task: str, score: float, text: str) -> None:
    """Positive ones, with their unit; none is minus zero."""
    assert quantity_of(Ref(task, 1)).text(score) == text


def test_a_column_of_both_says_so() -> None:
    """And one of nothing is of scores."""
    both = [quantity_of(Ref(task, 1)) for task in ("final-position", "turning")]
    assert [heading(both), heading(both[:1]), heading([])] == ["score or error", "error", "score"]
