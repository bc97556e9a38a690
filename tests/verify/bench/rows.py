"""Rows of `bench` for the tests, made and not measured."""

from typing import Any

from zoobench_verify.bench.bench_rows import BenchResults, CostRow, RateRow, RunShare


def rate_row(scene: str = "ground", asked: int = 10_000, forward: float = 6.0, **values: Any) -> RateRow:
    """A case whose backward pass takes twice its forward pass, at half of the C++ reference's rate."""
    fields: dict[str, Any] = {
        "scene": scene, "asked": asked, "particle_count": asked - 4, "robot_particle_count": asked - 4, "worlds": 1,
        "precision": 32, "device": "cpu", "frames": 4, "substeps": 224, "backward_over_forward": 2.0, "recomputed": 0.0,
        "forward_cpu_s": 0.4, "forward_wall_s": 0.5, "both_cpu_s": 1.2, "both_wall_s": 1.3, "reference_mps": 12.0,
    }  # fmt: skip
    for name, rate in (("forward", forward), ("reverse", forward / 2), ("both", forward / 3)):
        fields |= {f"{name}_mps": rate, f"{name}_mps_min": 0.9 * rate, f"{name}_mps_max": 1.1 * rate}
    return RateRow(**(fields | values))


def cost_row(scene: str = "ground", asked: int = 10_000, **values: Any) -> CostRow:
    """The costs of such a case."""
    fields: dict[str, Any] = {
        "scene": scene, "asked": asked, "particle_count": asked - 4, "worlds": 1, "precision": 32, "device": "cpu",
        "advance_launch_us": 100.0, "reverse_launch_us": 200.0, "advance_cold_s": 1.0, "reverse_cold_s": 4.0,
        "compile_cold_s": 6.0, "advance_cached_s": 0.2, "reverse_cached_s": 0.4, "compile_cached_s": 0.8,
        "peak_memory_mib": 300.0,
    }  # fmt: skip
    return CostRow(**(fields | values))


def run_share(command: str = "--env ground --task turning", cpu_s: float = 100.0, **values: Any) -> RunShare:
    """A run that spends three quarters of its processor time in kernels."""
    fields: dict[str, Any] = {
        "command": command, "processes": 4, "cpu_s": cpu_s, "wall_s": 60.0, "advance_s": 0.5 * cpu_s,
        "reverse_s": 0.25 * cpu_s, "survey_s": 0.01 * cpu_s, "launching_s": 0.04 * cpu_s, "loading_s": 0.1 * cpu_s,
        "rest_s": 0.1 * cpu_s, "kernel_share": 0.75,
    }  # fmt: skip
    return RunShare(**(fields | values))


def results(**values: Any) -> BenchResults:
    """A small set of results on one machine."""
    fields: dict[str, Any] = {
        "machine": {"cpu": {"model": "A", "cores": 2}},
        "rates": (rate_row(), rate_row("ice", 1000, reference_mps=None, reverse_mps=None)),
        "costs": (cost_row(), cost_row("ice", 1000, peak_memory_mib=None)),
        "runs": (run_share(),),
    }
    return BenchResults(**(fields | values))
