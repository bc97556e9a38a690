"""Reference scores of a cell: muscles at rest, and random controllers.

The runs of a cell share them. Each is known by a hash of everything that decides it, the sources and the processor
included, so that a run has the number that it would compute itself, bit for bit, whoever was first.
"""

import hashlib
import inspect
import math
import os
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Protocol

import numpy as np

import zoobench
from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.cell.seeding import generator
from zoobench.files import hash_of_sources
from zoobench.inputs import named_runs, run_name, solution_in
from zoobench.registry import Kind
from zoobench.rounding import CHOICES
from zoobench.spec import Budget, Ref, RunSpec, canonical_json
from zoobench.tasks.base import Metric

DRAWS = 8
"""Number of random controllers whose mean score is the second reference."""

# without method and seed: all runs of a cell are compared with the same references
_SEED_AXES = ("env", "task", "design", "controller")
_AXES = (*_SEED_AXES, "fidelity", "frames")
_AROUND = ("accuracy", "cli", "db", "gym", "harness", "methods", "render", "report", "studies", "testing")
"""Packages that no reference depends on."""


class SharedScores(Protocol):
    """Reference scores of all runs, by their keys."""

    def reference(self, key: str) -> Metric | None:
        """The score under this key; None if it is the caller's turn to compute and keep it."""
        ...

    def keep_reference(self, key: str, score: Metric) -> None:
        """Keep a score, NaN too, for the runs that share it."""
        ...


def reference_scores(spec: RunSpec, design: Array, shared: SharedScores) -> dict[str, Metric]:
    """The references of a run, at its fidelity and episode length; they are not charged to the budget.

    * `idle_score`: the solution's body with every muscle at rest.
    * `random_score`: mean over `DRAWS` draws from the priors of controller and design, without those that diverged.

    A reference without a finite score is left out. A reference of the solution's own body is not shared.

    Args:
        spec: of the run.
        design: the solution's parameters of the design space; empty for a fixed body.
        shared: the scores of other runs.
    """
    found = {
        "idle_score": _idle(spec, design) if len(design) else _shared(spec, "idle_score", _idle_of_cell, shared),
        "random_score": _shared(spec, "random_score", _random, shared),
    }
    return {name: score for name, score in found.items() if math.isfinite(score.value)}


def _shared(spec: RunSpec, name: str, compute: Callable[[RunSpec], Metric], shared: SharedScores) -> Metric:
    """A reference that another run has computed, else computed and kept."""
    key = _key(spec, name)
    if (known := shared.reference(key)) is not None:
        return known
    score = compute(spec)
    shared.keep_reference(key, score)
    return score


def _random(spec: RunSpec) -> Metric:
    problem = Problem(replace(spec, budget=Budget("episodes", DRAWS)), worlds=DRAWS)
    rng = generator(spec, "reference", _SEED_AXES)
    scores = [item.score for item in problem.evaluate_batch([problem.initial(rng) for _ in range(DRAWS)])]
    finite = [score for score in scores if math.isfinite(score)]
    return Metric(math.fsum(finite) / len(finite) if finite else math.nan, problem.task.unit)


def _idle_of_cell(spec: RunSpec) -> Metric:
    return _idle(spec, np.zeros(0))


def _idle(spec: RunSpec, design: Array) -> Metric:
    """The score with every muscle at rest, by the sine basis with zeros; other controllers may have no such state."""
    controller = registry.resolve(Kind.CONTROLLER, Ref("sine-basis"))
    problem = Problem(replace(spec, controller=controller, budget=Budget("episodes", 1)), worlds=1)
    parameters = np.concatenate([np.zeros(problem.robot.control_count), design])
    return Metric(problem.evaluate(parameters).score, problem.task.unit)


def _key(spec: RunSpec, name: str) -> str:
    """A hash of all that decides a reference of the cell: its name, the cell, the stored runs and the sources that it
    runs, plug-ins included, the versions of libraries, and the processor as they and the compiler know it."""
    from zoobench.sim.equilibrium import processor

    fields = spec.to_dict()
    machine = [processor(), *(os.environ.get(variable, "") for variable in CHOICES)]
    cell = {axis: fields[axis] for axis in _AXES}
    digest = hashlib.sha256(canonical_json([name, cell, machine]).encode() + code_digest())
    for key in named_runs(spec.design, spec.controller):
        digest.update(np.array(solution_in(run_name(key)).params).tobytes())
    for axis in (*_SEED_AXES, "fidelity"):
        ref = getattr(spec, axis)
        component = registry.get(registry.KINDS[axis], ref.name, ref.version)
        digest.update(Path(inspect.getfile(component.factory)).read_bytes())
    return digest.hexdigest()


@cache
def code_digest() -> bytes:
    """A hash of the sources of zoobench, but those of the code around an episode, and of libraries' versions.

    Kept, as this process has loaded all of it.
    """
    sources = hash_of_sources(Path(zoobench.__file__).parent, leave_out=_AROUND)
    libraries = [version(library) for library in ("taichi", "torch", "numpy", "scipy")]
    return hashlib.sha256(canonical_json([sources, *libraries]).encode()).digest()
