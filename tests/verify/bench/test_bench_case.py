"""One measurement of `bench`: what it says of itself."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from zoobench.cell.driving import travelling_wave
from zoobench.sim.solver import Solver
from zoobench_verify.bench import bench_case
from zoobench_verify.bench.bench import BenchCase

Measure = Callable[..., dict[str, Any]]
CASE = BenchCase("ground", 60, repeats=1)


@pytest.fixture
def measure(monkeypatch: pytest.MonkeyPatch) -> Measure:
    """Measure a small case; an episode is a frame or two."""
    monkeypatch.setattr(bench_case, "_LONGEST_EPISODE", 2)

    def run(only_compile: bool = False, **changes: Any) -> dict[str, Any]:
        return bench_case.measure(dataclasses.asdict(CASE) | changes | {"only_compile": only_compile})

    return run


@pytest.mark.parametrize(("told", "shown"), [(300 * 2**20, 300.0), (None, None)])
def test_memory_is_given_in_mebibytes(
    measure: Measure, monkeypatch: pytest.MonkeyPatch, told: int | None, shown: float | None
) -> None:
    """Of the bytes that the system tells; nothing where it tells none."""
    monkeypatch.setattr(bench_case, "peak_memory", lambda: told)
    assert measure(gradients=False, only_compile=True)["peak_memory_mib"] == shown


def test_a_case_without_gradients_has_no_reverse(measure: Measure) -> None:
    """Neither its rate nor its launch nor its compilation; the forward rate has a spread."""
    found = measure(gradients=False, repeats=3)
    rate = found["rate"]
    assert 0 < rate["forward_mps_min"] <= rate["forward_mps"] <= rate["forward_mps_max"]
    assert (rate["reverse_mps"], rate["both_mps"], rate["backward_over_forward"]) == (None, None, None)
    assert (found["launch"]["reverse"], found["compile"]["reverse"]) == (None, None)
    assert found["launch"]["advance"] > 0


def test_rates_are_work_by_the_clock(measure: Measure, monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by a second whenever it is read: an episode and each launch in it take the same."""
    ticks = iter(range(10**9))
    monkeypatch.setattr(bench_case, "work_clock", lambda _: lambda: float(next(ticks)))
    found = measure(worlds=2)
    rate, launches = found["rate"], 4  # the clock is read before and after each launch, too
    assert rate["frames"] == 2
    work = rate["substeps"] * rate["particle_count"] / 1e6
    assert rate["substeps"] % 2 == 0
    assert rate["forward_mps"] == pytest.approx(work / rate["forward_cpu_s"])
    assert rate["both_mps"] == pytest.approx(work / rate["both_cpu_s"])
    assert rate["forward_cpu_s"] >= launches
    assert rate["reverse_mps"] == pytest.approx(work / 2)  # one launch of a second for each frame
    assert rate["backward_over_forward"] > 0
    assert found["launch"] == {"advance": 1.0, "reverse": 1.0}
    assert found["compile"]["compile"] == pytest.approx(0.0)


def test_the_work_is_that_of_all_worlds(measure: Measure) -> None:
    """Twice as many worlds take twice as many substeps together."""
    one, two = (measure(gradients=False, worlds=worlds, frames=1)["rate"]["substeps"] for worlds in (1, 2))
    assert two == 2 * one > 0


def test_the_length_of_an_episode_can_be_chosen(measure: Measure) -> None:
    """Else it is as long as it must be to have enough work, within the length of a run's episodes."""
    assert measure(gradients=False, frames=3)["rate"]["frames"] == 3
    assert measure(gradients=False)["rate"]["frames"] == 2


def test_the_reference_is_measured_in_turn(measure: Measure, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once for every repeat, of which the median stands beside the rates; not without a program."""
    rates = iter([9.0, 12.0, 10.0])
    monkeypatch.setattr(bench_case.cpp_reference, "rate", lambda _: next(rates))
    assert measure(gradients=False, repeats=3, reference="program")["rate"]["reference_mps"] == 10.0
    assert measure(gradients=False)["rate"]["reference_mps"] is None


def test_a_long_frame_is_shortened(measure: Measure, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a million particles are measured in seconds, too: the work of an episode stays about the same."""
    usual = measure(gradients=False)["rate"]
    monkeypatch.setattr(bench_case, "_FRAME_WORK", 2 * usual["particle_count"])
    shortened = measure(gradients=False)["rate"]
    assert shortened["substeps"] < usual["substeps"]


def test_a_wide_arena_is_cut_around_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """A million particles on open ground would need a grid too large to hold; the robot does not notice."""
    whole, fidelity = bench_case.build_scene("ground", 60, 64)
    monkeypatch.setattr(bench_case, "_LARGEST_ARENA", 1000)
    cut, _ = bench_case.build_scene("ground", 60, 64)
    widths = [np.subtract(scene.upper, scene.lower) for scene in (whole, cut)]
    assert (widths[1] < widths[0]).all()
    assert (widths[1] < np.ptp(whole.robot.positions, axis=0) + 0.2 + 2 * fidelity.grid_spacing).all()
    assert cut.lower[1] == whole.lower[1]
    wave = travelling_wave(2, whole.robot.muscle_count)
    ends = [Solver(scene, fidelity).run(wave).positions[-1] for scene in (whole, cut)]
    assert np.abs(ends[0] - ends[1]).max() < 1e-9
    assert np.abs(ends[0][0] - whole.robot.positions).max() > 1e-5


def test_an_arena_of_a_medium_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its bed reaches from wall to wall."""
    monkeypatch.setattr(bench_case, "_LARGEST_ARENA", 10)
    scene, _ = bench_case.build_scene("desert", 100, 32)
    assert scene.medium is not None
    assert scene.medium.positions[:, 0].max() > 0.9 * scene.upper[0]
