"""What needs firm ground, against the environment: robots in their rest frame, and bases that are held or move."""

from functools import lru_cache

from zoobench import registry
from zoobench.envs.base import Environment
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec

_IDLE = ("transfer", "medium_transfer", "kernel", "sleep")
"""Settings of a fidelity that change nothing in water by forces on the surface."""

HELD = "anchored"
"""Tag of designs that hang from a base."""

GRIPPER = "gripper"
"""Tag of those that have room for an object below."""


def usual_task(design: Ref) -> str:
    """A task for a design where none is named: to go ahead, or to reach for a place where it hangs from a base."""
    return "reach" if HELD in registry.get(Kind.DESIGN, design.name, design.version).tags else "movement-speed"


def firm_ground_fault(spec: RunSpec) -> str:
    """Why the run needs firm ground and has none, for its robot's rest frame or its base; empty if it does not."""
    return rest_frame_fault(spec) or held_fault(spec)


def rest_frame_fault(spec: RunSpec) -> str:
    """Why the run's robot cannot be simulated in its rest frame; empty if it can, or if it is not to be."""
    if fault := _fidelity_fault(spec.env, spec.fidelity):
        return fault
    if spec.fidelity.kwargs.get("robot") != "lagrangian":
        return ""
    env = registry.create(Kind.ENV, spec.env)
    if env.bed is None and env.water is None and not env.objects and not env.obstacles:
        return ""
    return (
        "A robot in its rest frame (robot=lagrangian) moves on firm ground and in water by forces on its surface "
        f"alone, and {spec.env.name!r} has a bed, other water, an object or an obstacle. Choose an environment "
        "without, or robot=mpm."
    )


@lru_cache
def _fidelity_fault(env: Ref, fidelity: Ref) -> str:
    """Why an environment is not simulated with this fidelity, or not otherwise than without its settings; else empty.

    A run with a setting that changes nothing would be another run with the same result.
    """
    made, grid = registry.create(Kind.ENV, env), registry.create(Kind.FIDELITY, fidelity)
    if not isinstance(made, Environment):
        return ""
    try:
        made.simulated(grid)
    except UsageError as fault:
        return str(fault)
    named = registry.create(Kind.FIDELITY, Ref(fidelity.name, fidelity.version))
    for name in _IDLE if made.surface_water is not None else ():
        if (value := getattr(grid, name)) != getattr(named, name):
            return (
                f"The fidelity's {name}={value} has no effect in water by forces on the surface. Leave it out, or "
                "choose another water."
            )
    return ""


def held_fault(spec: RunSpec) -> str:
    """Why the run's robot cannot hang from its base; empty if it can, or if it is not known to have one."""
    if HELD not in registry.get(Kind.DESIGN, spec.design.name, spec.design.version).tags:
        return ""
    if spec.fidelity.kwargs.get("robot") == "lagrangian":
        return (
            f"A robot in its rest frame (robot=lagrangian) cannot be held, and {spec.design.name!r} hangs from a base. "
            "Choose another design, or robot=mpm."
        )
    env = registry.create(Kind.ENV, spec.env)
    if env.is_deep:
        return (
            f"The design {spec.design.name!r} hangs from a base, and nothing is held in the water of "
            f"{spec.env.name!r}. Choose another environment or design."
        )
    if spec.design.kwargs.get("base_speed") and env.bed is not None:
        return (
            f"The base of {spec.design.name!r} moves on firm ground alone, and {spec.env.name!r} has a bed. Choose an "
            "environment without, or base_speed=0."
        )
    return ""
