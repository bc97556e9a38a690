"""Bodies of designs and runs: their sizes, masses, muscles and particle counts, and their files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from zoobench import registry
from zoobench.cell.robot import Robot
from zoobench.designs.base import Body, Design
from zoobench.designs.run_fidelity import fidelity_of_run
from zoobench.designs.thin_parts import named_fidelities
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref, RunSpec

DENSITY = 1000.0
"""Density of the robots in every environment [kg/m^3]."""

MEASURED = "paper"
"""The fidelity at which size, mass and muscles are measured."""


@dataclass(frozen=True)
class Sampled:
    """A body, sampled at a fidelity."""

    body: Body
    grid: Fidelity


def body_at(design: Ref, fidelity: Ref = Ref(MEASURED)) -> Sampled:  # noqa: B008  (frozen)
    """The body of a design, the workspace of a design space, at a fidelity.

    Raises:
        UsageError: the design cannot be made.
        SceneError: the fidelity is too coarse for it.
    """
    grid: Fidelity = registry.create(Kind.FIDELITY, fidelity)
    made: Design = registry.create(Kind.DESIGN, design)
    return Sampled(made.body(grid), grid)


def card(design: Ref) -> dict[str, Any]:
    """Properties of a design's body, as plain data.

    `size` is length, height and width [m], `mass` [kg] at `DENSITY`, `muscles` the share of the mass in each muscle
    [-], `passive` the share in none, `stiffness` and `density` the smallest and largest multiplier [-], `particles`
    the count at every named fidelity, None where that is too coarse, `notes` how a file was interpreted, at `MEASURED`.

    Raises:
        UsageError: the design cannot be made.
    """
    body = body_at(design).body
    masses = body.masses(DENSITY)
    shares = masses @ body.muscle_membership / masses.sum()
    return {
        "size": body.size.round(4).tolist(),
        "mass": float(masses.sum()),
        "muscles": dict(zip(body.muscles, shares.tolist(), strict=True)),
        "passive": max(0.0, 1.0 - float(shares.sum())),
        "stiffness": [float(body.stiffness.min()), float(body.stiffness.max())],
        "density": [float(body.density_ratio.min()), float(body.density_ratio.max())],
        "particles": {name: _count(design, name) for name in named_fidelities()},
        "notes": list(body.notes),
    }


def _count(design: Ref, fidelity: str) -> int | None:
    try:
        return body_at(design, Ref(fidelity)).body.particle_count
    except SceneError:
        return None


def formed(spec: RunSpec, parameters: Sequence[float], fidelity: Ref | None = None) -> Sampled:
    """The body of a run's solution, at the run's own fidelity if none is given.

    Raises:
        UsageError: the number of parameters is not that of this fidelity.
        SceneError: the fidelity is too coarse for the body.
    """
    grid = fidelity_of_run(spec, fidelity)
    robot = Robot.of(spec.design, spec.controller, grid, spec.task)
    if len(parameters) != robot.parameter_count:
        raise UsageError(
            f"The run's {len(parameters)} parameters describe no {spec.design.name} body at "
            f"{fidelity or spec.fidelity}, which takes {robot.parameter_count}. "
            f"Use the run's own fidelity, {spec.fidelity}."
        )
    return Sampled(robot.formed(np.array(parameters)), grid)


def export_body(sampled: Sampled, path: Path) -> None:
    """Write a body to a file, see `designs.export`.

    Raises:
        UsageError: the file cannot be written.
    """
    from zoobench.designs.export import export

    export(sampled.body, path)
