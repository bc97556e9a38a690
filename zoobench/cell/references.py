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
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import zoobench
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.cell.seeding import generator
from zoobench.files import replace_files
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec, canonical_json
from zoobench.tasks.base import Metric

DRAWS = 8
"""Number of random controllers whose mean score is the second reference."""

# without method and seed: all runs of a cell are compared with the same references
_SEED_AXES = ("env", "task", "design", "controller")
_AXES = (*_SEED_AXES, "fidelity", "frames")
_KINDS = (Kind.ENV, Kind.TASK, Kind.DESIGN, Kind.CONTROLLER, Kind.FIDELITY)


def reference_scores(spec: RunSpec) -> dict[str, Metric]:
    """The references of a run's cell, at its fidelity and episode length; they are not charged to the budget.

    * `idle_score`: every muscle at rest; in a design space the first body drawn.
    * `random_score`: mean over `DRAWS` draws from the controller's prior, without those that diverged.

    A reference without a finite score is left out. A damaged cache file is replaced; if the cache cannot be written,
    the scores are computed every time.
    """
    from zoobench.sim.runtime import cache_folder

    path = cache_folder().with_name("references") / f"{_key(spec)}.json"
    with contextlib.suppress(OSError, ValueError):
        return {name: Metric(*entry) for name, entry in json.loads(path.read_text()).items()}
    found = _simulate(spec)
    with contextlib.suppress(OSError):
        rows = {name: [metric.value, metric.unit] for name, metric in found.items()}
        replace_files({path: json.dumps(rows).encode()}, make_folders=True)
    return found


def _simulate(spec: RunSpec) -> dict[str, Metric]:
    # on one thread, one world at a time is as fast as many and takes the least memory
    spec = replace(spec, budget=Budget("episodes", DRAWS))
    problem = Problem(spec, worlds=1)
    rng = generator(spec, "reference", _SEED_AXES)
    draws = [problem.initial(rng) for _ in range(DRAWS)]
    random = [item.score for item in problem.evaluate_batch(draws)]
    idle = _idle(spec, draws[0][problem.robot.control_count :])
    finite = [score for score in random if math.isfinite(score)]
    scores = {"idle_score": idle, "random_score": math.fsum(finite) / len(finite) if finite else math.nan}
    return {name: Metric(score, problem.task.unit) for name, score in scores.items() if math.isfinite(score)}


def _idle(spec: RunSpec, design: NDArray[np.float64]) -> float:
    """The score with every muscle at rest, by the sine basis with zeros; other controllers may have no such state."""
    problem = Problem(replace(spec, controller=registry.resolve(Kind.CONTROLLER, Ref("sine-basis"))), worlds=1)
    return problem.evaluate(np.concatenate([np.zeros(problem.robot.control_count), design])).score


def _key(spec: RunSpec) -> str:
    """A hash of the cell, of the sources that it runs, plug-ins included, and of platform and library versions."""
    fields = spec.to_dict()
    origin = [platform.machine(), *(version(name) for name in ("taichi", "torch", "numpy"))]
    digest = hashlib.sha256(canonical_json([{axis: fields[axis] for axis in _AXES}, origin]).encode())
    refs = zip(_KINDS, (spec.env, spec.task, spec.design, spec.controller, spec.fidelity), strict=True)
    components = (registry.get(kind, ref.name, ref.version).factory for kind, ref in refs)
    own = sorted(Path(zoobench.__file__).parent.rglob("*.py"))
    for path in (*own, *(Path(inspect.getfile(component)) for component in components)):
        digest.update(path.read_bytes())
    return digest.hexdigest()
