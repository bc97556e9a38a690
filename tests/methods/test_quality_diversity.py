"""Quality diversity: the archive holds the best evaluated body of every cell."""

import sys

import numpy as np
import pytest

from tests.methods.toy import OPTIMUM, Context, Quadratic, shape_of
from zoobench.errors import UsageError
from zoobench.methods.quality_diversity import QualityDiversity
from zoobench.render.elites import cells_of
from zoobench.spec import Budget


def test_the_archive_holds_the_best_of_every_kind() -> None:
    """Facts and elites agree with a table of all evaluations, some of which failed."""
    problem = Quadratic(Budget("episodes", 500), diverges=lambda params: bool(params[3] > 2.2))
    solution = QualityDiversity(cells=20).run(problem, Context(1))  # type: ignore[arg-type]
    best: dict[tuple[int, ...], float] = {}
    for params in problem.seen:
        if params[3] <= 2.2:
            cell = tuple(np.floor(20.0 * np.array(shape_of(params))).astype(int))
            score = 1.0 - float(((params - OPTIMUM) ** 2).sum())
            best[cell] = max(best.get(cell, -np.inf), score)
    assert solution.facts["elites"] == len(best) > 20
    assert solution.facts["coverage"] == len(best) / 400
    assert solution.facts["qd_score"] == pytest.approx(sum(max(score, 0.0) for score in best.values()))
    assert solution.evaluation.score == max(best.values())
    assert solution.facts["diverged_evaluations"] > 0
    found = solution.archive
    assert found is not None
    cells = [tuple(cell) for cell in cells_of(found).tolist()]
    assert dict(zip(cells, found.scores.tolist(), strict=True)) == best
    assert len(cells) == len(best)
    assert (np.diff(found.scores) <= 0.0).all()
    np.testing.assert_array_equal(found.params[0], solution.params)
    for params, measures in zip(found.params, found.measures, strict=True):
        np.testing.assert_array_equal(measures, shape_of(params))


@pytest.mark.slow
def test_it_finds_good_ones_and_many_kinds() -> None:
    """On the quadratic problem: nearly the optimum, and a large share of the cells."""
    solution = QualityDiversity(cells=20).run(Quadratic(Budget("episodes", 2000)), Context(1))  # type: ignore[arg-type]
    assert solution.evaluation.score > 0.8
    assert solution.facts["coverage"] > 0.3


def test_a_fixed_body_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """There is nothing to collect."""
    problem = Quadratic(Budget("episodes", 20))
    monkeypatch.setattr(problem.robot, "space", None)
    with pytest.raises(UsageError, match="Choose a design space"):
        QualityDiversity().run(problem, Context())  # type: ignore[arg-type]


def test_without_pyribs_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """No traceback."""
    monkeypatch.setitem(sys.modules, "ribs.archives", None)
    with pytest.raises(UsageError, match=r"zoobench\[qd\]"):
        QualityDiversity().run(Quadratic(Budget("episodes", 20)), Context())  # type: ignore[arg-type]
