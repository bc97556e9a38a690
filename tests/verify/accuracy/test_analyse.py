"""The analysis, judged on measurements that follow known laws."""

import math
from dataclasses import replace

import pytest

from tests.verify.accuracy.study import LEVELS, LIMITS, TWIN, ladder, sample, scaled
from zoobench.accuracy.levels import LevelRow
from zoobench.spec import Ref
from zoobench_verify.accuracy.analyse import analyse
from zoobench_verify.accuracy.records import RANDOM, Measurements


def rows(measurements: Measurements) -> dict[str, LevelRow]:
    """Levels and knobs by name."""
    found = analyse(measurements)
    return {row.fidelity: row for row in (*found.levels, *found.knobs)}


def test_the_reference_is_the_mean_of_two_transfers_at_the_finest_level() -> None:
    """5 % above and below the limits: the reference is the limit, known to 5 %, and so far is the level from it."""
    found = rows(ladder())
    assert list(found) == ["draft", "standard", "paper"]
    assert [row.error for row in found.values()] == pytest.approx([0.5, 0.1, 0.05])
    assert [row.unknown for row in found.values()] == pytest.approx([0.05] * 3)
    assert (found["draft"].gaits, found["draft"].runs, found["draft"].checked) == (16, 4, 0)
    assert found["draft"].bodies == {"caterpillar": pytest.approx(math.hypot(0.5, 0.05))}


def test_the_finest_level_alone_is_not_its_own_judge() -> None:
    """Without a second transfer, its error and what it decides are unknown, and so is the reference's uncertainty."""
    found = rows(Measurements(ladder().samples[:3]))
    assert (found["paper"].error, found["paper"].one_body.ratio, found["paper"].unknown) == (None, None, None)
    assert found["draft"].error == pytest.approx(1 - 0.5 / 1.05)


def test_a_transfer_that_changes_nothing_judges_nothing() -> None:
    """In water the twin of the finest level is that level itself: its error is not zero, but unknown."""
    *levels, twin = ladder().samples
    found = rows(Measurements((*levels, replace(twin, scores=levels[-1].scores))))
    assert (found["paper"].error, found["paper"].unknown) == (None, None)


def test_a_few_gaits_on_a_finer_grid_judge_the_reference() -> None:
    """It stays what it is; it is uncertain by the farther of the other transfer and the finer grid."""
    best = max(LIMITS, key=LIMITS.__getitem__)
    found = rows(ladder(others=[sample("fine", {best: 0.8 * LIMITS[best]})]))
    assert [found[name].error for name in LEVELS] == pytest.approx([0.5, 0.1, 0.05])
    assert found["fine"].error is None
    assert [row.unknown for row in found.values()] == pytest.approx([0.2] * 4)
    assert (found["draft"].checked, found["draft"].bodies["caterpillar"]) == (1, pytest.approx(math.hypot(0.5, 0.2)))


def test_gaits_are_followed_from_where_they_were_found() -> None:
    """Half as good at draft: twice as good at the finest; of gaits found elsewhere no level knows what they keep."""
    found = analyse(ladder(others=[sample("draft", {"e@0": 0.04}, found="standard")]))
    assert {(row.found, row.evaluated): row.ratio for row in found.matrix} == pytest.approx(
        {("draft", "draft"): 1.0, ("draft", "standard"): 2.2, ("draft", "paper"): 2.1}
    )
    levels = {row.fidelity: row for row in found.levels}
    assert levels["draft"].transfer == pytest.approx(2.0)
    assert levels["draft"].median == levels["draft"].low == pytest.approx(0.5)
    assert levels["standard"].transfer is None


def test_designs_count_alike_whatever_their_speed() -> None:
    """Errors of 50 and 10 % at draft, of a slow animal and one a hundred times as fast."""
    fast = [
        sample(str(one.fidelity), scaled(factor), design="panda")
        for one, factor in zip(ladder().samples, (110.0, 100.0, 100.0, 100.0), strict=True)
    ]
    found = rows(ladder(others=fast))["draft"]
    assert found.error == pytest.approx(math.sqrt((0.5**2 + 0.1**2) / 2))
    assert (list(found.bodies), found.gaits) == (["caterpillar", "panda"], 32)


def test_a_diverged_gait_is_left_out() -> None:
    """It has no score; neither the reference nor the errors of the others suffer."""
    rest = {gait: score for gait, score in scaled(0.5).items() if gait != "a@0"}
    found = rows(ladder(draft=rest))["draft"]
    assert found.error == pytest.approx(0.5)
    assert found.gaits == 15


def test_gaits_that_go_nowhere_do_not_spoil_ratios() -> None:
    """A gait with a thousandth of the best score, and of another sign at draft."""
    still = {one.fidelity: sample(str(one.fidelity), {"e@0": 1e-4}) for one in ladder().samples}
    still[ladder().samples[0].fidelity] = sample("draft", {"e@0": -1e-3})
    found = rows(ladder(others=list(still.values())))["draft"]
    assert found.low == pytest.approx(0.5)


def test_pairs_of_one_training_do_not_count() -> None:
    """Of 16 gaits of four trainings there are 120 pairs, and 24 of them are of one training."""
    assert rows(ladder())["draft"].one_body.pairs == 96
    assert rows(ladder())["draft"].one_body.ratio == 1.0


def test_the_finest_level_is_held_against_its_other_transfer() -> None:
    """Which reverses the order of all neighbours: the mean of both, in which it has a share, would not tell."""
    twin = {gait: score * (1.3 if number % 2 else 1.0) for number, (gait, score) in enumerate(LIMITS.items())}
    samples = (*ladder().samples[:3], sample(TWIN, twin))
    found = rows(Measurements(samples))["paper"].one_body.ratio
    assert found is not None
    assert found > 1.1


def test_a_level_that_reverses_orders_needs_larger_ratios() -> None:
    """Every second gait is 1.5 times too good at draft: neighbours, a fifth apart, change places."""
    wrong = {gait: score * (1.5 if number % 2 else 1.0) for number, (gait, score) in enumerate(LIMITS.items())}
    found = rows(ladder(draft=wrong))
    assert found["standard"].one_body.ratio == 1.0
    assert found["draft"].one_body.ratio is not None
    assert found["draft"].one_body.ratio == pytest.approx(1.5 / 1.2)


def negated(measurements: Measurements) -> Measurements:
    """The same with scores that are errors."""
    return replace(
        measurements,
        samples=tuple(replace(one, scores=scaled(-1.0, one.scores)) for one in measurements.samples),
    )


def test_errors_keep_their_order_as_gains_do() -> None:
    """Scores below zero, where zero is perfect, have the same errors and decide by the same ratios."""
    wrong = {gait: score * (1.5 if number % 2 else 1.0) for number, (gait, score) in enumerate(LIMITS.items())}
    gains, errors = rows(ladder(draft=wrong)), rows(negated(ladder(draft=wrong)))
    for name, gain in gains.items():
        assert (errors[name].error, errors[name].unknown) == (gain.error, gain.unknown)
        assert (errors[name].one_body.ratio, errors[name].one_body.pairs) == (
            pytest.approx(gain.one_body.ratio),
            gain.one_body.pairs,
        )
    assert errors["draft"].one_body.ratio == pytest.approx(1.5 / 1.2)


def test_an_error_that_hardly_counts_is_a_good_one() -> None:
    """The gait with a thousandth of the largest error is the best of all, and has a share in the ratios."""
    best = {one.fidelity: sample(str(one.fidelity), {"e@0": 1e-4}) for one in ladder().samples}
    best[ladder().samples[0].fidelity] = sample("draft", {"e@0": 1e-3})
    found = rows(negated(ladder(others=list(best.values()))))["draft"]
    assert (found.gaits, found.high) == (17, pytest.approx(0.5))
    assert found.one_body.pairs == 112


def test_gradients_are_compared_with_those_of_the_finest_level_that_has_them() -> None:
    """One turned by 0.1 rad, of any length, and one that the other level lacks."""
    samples = list(ladder().samples)
    samples[0] = replace(samples[0], slopes={"a@0": [2 * math.cos(0.1), 2 * math.sin(0.1)], "b@0": [1.0, 0.0]})
    samples[1] = replace(samples[1], slopes={"a@0": [1.0, 0.0]})
    found = rows(Measurements(tuple(samples)))
    assert found["draft"].angle == pytest.approx(1 - math.cos(0.1))
    assert (found["standard"].angle, found["paper"].angle) == (None, None)


def test_costs_are_those_of_a_simulated_second() -> None:
    """Two seconds for an episode of 0.8 s, six with gradient."""
    short = Measurements(tuple(replace(one, frames=100) for one in ladder().samples))
    found = rows(short)["draft"]
    assert (found.seconds, found.gradient_seconds) == (pytest.approx(2.5), pytest.approx(7.5))
    assert (found.memory, found.particles, found.substeps) == (1.0, 500, 1000.0)


def test_knobs_and_random_controllers_stand_apart() -> None:
    """A knob is judged by the gaits' references; draws have references of their own."""
    drawn = {f"{number}@0": 0.001 * number for number in range(1, 9)}
    others = [sample("draft[courant=0.9]", scaled(0.8))]
    others += [sample(str(one.fidelity), drawn, found=RANDOM) for one in ladder().samples]
    found = analyse(ladder(others=others))
    assert [(row.fidelity, pytest.approx(row.error)) for row in found.knobs] == [("draft[courant=0.9]", 0.2)]
    assert [row.error for row in found.random] == [0.0, 0.0, None]  # the twin says the same, and judges nothing
    assert [row.gaits for row in found.levels] == [16, 16, 16]


def test_former_versions_and_shorter_episodes_are_left_out() -> None:
    """A level measured with an older environment, and one of a quick check."""
    one = sample("draft", scaled(9.0))
    old = replace(one, env=Ref(one.env.name, one.env.version - 1, one.env.params))
    found = rows(ladder(others=[old, replace(one, frames=10)]))
    assert found["draft"].error == pytest.approx(0.5)
