"""Robots in their rest frame against the environment: they are simulated on firm ground alone."""

from collections.abc import Iterable

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import RunSpec


def rest_frame_fault(spec: RunSpec) -> str:
    """Why the run's robot cannot be simulated in its rest frame; empty if it can, or if it is not to be."""
    if spec.fidelity.kwargs.get("robot") != "lagrangian":
        return ""
    env = registry.create(Kind.ENV, spec.env)
    if env.bed is None and env.water is None and not env.objects and not env.obstacles:
        return ""
    return (
        f"A robot in its rest frame (robot=lagrangian) moves on firm ground alone, and {spec.env.name!r} has a bed, "
        "water, an object or an obstacle. Choose an environment without, or robot=mpm."
    )


def check_rest_frames(specs: Iterable[RunSpec]) -> None:
    """Raise a `UsageError` if the robot of some run cannot be simulated in its rest frame as it is to be."""
    for spec in specs:
        if fault := rest_frame_fault(spec):
            raise UsageError(fault)
