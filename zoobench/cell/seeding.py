"""Seeds: each stream of random numbers depends on named axes of the spec only.

Scenes and tasks draw from seeds that are their own parameters (`terrain_seed`, `path_seed`), so that all methods and
seeds of a cell have the same scene and task.
"""

import hashlib
from collections.abc import Collection

import numpy as np

from zoobench.spec import RunSpec, canonical_json

# without budget and fidelity: a longer or finer run starts from the same draws as a shorter or coarser one
METHOD_AXES = ("env", "task", "design", "controller", "method", "seed")
# a study varies one setting at a time, the environment included, with the same controllers
STUDY_AXES = ("design", "controller", "seed")


def seed_sequence(spec: RunSpec, purpose: str, axes: Collection[str]) -> np.random.SeedSequence:
    """The seed for one purpose: sha256 of its name and of the named fields of the spec.

    Raises:
        KeyError: an axis is not a field of `RunSpec`.
    """
    fields = spec.to_dict()
    document = canonical_json({"purpose": purpose, "axes": {axis: fields[axis] for axis in axes}})
    return np.random.SeedSequence(int.from_bytes(hashlib.sha256(document.encode()).digest()))


def generator(spec: RunSpec, purpose: str, axes: Collection[str] = METHOD_AXES) -> np.random.Generator:
    """A new generator for one purpose; every call gives the same stream."""
    return np.random.Generator(np.random.PCG64(seed_sequence(spec, purpose, axes)))
