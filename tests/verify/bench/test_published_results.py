"""The results in the folder `benchmarks`, of which docs/performance.md tells."""

from pathlib import Path

import pytest

from zoobench_verify.bench.bench_rows import read

ROOT = Path(__file__).parents[3]
FILES = sorted((ROOT / "benchmarks").glob("*.json"))


def test_there_are_results() -> None:
    """From before the simulator was made faster, at least."""
    assert any(path.name.startswith("before") for path in FILES)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_published_results_can_be_compared_with(path: Path) -> None:
    """`zoobench verify bench --against` reads them; they say where they come from and not on whose machine."""
    results = read(path)
    assert results.rates or results.runs
    assert {"measured", "code", "cpu", "packages"} <= results.machine.keys()
    assert "host" not in results.machine
    assert path.stat().st_size < 100_000
