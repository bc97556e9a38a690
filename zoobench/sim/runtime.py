"""Taichi's runtime in this process: one for both precisions, stopped so that the compile cache is written."""

import atexit
import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import taichi as ti
import torch
from taichi.lang import impl

from zoobench.errors import UsageError
from zoobench.files import cache_folder
from zoobench.sim import taichi_patches
from zoobench.sim.model.fidelity import Device

STALE_LOCK_SECONDS = 60.0

_started: tuple[int, Device, bool] | None = None
_program: Any = None  # Taichi's, which another `ti.init` in this process ends
_generation = 0
_is_forked = False


def _note_fork() -> None:
    """In a forked process: the runtime lives on in its parent, whose threads it needs."""
    global _is_forked
    _is_forked = _started is not None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)


def kernel_folder() -> Path:
    """The folder of compiled kernels."""
    return cache_folder() / "kernels"


def start(precision: int, device: Device = "cpu", debug: bool = False, cache: bool = True) -> int:
    """Start Taichi for one precision and device, unless it is running so.

    Another precision on the same device keeps the runtime, and with it the kernels that were compiled for the other: a
    kernel is known by the types of its arrays, which are those of the precision.

    On the CPU with one thread only: the sums of two threads on one grid node would depend on their order.
    With `debug`, or ZOOBENCH_DEBUG in the environment, every access to an array is checked against its bounds.

    Returns:
        the generation of the runtime: a solver made under an older one must not be used again.

    Raises:
        UsageError: a CUDA device was asked for and none is available, this process was forked from one in which
            Taichi was running, or somebody else's fields would be lost.
    """
    global _started, _generation, _program
    _notice_others()
    wanted = (precision, device, debug or bool(os.environ.get("ZOOBENCH_DEBUG")))
    if _is_forked:
        raise UsageError(
            "This process was forked from one that had simulated already, and Taichi would wait for ever for threads "
            "that were left there. Start processes by 'spawn' or 'forkserver', as in gymnasium.make_vec(..., "
            "vectorization_mode='async', vector_kwargs={'context': 'forkserver'}), or before the first simulation."
        )
    if _started == wanted:
        return _generation
    check_device(device)
    if _started is not None and _started[1:] == wanted[1:]:
        _compute_in(precision)
    else:
        _spare_fields()
        stop()
        torch.set_num_threads(1)
        if cache:
            _drop_stale_lock()
        if not _generation:
            atexit.register(stop)
        with contextlib.redirect_stdout(None):  # Taichi prints to standard output, which is reserved for data
            _initialise(*wanted, cache)
    _started, _program = wanted, impl.get_runtime().prog
    _generation += 1
    return _generation


def _notice_others() -> None:
    """Where somebody else has started Taichi since, the runtime of before has ended."""
    global _started, _generation
    if _started is not None and impl.get_runtime().prog is not _program:
        _started = None
        _generation += 1


def _spare_fields() -> None:
    """Raise a `UsageError` where other code has fields, which a start of Taichi would end: their next use crashes."""
    runtime = impl.get_runtime()
    trees = range(0 if runtime.prog is None else runtime.prog.get_snode_tree_size())
    if runtime.global_vars or any(runtime.prog.get_snode_root(tree).get_num_ch() for tree in trees):
        raise UsageError(
            "Taichi holds fields of other code in this process, and would lose them where zoobench starts it with its "
            "own settings. Use zoobench in a process of its own, or keep your data in arrays (ti.types.ndarray())."
        )


def check_device(device: Device) -> None:
    """Raise a `UsageError` if this machine has no such device."""
    if device == "cuda" and not torch.cuda.is_available():
        raise UsageError(
            "No CUDA device is available: there is none on this machine, or this PyTorch is a build without CUDA. Use "
            "the device 'cpu'."
        )


def _initialise(precision: int, device: Device, debug: bool, cache: bool) -> None:
    ti.init(
        arch=ti.cuda if device == "cuda" else ti.cpu,
        # without this every literal in a kernel is a 32-bit number, also among 64-bit ones
        default_fp=_literals(precision),
        cpu_max_num_threads=1,
        # fast math may assume that no NaN exists, and the survey of a diverging simulation looks for them
        fast_math=False,
        # the optimisation over the control-flow graph triples the compile time and gains nothing measurable
        cfg_optimization=False,
        # the compiler of a processor finds nearly all that Taichi's own optimisation does, in a third of the time
        advanced_optimization=device == "cuda",
        debug=debug,
        offline_cache=cache,
        offline_cache_file_path=str(kernel_folder()),
        log_level=ti.ERROR,
    )


def _compute_in(precision: int) -> None:
    """Kernels compiled from now on have literals of this precision."""
    impl.get_runtime().set_default_fp(_literals(precision))
    impl.current_cfg().default_fp = _literals(precision)


def _literals(precision: int) -> Any:
    return ti.f64 if precision == 64 else ti.f32


def quick_compilation() -> contextlib.AbstractContextManager[None]:
    """Kernels first called within go through the quick front end, which quotes sources where bounds are checked."""
    return taichi_patches.quickened(quotes=not repeats_launches())


@contextlib.contextmanager
def vector_lanes(*, optimised: bool = False) -> Iterator[None]:
    """Kernels first called within are compiled to vector instructions, one for each vector of four lanes, and quickly.

    Taichi would take vectors apart into scalars, of which the compiler finds only some again. It asks for the settings
    when it compiles, and keeps kernels of both kinds apart in its cache.

    Args:
        optimised: let Taichi itself optimise, too, before the compiler does, unless ZOOBENCH_QUICK_COMPILE is in the
            environment: that takes longest of all compiling, and changes no bit of what is computed.
    """
    settings = impl.current_cfg()
    if settings.arch == ti.cuda:  # whose threads have scalars
        with quick_compilation():
            yield
        return
    usual = settings.real_matrix_scalarize, settings.advanced_optimization
    optimised = optimised and not os.environ.get("ZOOBENCH_QUICK_COMPILE")
    settings.real_matrix_scalarize, settings.advanced_optimization = False, optimised
    try:
        with quick_compilation():
            yield
    finally:
        settings.real_matrix_scalarize, settings.advanced_optimization = usual


def _drop_stale_lock() -> None:
    """Remove the cache's lock if its owner was killed: Taichi would never write the cache again.

    The lock is held for milliseconds, while the list of compiled kernels is written.
    """
    lock = kernel_folder() / "ticache.lock"
    with contextlib.suppress(FileNotFoundError):
        if time.time() - lock.stat().st_mtime > STALE_LOCK_SECONDS:
            lock.unlink()


def generation() -> int:
    """Number of starts and stops of the runtime so far; equal numbers mean the same runtime."""
    _notice_others()
    return _generation


def repeats_launches() -> bool:
    """Whether a prepared launch may be repeated: without checks of bounds."""
    return _started is not None and not _started[2]


def keeps_contexts() -> bool:
    """Whether what was prepared for a launch serves others, too, as on the CPU."""
    return _started is not None and _started[1] == "cpu"


def stop() -> None:
    """End the runtime, as the end of the process does too.

    Taichi writes compiled kernels into the cache only then.
    """
    global _started, _generation
    _notice_others()
    if _started is None or _is_forked:
        return
    ti.reset()
    _started = None
    _generation += 1


def real(precision: int) -> torch.dtype:
    """The tensor type of every real number of a simulation."""
    return torch.float64 if precision == 64 else torch.float32


def host_real(kind: torch.dtype) -> type[np.floating]:
    """The NumPy type of the same precision."""
    return np.float64 if kind is torch.float64 else np.float32


def work_clock(device: Device) -> Callable[[], float]:
    """Seconds of work so far: of the processor's time, and on CUDA of wall time once all launches are done."""

    def after_all() -> float:
        ti.sync()
        torch.cuda.synchronize()
        return time.perf_counter()

    return after_all if device == "cuda" else time.process_time
