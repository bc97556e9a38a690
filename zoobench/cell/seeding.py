"""Seeds: each stream of random numbers depends on the axes that it may depend on, and on nothing else.

What scenes and tasks draw, they draw from seeds that are parameters of their own (`terrain_seed`, `path_seed`), so
that all methods and all seeds of a cell face the same scene and the same task.
"""

import hashlib
from collections.abc import Collection

import numpy as np

from zoobench.spec import RunSpec, canonical_json

# Neither budget nor fidelity: a longer or finer run starts from the same draws as a shorter or coarser one.
METHOD_AXES = ("env", "task", "design", "controller", "method", "seed")
# A study turns one knob at a time, the environment's among them, and looks at the same controllers every time.
STUDY_AXES = ("design", "controller", "seed")


def seed_sequence(spec: RunSpec, purpose: str, axes: Collection[str]) -> np.random.SeedSequence:
    """The seed of one purpose: sha256 over its name and the named fields of the spec.

    Raises:
        KeyError: an axis that is no field of `RunSpec`.
    """
    fields = spec.to_dict()
    document = canonical_json({"purpose": purpose, "axes": {axis: fields[axis] for axis in axes}})
    return np.random.SeedSequence(int.from_bytes(hashlib.sha256(document.encode()).digest()))


def generator(spec: RunSpec, purpose: str, axes: Collection[str] = METHOD_AXES) -> np.random.Generator:
    """A fresh generator for one purpose; calling again gives the same numbers again."""
    return np.random.Generator(np.random.PCG64(seed_sequence(spec, purpose, axes)))
