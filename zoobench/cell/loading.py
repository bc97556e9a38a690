"""The libraries of a process that simulates, loaded at once."""

import gc


def load_simulator() -> None:
    """Import the simulator, and hide what is loaded from the garbage collector.

    Nothing of it is garbage, but the collector would visit all of it again and again, while it is loaded and while
    kernels are made: a fifth of that time. To be called once, by a process that does nothing else.
    """
    gc.disable()
    import zoobench.cell.problem
    import zoobench.sim.equilibrium
    import zoobench.sim.solver  # noqa: F401

    gc.freeze()
    gc.enable()
