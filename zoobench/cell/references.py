"""Reference scores of a cell: muscles at rest, and random controllers.

They are computed once on each machine and cached in a file. Its name is a hash of everything that decides them,
including the sources, so that it cannot be outdated.
"""

import contextlib
import hashlib
import inspect
import json
import math
import platform
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

import zoobench
from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.cell.seeding import generator
from zoobench.files import replace_files
from zoobench.inputs import named_runs, run_name, solution_in
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec, canonical_json
from zoobench.tasks.base import Metric

DRAWS = 8
"""Number of random controllers whose mean score is the second reference."""

# without method and seed: all runs of a cell are compared with the same references
_SEED_AXES = ("env", "task", "design", "controller")
_AXES = (*_SEED_AXES, "fidelity", "frames")
_KINDS = (Kind.ENV, Kind.TASK, Kind.DESIGN, Kind.CONTROLLER, Kind.FIDELITY)


def reference_scores(spec: RunSpec, design: Array) -> dict[str, Metric]:
    """The references of a run, at its fidelity and episode length; they are not charged to the budget.

    * `idle_score`: the solution's body with every muscle at rest.
    * `random_score`: mean over `DRAWS` draws from the priors of controller and design, without those that diverged.

    A reference without a finite score is left out. A damaged cache file is replaced; if the cache cannot be written,
    the scores are computed every time.

    Args:
        spec: of the run.
        design: the solution's parameters of the design space; empty for a fixed body.
    """
    return {
        **_kept(spec, "idle_score", lambda: _idle(spec, design), design),
        **_kept(spec, "random_score", lambda: _random(spec)),
    }


def _kept(spec: RunSpec, name: str, compute: Callable[[], Metric], *parameters: Array) -> dict[str, Metric]:
    """A reference from its file, else computed; empty if it is not finite."""
    from zoobench.sim.runtime import cache_folder

    path = cache_folder().with_name("references") / f"{_key(spec, name, *parameters)}.json"
    with contextlib.suppress(OSError, ValueError):
        return {name: Metric(*entry) for name, entry in json.loads(path.read_text()).items()}
    metric = compute()
    found = {name: metric} if math.isfinite(metric.value) else {}
    with contextlib.suppress(OSError):
        rows = {name: [metric.value, metric.unit] for name, metric in found.items()}
        replace_files({path: json.dumps(rows).encode()}, make_folders=True)
    return found


def _random(spec: RunSpec) -> Metric:
    # on one thread, one world at a time is as fast as many and takes the least memory
    problem = Problem(replace(spec, budget=Budget("episodes", DRAWS)), worlds=1)
    rng = generator(spec, "reference", _SEED_AXES)
    scores = [item.score for item in problem.evaluate_batch([problem.initial(rng) for _ in range(DRAWS)])]
    finite = [score for score in scores if math.isfinite(score)]
    return Metric(math.fsum(finite) / len(finite) if finite else math.nan, problem.task.unit)


def _idle(spec: RunSpec, design: Array) -> Metric:
    """The score with every muscle at rest, by the sine basis with zeros; other controllers may have no such state."""
    controller = registry.resolve(Kind.CONTROLLER, Ref("sine-basis"))
    problem = Problem(replace(spec, controller=controller, budget=Budget("episodes", 1)), worlds=1)
    parameters = np.concatenate([np.zeros(problem.robot.control_count), design])
    return Metric(problem.evaluate(parameters).score, problem.task.unit)


def _key(spec: RunSpec, name: str, *parameters: Array) -> str:
    """A hash of the reference's name, the cell, parameters, the sources that it runs, plug-ins included, and of
    platform and library versions."""
    fields = spec.to_dict()
    origin = [platform.machine(), *(version(name) for name in ("taichi", "torch", "numpy"))]
    digest = hashlib.sha256(canonical_json([name, {axis: fields[axis] for axis in _AXES}, origin]).encode())
    named = [np.array(solution_in(run_name(key)).params) for key in named_runs(spec.design, spec.controller)]
    for array in (*parameters, *named):
        digest.update(array.tobytes())
    refs = zip(_KINDS, (spec.env, spec.task, spec.design, spec.controller, spec.fidelity), strict=True)
    components = (registry.get(kind, ref.name, ref.version).factory for kind, ref in refs)
    own = sorted(Path(zoobench.__file__).parent.rglob("*.py"))
    for path in (*own, *(Path(inspect.getfile(component)) for component in components)):
        digest.update(path.read_bytes())
    return digest.hexdigest()
