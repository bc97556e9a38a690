"""The device and the libraries of processes that simulate, loaded at once, and their kernels."""

import gc
from collections.abc import Iterable
from dataclasses import replace

from zoobench import registry
from zoobench.cell.seeding import generator
from zoobench.spec import Budget, RunSpec, on_gpu


def check_devices(specs: Iterable[RunSpec]) -> None:
    """Raise a `UsageError` if some runs are for a GPU, and this machine has none; else nothing is loaded."""
    if any(map(on_gpu, specs)):
        from zoobench.sim.runtime import check_device

        check_device("cuda")


def load_simulator() -> None:
    """Import the simulator, and hide what is loaded from the garbage collector.

    Nothing of it is garbage, but the collector would visit all of it again and again, while it is loaded and while
    kernels are made: a fifth of that time. To be called once, by a process that does nothing else.
    """
    gc.disable()
    import scipy.spatial  # noqa: F401  # with which bodies are sampled

    import zoobench.cell.problem
    import zoobench.sim.equilibrium
    import zoobench.sim.solver  # noqa: F401

    gc.freeze()
    gc.enable()


def load_kernels(spec: RunSpec, *, gradient: bool) -> None:
    """Load, or compile, the kernels of a run for the processes that are forked from this one, which lends them.

    A frame of a robot drawn at random is simulated. What else runs share is there after it, too: the sampled body, the
    digest of the code, and on disk the state of rest.

    Args:
        spec: of the run.
        gradient: whether those of the reverse, too.

    Raises:
        ZoobenchError: as of the run itself.
    """
    from zoobench.cell.problem import Problem
    from zoobench.cell.references import code_digest
    from zoobench.sim import runtime

    runtime.lend()
    code_digest()
    problem = Problem(replace(spec, frames=1, budget=Budget("episodes", 1)))
    problem.episode(problem.initial(generator(spec, "kernels")), gradient=gradient)
    runtime.keep_kernels()
    registry.look_again()
    del problem
    gc.collect()
    gc.freeze()
