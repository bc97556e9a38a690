"""Growth and ratios, from results that are known."""

import pytest

from tests.verify.bench.rows import cost_row, rate_row, results, run_share
from zoobench_verify.bench.comparison import exponent, growth, ratios, run_ratios


@pytest.mark.parametrize("power", [0.8, 1.0, 1.5])
def test_the_exponent_is_the_slope_of_the_logarithms(power: float) -> None:
    """Whatever the factor."""
    sizes = [300, 10_000, 1_000_000]
    assert exponent(sizes, [3e-7 * size**power for size in sizes]) == pytest.approx(power)


def test_growth_is_that_of_a_substeps_time() -> None:
    """A constant rate is linear growth; one that falls by half at a hundred times as many particles is not."""
    rows = [rate_row(asked=1004, particle_count=1000), rate_row(asked=100_004, particle_count=100_000, both_mps=1.0)]
    forward, both = growth(rows)
    assert (forward.direction, forward.fewest, forward.most) == ("forward", 1000, 100_000)
    assert forward.exponent == pytest.approx(1.0)
    assert both.exponent == pytest.approx(1.0 + 0.5 * 0.30103)


def test_growth_needs_two_sizes_of_one_scene_in_one_precision() -> None:
    """And gradients at both for that of both directions."""
    assert growth([rate_row(), rate_row("ice", 500), rate_row(asked=500, precision=64)]) == []
    (row,) = growth([rate_row(), rate_row(asked=500, both_mps=None)])
    assert row.direction == "forward"


def test_ratios_are_new_by_old() -> None:
    """Rates, costs and runs of the same cases; what one of them lacks is left out."""
    new = results(
        rates=(rate_row(forward=15.0, reverse_mps=9.0), rate_row("snow")),
        costs=(cost_row(compile_cold_s=3.0, advance_launch_us=50.0, reverse_launch_us=None),),
        runs=(run_share(cpu_s=40.0, kernel_share=0.9), run_share("--env ice")),
    )
    (row,) = ratios(new, results())
    assert (row.scene, row.asked) == ("ground", 10_000)
    assert (row.forward, row.reverse, row.both) == pytest.approx((2.5, 3.0, 2.5))
    assert (row.compile_cold, row.advance_launch, row.reverse_launch) == (0.5, 0.5, None)
    (run,) = run_ratios(new, results())
    assert (run.cpu, run.kernel_share_old, run.kernel_share_new) == (0.4, 0.75, 0.9)


@pytest.mark.parametrize("other", [{"precision": 64}, {"worlds": 2}, {"device": "cuda"}, {"asked": 9999}])
def test_other_cases_are_not_compared(other: dict[str, int]) -> None:
    """Neither another precision nor another number of particles or worlds."""
    assert ratios(results(rates=(rate_row(**other),)), results()) == []


def test_rates_of_two_machines_are_compared_by_the_reference() -> None:
    """Twice the rate on a machine that is twice as fast is no gain."""
    new = results(rates=(rate_row(forward=12.0, reference_mps=24.0),))
    (row,) = ratios(new, results())
    assert (row.forward, row.forward_calibrated, row.both_calibrated) == pytest.approx((2.0, 1.0, 1.0))
    (bare,) = ratios(results(rates=(rate_row(reference_mps=None),)), results())
    assert (bare.forward, bare.forward_calibrated) == (1.0, None)
