"""The solid body of a form, which is scored, shown, exported and kept."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench.arrays import Array, Mask
from zoobench.designs.base import Body
from zoobench.designs.feasibility import SOLID, Feasibility, feasible
from zoobench.designs.space import DesignSpace, Form
from zoobench.errors import SceneError, Unbuildable

if TYPE_CHECKING:
    from torch import Tensor

_END = 0.1  # of the length: head and tail of a form that has lost those of its workspace


def buildable(space: DesignSpace, parameters: "Tensor", workspace: Body) -> tuple[Form, Feasibility]:
    """The part of the form for `parameters` `[1, parameter_count]` that can be built, and its feasibility."""
    form, (feasibility,) = feasible(space.form(parameters, workspace), workspace, space.connected)
    return form, feasibility


def body_for(space: DesignSpace, parameters: Array, workspace: Body) -> Body:
    """The solid body for `parameters` `[parameter_count]`.

    Raises:
        SceneError: it cannot be built.
    """
    import torch

    with torch.no_grad():
        form, feasibility = buildable(space, torch.as_tensor(parameters[None]), workspace)
    if feasibility.fault:
        raise SceneError(str(Unbuildable(feasibility.fault)))
    return solid_body(form, workspace)


def solid_body(form: Form, workspace: Body) -> Body:
    """Whole particles where the first of the forms is solid, and nothing else."""
    arrays = {name: value[0].detach().numpy() for name, value in vars(form).items()}
    arrays["stiffness"] = arrays["stiffness"] * workspace.stiffness
    kept = arrays["occupancy"] > SOLID
    return replace(subset(workspace, arrays | {"occupancy": np.ones(len(kept))}, kept), malleable=False)


def subset(workspace: Body, arrays: dict[str, Array], kept: Mask) -> Body:
    """The workspace with other arrays, reduced to the particles that are kept.

    A form without solid head or tail has its ends for them.
    """
    whole = {name: value for name, value in vars(workspace).items() if isinstance(value, np.ndarray)} | arrays
    parts: dict[str, Any] = {name: value[kept] for name, value in whole.items()}
    body = replace(workspace, **parts, drawing=None)
    solid = body.occupancy > SOLID
    if (body.head & solid).any() and (body.tail & solid).any():
        return body
    along = body.positions[:, 0]
    low, high = along[solid].min(), along[solid].max()
    end = _END * (high - low)
    return replace(body, head=along >= high - end, tail=along <= low + end)
