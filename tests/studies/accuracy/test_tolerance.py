"""The cheapest fidelity that is accurate enough."""

from pathlib import Path

import pytest

from tests.studies.accuracy.study import TASK, ladder
from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench.studies.accuracy import tolerance


@pytest.fixture(autouse=True)
def _measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Made-up measurements of ground, published, in the place of those that come with the package."""
    tolerance.publish(ladder(), tmp_path / tolerance.PUBLISHED)
    monkeypatch.setattr(tolerance, "files", lambda package: tmp_path)
    tolerance.published.cache_clear()


def test_what_comes_with_the_package_can_be_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every environment has levels with errors and costs, and says which commit measured it."""
    monkeypatch.undo()
    tolerance.published.cache_clear()
    found = tolerance.published()
    tolerance.published.cache_clear()
    assert found.origin
    assert {Ref.parse(text).name for text in found.components} == set(registry.names(Kind.ENV))
    assert all(row.seconds for row in found.levels if row.fidelity in ("draft", "standard"))


def test_the_coarsest_level_within_the_tolerance_is_chosen() -> None:
    """The law's errors at 1/64 to 1/192 are 0.72, 0.48, 0.36 and 0.24, each uncertain by 1.25 x 0.24.

    Of four controllers, they are 2.37 times as large at most at 95 %: chi^2 with 4 degrees of freedom exceeds 0.7107
    then.
    """
    assert tolerance.choose(Ref("ground"), TASK, 1.8).fidelity == Ref("draft")
    chosen = tolerance.choose(Ref("ground"), TASK, 1.0)
    assert chosen.fidelity == Ref("paper")
    assert "error of 0.36 (below 0.85 at 95%" in chosen.reason
    assert "s per simulated second" in chosen.reason


def test_what_no_level_reaches_is_refused_with_the_best_figure() -> None:
    """The figure tells what could be asked for instead."""
    with pytest.raises(UsageError, match=r"fine with an error of 0\.24"):
        tolerance.choose(Ref("ground"), TASK, 0.1)


@pytest.mark.parametrize("env", ["ice", "ground[friction=0.1]"])
def test_what_was_not_measured_as_it_is_now_is_refused(env: str) -> None:
    """Another environment, or another ground."""
    with pytest.raises(UsageError, match="was not measured"):
        tolerance.choose(Ref.parse(env), TASK, 0.5)


def test_another_task_and_nonsense_are_refused() -> None:
    """With what to do instead."""
    with pytest.raises(UsageError, match="was not measured"):
        tolerance.choose(Ref("ground"), "turning", 0.5)
    with pytest.raises(UsageError, match="cannot be met"):
        tolerance.choose(Ref("ground"), TASK, -1.0)
