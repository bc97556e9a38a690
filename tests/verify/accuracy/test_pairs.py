"""Pairs of gaits, of one body and of two."""

import math
from dataclasses import replace

import pytest

from tests.verify.accuracy.study import LIMITS, ladder, other_body, sample
from zoobench.accuracy.levels import LevelRow
from zoobench_verify.accuracy.analyse import analyse
from zoobench_verify.accuracy.pairs import NEIGHBOURS, deciding
from zoobench_verify.accuracy.records import Numbers, Sample


def rows(*others: Sample, draft: Numbers | None = None) -> dict[str, LevelRow]:
    """Levels by name."""
    return {row.fidelity: row for row in analyse(ladder(draft=draft, others=others)).levels}


def test_pairs_of_two_bodies_are_trained_alike() -> None:
    """Of 16 gaits each, of four trainings and stages, the four of one stage are compared with four, and none of the
    same body, though a training had no better gait at one stage; where they were found at another level, none."""
    panda = other_body((1.2, 1.15, 1.05), 0.55)
    panda = [
        replace(one, scores={gait.replace("d@3", "d@4"): score for gait, score in one.scores.items()}) for one in panda
    ]
    found = rows(*panda)["standard"]
    assert (found.one_body.pairs, found.two_bodies.pairs) == (192, 64)
    elsewhere = [replace(one, found="standard") for one in other_body((1.2, 1.15, 1.05), 0.55)]
    assert (rows(*elsewhere)["standard"].two_bodies.pairs, rows()["standard"].two_bodies.pairs) == (0, 0)


def test_a_level_may_reverse_bodies_and_no_gait_of_either() -> None:
    """At draft the panda is a tenth slower instead of faster: all orders of one body hold, those of two
    above a tenth."""
    found = rows(*other_body((1.2, 1.15, 1.05), 0.45))
    assert (found["draft"].one_body.ratio, found["standard"].one_body.ratio) == (1.0, 1.0)
    assert found["draft"].two_bodies.ratio == pytest.approx(1.0 / 0.9)
    assert found["standard"].two_bodies.ratio == 1.0


def test_orders_of_two_bodies_are_known_beyond_the_reference_alone() -> None:
    """A panda that loses 30 % on a grid finer yet is no longer known to be faster by a tenth."""
    panda = other_body((1.2, 1.15, 1.05), 0.55)
    best = max(LIMITS, key=LIMITS.__getitem__)
    finer = sample("fine", {best: 1.1 * 0.7 * LIMITS[best]}, design="panda")
    before, after = rows(*panda)["standard"], rows(*panda, finer)["standard"]
    assert before.two_bodies.ratio == 1.0
    assert after.two_bodies.ratio is None or after.two_bodies.ratio > 1.3
    assert (before.one_body.ratio, after.one_body.ratio) == (1.0, 1.0)


def test_what_decides_is_the_ratio_above_which_the_order_holds() -> None:
    """One wrong pair in twenty is borne, above 3; from 2.00 on each tenth is wrong, the second of them at 1.90."""
    pairs = [(3.0 + number / 100, number != 50) for number in range(95)]
    pairs += [(2.0 - number / 100, number % 10 > 0) for number in range(50)]
    assert deciding(pairs) == pytest.approx(1.91)
    assert deciding(pairs[:95]) == 1.0
    assert deciding([(ratio, not holds) for ratio, holds in pairs]) is None


def test_few_pairs_decide_nothing() -> None:
    """One fewer than enough, all of them right."""
    assert deciding([(2.0, True)] * (NEIGHBOURS - 1)) is None
    assert deciding([(2.0, True)] * NEIGHBOURS) == 1.0
    assert deciding([(math.inf, True)] * NEIGHBOURS + [(math.inf, False)] * NEIGHBOURS) is None
