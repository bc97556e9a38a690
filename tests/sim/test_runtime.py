"""Taichi's life in a process: start, restart, cache folder and its lock."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
import taichi as ti
import torch
from taichi.lang.kernel_impl import Func

from tests.sim import scenes
from zoobench.errors import UsageError
from zoobench.sim import runtime, taichi_patches
from zoobench.sim.solver import Solver


def test_start_is_idempotent_and_a_new_precision_a_new_generation() -> None:
    """A solver of the other precision must not be used again: what it still compiles would have wrong literals."""
    first = runtime.start(64)
    assert runtime.start(64) == first
    assert runtime.start(32) > first
    assert runtime.generation() == runtime.start(32)


def test_kernels_compute_in_the_precision_asked_for() -> None:
    """A literal in a kernel has the precision of the runtime."""
    for precision, kind in ((32, torch.float32), (64, torch.float64)):
        runtime.start(precision)
        assert runtime.real(precision) is kind
        assert ti.lang.impl.get_runtime().default_fp == (ti.f64 if precision == 64 else ti.f32)
        assert not ti.lang.impl.current_cfg().fast_math, "processors of different make would give different bits"


def test_kernels_outlive_another_precision_and_a_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver gives the same bits in a runtime that has had the other precision; nothing is compiled twice there."""
    compiled = []
    call = Func.__call__

    def noting(self: Func, *args: object, **kwargs: object) -> object:
        compiled.append(self.func.__name__)
        return call(self, *args, **kwargs)

    monkeypatch.setattr(Func, "__call__", noting)
    runtime.stop()
    paths, counts = [], []
    for precision in (32, 64, 32, 64):
        solver = Solver(scenes.ground_scene(), scenes.fidelity(precision))
        paths.append(solver.run(scenes.actuation(solver, 2)).positions)
        counts.append(len(compiled))
    assert 0 < counts[0] < counts[1] == counts[2] == counts[3]
    runtime.stop()
    solver = Solver(scenes.ground_scene(), scenes.fidelity(64))
    paths.append(solver.run(scenes.actuation(solver, 2)).positions)
    assert np.array_equal(paths[0], paths[2])
    assert np.array_equal(paths[1], paths[3])
    assert np.array_equal(paths[1], paths[4])
    assert not np.array_equal(paths[0], paths[1])


def test_missing_cuda_device_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything running is ended."""
    generation = runtime.start(64)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(UsageError, match="Use the device 'cpu'"):
        runtime.start(64, "cuda")
    assert runtime.start(64) == generation


@pytest.mark.parametrize("is_used", [True, False])
def test_fields_of_other_code_are_not_ended(is_used: bool) -> None:
    """A start of Taichi would end them, and their next use the process; declared ones count like those in use."""
    runtime.stop()
    ti.init(ti.cpu, log_level=ti.ERROR)
    try:
        field = ti.field(ti.f32, shape=3)
        if is_used:
            field.fill(2.0)
        with pytest.raises(UsageError, match="holds fields of other code"):
            runtime.start(32)
        if is_used:
            assert field.to_numpy().tolist() == [2.0] * 3
    finally:
        ti.reset()
    runtime.start(32)


def test_only_a_stale_lock_of_the_cache_is_dropped(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The lock of a killed process must not keep the cache shut; that of a living one stays."""
    monkeypatch.setenv("ZOOBENCH_CACHE", str(tmp_path))
    lock = runtime.kernel_folder() / "ticache.lock"
    lock.parent.mkdir(parents=True)
    runtime._drop_stale_lock()
    lock.touch()
    runtime._drop_stale_lock()
    assert lock.exists()
    old = time.time() - 2 * runtime.STALE_LOCK_SECONDS
    os.utime(lock, (old, old))
    runtime._drop_stale_lock()
    assert not lock.exists()


@ti.kernel
def _uses_a_name_that_is_not_there() -> ti.f32:
    return 2.0 * nowhere  # type: ignore[name-defined]  # noqa: F821


def test_an_error_in_a_kernel_quotes_its_line() -> None:
    """With the culprit underlined, though Taichi is not let quote each line of the kernels that are in order."""
    runtime.start(32)
    with taichi_patches.quickened(quotes=False), pytest.raises(ti.TaichiNameError) as raised:
        _uses_a_name_that_is_not_there()
    told = str(raised.value).strip().splitlines()
    assert told[0] == f'File "{__file__}", line {_line_of("2.0 * nowhere")}, in _uses_a_name_that_is_not_there:'
    assert "return 2.0 * nowhere" in told[1]
    assert told[2].strip() == "^" * len("nowhere")
    assert 'Name "nowhere" is not defined' in told[3]


def _line_of(text: str) -> int:
    lines = Path(__file__).read_text().splitlines()
    return next(number for number, line in enumerate(lines, 1) if text in line)
