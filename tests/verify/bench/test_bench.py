"""Cases are measured one after the other, each in processes of its own."""

from dataclasses import asdict
from typing import Any

import pytest

from zoobench_verify.bench import bench as module
from zoobench_verify.bench.bench import BenchCase, bench
from zoobench_verify.bench.bench_case import measure


@pytest.mark.parametrize("frames", [0, 1])
def test_a_case_gives_a_row_of_rates_and_one_of_costs(frames: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the episodes that were measured, whose length may have been left to the measurement."""
    case = BenchCase("ground", 60, repeats=1, frames=frames)

    def here(case: BenchCase, _cache: str, *, only_compile: bool) -> dict[str, Any]:
        return measure(asdict(case) | {"only_compile": only_compile})

    monkeypatch.setattr(module, "_run_case", here)
    ((rate, cost),) = list(bench([case]))
    assert (rate.scene, rate.asked, cost.scene) == ("ground", 60, "ground")
    assert rate.frames == frames if frames else rate.frames > 1
    assert rate.forward_mps > 0
    assert rate.both_mps is not None
