"""Cells that are no run: simulated frame by frame as somebody likes, or with the gait of a solution."""

import hashlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.controllers.base import ClosedLoop
from zoobench.inputs import Start, make_known, run_name
from zoobench.registry import KINDS, Kind
from zoobench.spec import FRAME_SECONDS, Budget, Ref, RunSpec

Driver = Callable[[int, Array], Array]
"""Activity `[muscle_count]` in a control frame, counted from the start, for an observation at its start."""

_UNLIMITED = Budget("substeps", 1e18)
_STORED = "stored"  # the controller and the design that a solution gives


def free_cell(env: str, task: str, design: str, fidelity: str, frames: int) -> RunSpec:
    """A cell with an unlimited budget, of components that are written as on the command line.

    Raises:
        UnknownNameError, UsageError: the components are unknown, or an episode has no frame.
    """
    texts = {"env": env, "task": task, "design": design, "controller": "policy-network", "fidelity": fidelity}
    refs: dict[str, Any] = {axis: registry.resolve(KINDS[axis], Ref.parse(text)) for axis, text in texts.items()}
    return RunSpec(**refs, method=Ref("free"), seed=0, budget=_UNLIMITED, frames=frames)


def with_gait(cell: RunSpec, start: Start) -> RunSpec:
    """The cell with the gait of a solution, and with its body where the cell has the design space of that."""
    name = run_name(hashlib.sha256(f"{start.spec.key()}{start.params}".encode()).hexdigest())
    make_known(name, start)
    is_space = cell.design == start.spec.design and "space" in registry.get(Kind.DESIGN, cell.design.name).tags
    axes = ("controller", "design") if is_space else ("controller",)
    stored = Ref(_STORED, params=(("run", name),))
    refs: dict[str, Any] = {axis: registry.resolve(KINDS[axis], stored) for axis in axes}
    return replace(cell, **refs)


def has_gait(cell: RunSpec) -> bool:
    """Whether a cell has the gait of a solution."""
    return cell.controller.name == _STORED


def driver_of(problem: Problem) -> Driver:
    """The drive of a controller without parameters, as a stored gait has."""
    import torch

    controller, muscles = problem.robot.controller, problem.body.muscle_count
    if isinstance(controller, ClosedLoop):

        def respond(frame: int, observation: Array) -> Array:
            seen = torch.as_tensor(observation, dtype=torch.float64)
            found: Array = controller.response(seen.new_zeros(0), frame * FRAME_SECONDS, seen, muscles).numpy()
            return found

        return respond
    times = torch.arange(problem.spec.frames, dtype=torch.float64) * FRAME_SECONDS
    whole = problem.robot.draft(torch.zeros((1, 0), dtype=torch.float64), times).activity[:, 0].numpy()
    return lambda frame, _: np.asarray(whole[frame])
