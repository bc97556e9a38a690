"""Pictures of the bodies that a run went through."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conformance.cells import cell
from tests.render.filmed import needs_drawing
from zoobench.cell.problem import Problem
from zoobench.db.rows import MilestoneRow
from zoobench.errors import UsageError
from zoobench.render.stages import MOST, chosen, stages_image, stages_of

SPEC = cell(design="voxel", controller="fixed-sine")


def milestones(*steps: int) -> list[MilestoneRow]:
    """Draws of the prior as what was found after these iterations."""
    problem = Problem(SPEC)
    rng = np.random.default_rng(0)
    return [MilestoneRow(step, 0.01 * step, tuple(problem.initial(rng).tolist())) for step in steps]


@pytest.mark.slow
def test_bodies_stand_side_by_side_with_iteration_and_score() -> None:
    """Above by muscles, below by stiffness; another body is another picture."""
    needs_drawing()
    found = stages_of(SPEC, milestones(1, 2), lambda score: f"{score} m/s")
    assert [stage[:2] for stage in found] == [("after 1 iteration", "0.01 m/s"), ("after 2 iterations", "0.02 m/s")]
    image, other = stages_image(found, "run 1"), stages_image([found[0], found[0]], "run 1")
    half = image.shape[0] // 2
    assert (image[:half] != other[:half]).any()
    assert (image[half:] != other[half:]).any()
    with pytest.raises(UsageError, match="no body"):
        stages_image([], "run 1")


def test_the_solution_comes_last_and_once() -> None:
    """What was found before the last iteration and stayed the best is shown as what the run ended with."""
    first, last = milestones(1, 2)
    assert [stage.words for stage in stages_of(SPEC, [first, last, replace(last, step=3)], str)] == [
        "after 1 iteration",
        "after 3 iterations",
    ]


def test_of_many_bodies_some_are_shown_from_first_to_last() -> None:
    """As many as fit a picture."""
    assert chosen(3) == [0, 1, 2]
    assert chosen(1) == [0]
    assert (chosen(20)[0], chosen(20)[-1], len(chosen(20))) == (0, 19, MOST)


def test_what_cannot_be_shown_is_refused() -> None:
    """A given body never changes, and of an earlier run only the solution is there; both say what to do."""
    with pytest.raises(UsageError, match="--strip gait"):
        stages_of(cell(), milestones(1, 2), str)
    with pytest.raises(UsageError, match="--rerun random"):
        stages_of(SPEC, milestones(1), str)
