"""One measurement of `bench`: what it says of itself."""

from typing import Any

import pytest

from zoobench.verify.bench import bench_case

JOB: dict[str, Any] = {
    "scene": "ground", "particle_count": 60, "precision": 32, "gradients": False, "device": "cpu",
    "frames": 1, "episode_substeps": 0, "repeats": 1, "only_compile": False,
}  # fmt: skip


@pytest.mark.parametrize(("told", "shown"), [(300 * 2**20, 300.0), (None, None)])
def test_memory_is_given_in_mebibytes(monkeypatch: pytest.MonkeyPatch, told: int | None, shown: float | None) -> None:
    """Of the bytes that the system tells; nothing where it tells none."""
    monkeypatch.setattr(bench_case, "peak_memory", lambda: told)
    assert bench_case.measure(JOB)["peak_memory_mib"] == shown
