"""Checks of a component by itself, without a simulation."""

import inspect
import re
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.controllers.base import Controller, OpenLoop
from zoobench.inputs import StoredRun
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import PARTICLES_PER_CELL, Fidelity
from zoobench.spec import FRAME_SECONDS, Ref

if TYPE_CHECKING:
    from torch import Tensor

_SEEN = 30  # length of the observations that closed loops are given
_MUSCLES = 3
_FRAMES = 200
_DENSITY = 1000.0  # [kg/m^3]


def check_documentation(kind: Kind, name: str) -> None:
    """Check that there is a first line for `zoobench list`, and a default for everything but a user's file or run.

    Raises:
        AssertionError: the docstring is missing, or a parameter has no default or can be given without its name.
    """
    component = registry.get(kind, name)
    assert len(component.summary) > 10, f"The first line of the docstring is {component.summary!r}. Say what it is."
    for missing in component.required:
        wanted = component.parameters[missing]
        is_users = registry.names_file(wanted) or wanted is StoredRun
        assert is_users, f"The parameter {missing!r} has no default, so that {name} cannot run."
    for parameter in inspect.signature(component.factory).parameters.values():
        assert parameter.kind is parameter.KEYWORD_ONLY, f"Make {parameter.name!r} keyword-only."
        assert parameter.name in component.parameters.keys() | component.groups.keys()


def check_units(name: str) -> None:
    """Check that the docstring of an environment has a line for each parameter, with its unit in brackets if a number.

    Raises:
        AssertionError: a parameter has none, or several, or its line tells no unit.
    """
    component = registry.get(Kind.ENV, name)
    lines = [f"*{item}" for item in " ".join(component.description.split()).split(" * ")]
    for key, expected in component.parameters.items():
        told = [line for line in lines if f"`{key}`" in line.partition(":")[0]]
        assert len(told) == 1, f"The docstring has {len(told)} lines on {key!r}. Write * `{key}`: what it is [unit]."
        has_unit = expected is not float or re.search(r"\[[^]]+\]", told[0])
        assert has_unit, f"The line on {key!r} tells no unit in brackets; write [-] for none. It reads: {told[0]}"


def check_body(name: str) -> None:
    """Check the body of a design at every number of particles per cell.

    It stands on its ground point, all muscles have a name and particles, shares of muscles are a partition, fibres are
    unit vectors, head and tail exist and differ, and the mass is that of the finest body to 1 %.

    Raises:
        AssertionError: one of these does not hold.
    """
    design = registry.create(Kind.DESIGN, Ref(name))
    fine = design.body(Fidelity(1 / 64, particles_per_cell=PARTICLES_PER_CELL[-1])).masses(_DENSITY).sum()
    for particles_per_cell in PARTICLES_PER_CELL:
        body = design.body(Fidelity(1 / 64, particles_per_cell=particles_per_cell))
        shares = body.muscle_membership
        mass = body.masses(_DENSITY).sum()
        assert abs(mass / fine - 1.0) <= 0.01, f"Its mass is {mass:g} kg, that of the finest body {fine:g} kg."
        assert body.positions[:, 1].min() >= 0.0, "Some of it is below y = 0, the ground that it stands on."
        assert shares.shape == (body.particle_count, body.muscle_count), f"Shares of muscles have shape {shares.shape}."
        assert (shares >= 0.0).all(), "A share of a muscle is negative."
        assert (shares.sum(axis=1) <= 1.0 + 1e-12).all(), "The muscles of a particle have more than all of it."
        assert (shares.sum(axis=0) > 0.0).all(), "A muscle has no particle."
        assert np.allclose(np.linalg.norm(body.fibres, axis=1), 1.0, rtol=1e-6), "Fibres are not unit vectors."
        assert body.head.any(), "No particle is marked as head."
        assert body.tail.any(), "No particle is marked as tail."
        assert not (body.head & body.tail).any(), "A particle is marked as head and tail."


def check_controller(name: str) -> None:
    """Check that activity `[frames, worlds, muscle_count]` is a differentiable map of the parameters into [-1, 1].

    It is none where all parameters are zero, and every parameter, if there are any, has an influence.

    Raises:
        AssertionError: one of these does not hold.
    """
    import torch

    controller: Controller = registry.create(Kind.CONTROLLER, Ref(name))
    if isinstance(controller, OpenLoop):
        draws = [controller.initial(np.random.default_rng(seed), _MUSCLES) for seed in range(2)]
        count = controller.parameter_count(_MUSCLES)
    else:
        draws = [controller.initial(np.random.default_rng(seed), _MUSCLES, _SEEN) for seed in range(2)]
        count = controller.parameter_count(_MUSCLES, _SEEN)
    assert draws[0].shape == (count,), f"`initial` gives {draws[0].shape} numbers, `parameter_count` says {count}."
    params = torch.tensor(np.array(draws), requires_grad=True)
    activity = _activity(controller, params)
    assert activity.shape == (_FRAMES, 2, _MUSCLES), f"Activity has shape {tuple(activity.shape)}."
    assert activity.abs().max().item() <= 1.0, f"Activity reaches {activity.abs().max().item():g}."
    quiet = not params.numel() or not _activity(controller, torch.zeros_like(params)).any()
    assert quiet, "There is activity where all parameters are zero."
    weights = torch.as_tensor(np.random.default_rng(0).normal(size=activity.shape))
    (gradient,) = torch.autograd.grad((activity * weights).sum(), params)
    assert (gradient != 0.0).all(), "A parameter has no influence on the activity."


def _activity(controller: Controller, params: "Tensor") -> "Tensor":
    """Activity of the muscles over a standard episode; observations of a closed loop are random."""
    import torch

    times = torch.arange(_FRAMES, dtype=torch.float64) * FRAME_SECONDS
    if isinstance(controller, OpenLoop):
        return controller.actuation(params, times, _MUSCLES)
    observations = torch.as_tensor(np.random.default_rng(5).normal(size=(_FRAMES, _SEEN)))
    frames = [
        torch.stack([controller.response(row, time, observed, _MUSCLES) for row in params])
        for time, observed in zip(times.tolist(), observations, strict=True)
    ]
    return torch.stack(frames)
