"""The device and the libraries of processes that simulate, loaded at once."""

import gc
from collections.abc import Iterable

from zoobench.spec import RunSpec, on_gpu


def check_devices(specs: Iterable[RunSpec]) -> None:
    """Raise a `UsageError` if some runs are for a GPU, and this machine has none; else nothing is loaded."""
    if any(map(on_gpu, specs)):
        from zoobench.sim.runtime import check_device

        check_device("cuda")


def load_simulator() -> None:
    """Import the simulator, start Taichi, and hide what is loaded from the garbage collector.

    Nothing of it is garbage, but the collector would visit all of it again and again, while it is loaded and while
    kernels are made: a fifth of that time. Taichi lets the processor round denormal numbers to zero; it is started here
    so that the first run has the same arithmetic as later ones. To be called once, by a process that does nothing else.
    """
    gc.disable()
    import scipy.spatial  # noqa: F401  # with which bodies are sampled

    import zoobench.cell.problem
    import zoobench.sim.equilibrium
    import zoobench.sim.solver  # noqa: F401
    from zoobench.sim import runtime

    runtime.start(32)
    gc.freeze()
    gc.enable()
