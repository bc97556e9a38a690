"""The fidelity at which a run samples its body, which the environment has a say in."""

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref, RunSpec


def fidelity_of_run(spec: RunSpec, given: Ref | None = None) -> Fidelity:
    """The fidelity with which the robot of a run is simulated, or would be at the given one.

    In water by forces on the surface a robot is in its rest frame, where thin parts have fewer particles, and a design
    space with parameters for each of them has fewer parameters. An environment of a version that is gone changes
    nothing.

    Raises:
        UsageError: the fidelity cannot be made, or its environment cannot be simulated with it.
    """
    grid: Fidelity = registry.create(Kind.FIDELITY, given or spec.fidelity)
    try:
        env = registry.create(Kind.ENV, spec.env)
    except UsageError:
        return grid
    found: Fidelity = env.simulated(grid)
    return found
