"""The coarsest fidelity that is good enough."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.verify.accuracy.study import LIMITS, TASK, ladder, other_body, resolved
from zoobench.accuracy import levels, tolerance
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench_verify.accuracy.publishing import write_levels

GROUND, MOVING = Ref("ground"), Ref(TASK)
WRONG = {gait: 0.5 * score * (1.5 if number % 2 else 1.0) for number, (gait, score) in enumerate(LIMITS.items())}
"""Scores that are too low, and with a wrong order where two are nearer than 1.5 times."""


@pytest.fixture(autouse=True)
def _measured(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """Made-up measurements of ground, published, in the place of those that come with the package."""
    write_levels(ladder(WRONG), tmp_path / levels.PUBLISHED)
    monkeypatch.setattr(levels, "files", lambda package: tmp_path)
    levels.published.cache_clear()
    yield
    levels.published.cache_clear()  # or other tests would read them


def test_the_coarsest_level_within_the_tolerance_is_chosen() -> None:
    """Scores are off by 37 %, 10 and 5 %, with a reference known to 5 %: by 37 %, 11 and 7 % together."""
    assert tolerance.choose(GROUND, MOVING, 0.5, None).fidelity == Ref("draft")
    chosen = tolerance.choose(GROUND, MOVING, 0.12, None)
    assert chosen.fidelity == Ref("standard")
    assert (
        "standard with scores off by 0.11 (16 gaits of caterpillar, reference known to 0.05 by two transfers on"
        in chosen.reason
    )
    assert tolerance.choose(GROUND, MOVING, 0.11, None).fidelity == Ref("paper")


def test_the_coarsest_level_that_decides_is_chosen() -> None:
    """At draft, ratios below 1.25 have a wrong order; at the others none has."""
    assert tolerance.choose(GROUND, MOVING, None, 1.5).fidelity == Ref("draft")
    assert tolerance.choose(GROUND, MOVING, None, 1.01).fidelity == Ref("standard")
    assert tolerance.choose(GROUND, MOVING, 0.12, 1.5).fidelity == Ref("standard")


def test_what_a_level_decides_can_be_asked() -> None:
    """Of the very components that were measured."""
    place = resolved(Kind.ENV, "ground"), resolved(Kind.TASK, TASK)
    draft = resolved(Kind.FIDELITY, "draft")
    orders = tolerance.orders(*place, draft, False)
    assert orders is not None
    assert orders.ratio is not None
    assert 1.1 < orders.ratio < 1.5
    assert (orders.pairs, orders.bodies) == (96, ("caterpillar",))
    assert tolerance.orders(*place, draft, True) is None
    assert tolerance.orders(*place, resolved(Kind.FIDELITY, "draft[courant=0.25]"), False) is None
    assert tolerance.orders(resolved(Kind.ENV, "ice"), place[1], draft, False) is None
    assert tolerance.orders(Ref("gone", 3), place[1], draft, False) is None


def test_scores_of_two_bodies_need_gaits_of_two(tmp_path: Path) -> None:
    """With pairs of one body alone the question is refused; with a rival that draft overtakes, another level answers.

    At draft the panda is a tenth slower, elsewhere faster.
    """
    two = [Ref("panda"), Ref("caterpillar")]
    with pytest.raises(UsageError, match=r"No order of two bodies is known in .*: gaits of caterpillar were compared"):
        tolerance.choose(GROUND, MOVING, None, 1.1, two)
    write_levels(ladder(others=other_body((1.2, 1.15, 1.05), 0.45)), tmp_path / levels.PUBLISHED)
    levels.published.cache_clear()
    assert tolerance.choose(GROUND, MOVING, None, 1.1, two[:1]).fidelity == Ref("draft")
    chosen = tolerance.choose(GROUND, MOVING, None, 1.1, two)
    assert chosen.fidelity == Ref("standard")
    assert "ratios above 1 keep their order, by 64 pairs of two bodies: caterpillar, panda" in chosen.reason
    # a search in a design space compares bodies, too
    assert tolerance.choose(GROUND, MOVING, None, 1.1, [Ref("voxel")]).fidelity == Ref("standard")


def test_the_error_is_that_of_the_bodies_asked_for(tmp_path: Path) -> None:
    """The caterpillar is off by 50 % at draft, the panda by a few; one that was not measured, which is said, by what
    both are."""
    write_levels(ladder(others=other_body((1.4, 1.4, 1.3), 1.4)), tmp_path / levels.PUBLISHED)
    levels.published.cache_clear()
    chosen = {
        name: tolerance.choose(GROUND, MOVING, 0.4, None, [Ref(name)]) for name in ("panda", "caterpillar", "fish")
    }
    fidelities = {name: choice.fidelity.name for name, choice in chosen.items()}
    assert fidelities == {"panda": "draft", "caterpillar": "standard", "fish": "draft"}
    told = {name for name, choice in chosen.items() if "not measured there, and may be off" in choice.reason}
    assert told == {"fish"}
    worst = tolerance.choose(GROUND, MOVING, 0.4, None, [Ref("panda"), Ref("caterpillar")])
    assert worst.fidelity == Ref("standard")


def test_what_a_finer_level_does_not_reach_is_chance(tmp_path: Path) -> None:
    """The panda is nearer to its limit at draft than at standard, and draft is not chosen for it."""
    write_levels(ladder(others=other_body((1.5, 1.1, 1.08), 1.1)), tmp_path / levels.PUBLISHED)
    levels.published.cache_clear()
    assert tolerance.choose(GROUND, MOVING, 0.2, None, [Ref("panda")]).fidelity == Ref("paper")


def test_an_order_that_a_finer_level_does_not_keep_is_kept_by_chance(tmp_path: Path) -> None:
    """With ratios below 1.4, or any, in a wrong order at standard, draft does not decide them, either."""
    file = tmp_path / levels.PUBLISHED
    place = resolved(Kind.ENV, "ground"), resolved(Kind.TASK, TASK)
    for ratio, asked in ((1.4, 1.3), (None, 100.0)):
        document = json.loads(file.read_text(encoding="utf-8"))
        (standard,) = (row for row in document["levels"] if row["fidelity"] == "standard")
        standard["one_body"]["ratio"] = ratio
        file.write_text(json.dumps(document), encoding="utf-8")
        levels.published.cache_clear()
        orders = tolerance.orders(*place, resolved(Kind.FIDELITY, "draft"), False)
        assert orders is not None
        assert orders.ratio == ratio
        assert tolerance.choose(GROUND, MOVING, None, asked).fidelity == Ref("paper")


def test_an_error_of_the_reference_that_was_not_measured_is_told(tmp_path: Path) -> None:
    """With a panda that no second transfer judged; what was measured asks for nothing."""
    assert "to measure it" not in tolerance.choose(GROUND, MOVING, 0.5, 1.5).reason.lower()
    write_levels(ladder(others=other_body((1.2, 1.15, 1.05), 0.9)[:3]), tmp_path / levels.PUBLISHED)
    levels.published.cache_clear()
    reason = tolerance.choose(GROUND, MOVING, 0.5, None, [Ref("panda")]).reason
    assert "draft with scores off by 0.22 or more (32 gaits of caterpillar, panda, error of the reference not" in reason
    assert "How far paper itself is off was not measured" in reason
    assert "To measure it: zoobench verify accuracy run --env 'ground' --task movement-speed --levels" in reason
    assert reason.endswith(" draft,standard,paper --verify-at fine")


def test_what_no_level_reaches_is_refused_with_the_best_figure() -> None:
    """Of what was asked for."""
    with pytest.raises(
        UsageError, match=r"within 0\.01 in ground x movement-speed: the best is paper with scores off by 0\.071"
    ):
        tolerance.choose(GROUND, MOVING, 0.01, None)
    with pytest.raises(UsageError, match=r"within 0\.01 and sure of ratios above 1\.2"):
        tolerance.choose(GROUND, MOVING, 0.01, 1.2)


@pytest.mark.parametrize("env", ["ice", "ground[friction=0.1]"])
def test_what_was_not_measured_as_it_is_now_is_refused(env: str) -> None:
    """Another environment, or another ground."""
    with pytest.raises(UsageError, match="was not measured"):
        tolerance.choose(Ref.parse(env), MOVING, 0.5, None)


def test_another_task_and_nonsense_are_refused() -> None:
    """With advice."""
    with pytest.raises(UsageError, match="was not measured"):
        tolerance.choose(GROUND, Ref("turning"), 0.5, None)
    with pytest.raises(UsageError, match="cannot be met"):
        tolerance.choose(GROUND, MOVING, -1.0, None)
    with pytest.raises(UsageError, match="decides nothing"):
        tolerance.choose(GROUND, MOVING, None, 0.5)
