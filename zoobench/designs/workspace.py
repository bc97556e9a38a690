"""The workspace of a design space: the particles of a fixed design, and where each of them is in it."""

from dataclasses import replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.base import Body, Design
from zoobench.designs.space import DesignSpace
from zoobench.errors import UsageError
from zoobench.inputs import InputFile
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

FEATURES = 7
"""Inputs of the networks that see places, see `features`."""


def base_design(base: str) -> Design:
    """The fixed design that a workspace is taken from, as in `block`, `panda-v1` or `caterpillar[length=0.2]`.

    Raises:
        UnknownNameError, UsageError: there is no such design, it is a design space itself, or it comes from a file
            whose content the name does not tell.
    """
    ref = Ref.parse(base)
    pinned = registry.resolve(Kind.DESIGN, ref).kwargs
    parameters = registry.get(Kind.DESIGN, ref.name, ref.version).parameters
    files = {name: pinned[name] for name, expected in parameters.items() if expected is InputFile}
    if files and not files.items() <= ref.kwargs.items():
        whole = Ref(ref.name, ref.version, tuple(sorted({**ref.kwargs, **files}.items())))
        raise UsageError(
            f"The base {base!r} does not say what is in its file, and a run's key must. Write base={whole}."
        )
    design: Design = registry.create(Kind.DESIGN, ref)
    if isinstance(design, DesignSpace):
        raise UsageError(
            f"The base {base!r} is a design space; a workspace is taken from a fixed body. "
            "Give one, as base=block or base=caterpillar."
        )
    return design


def workspace(base: str, fidelity: Fidelity) -> Body:
    """All particles of the base, full and stiff, with fibres ahead: what every form is a part of.

    Raises:
        UnknownNameError, UsageError: as `base_design`; SceneError: the fidelity is too coarse for the base.
    """
    body = base_design(base).body(fidelity)
    ones = np.ones(body.particle_count)
    ahead = np.tile([1.0, 0.0, 0.0], (body.particle_count, 1))
    return replace(body, stiffness=ones, occupancy=ones, fibres=ahead, malleable=True)


def extent(body: Body) -> tuple[Array, Array]:
    """Centre and half extent `[3]` each [m] of the box around the particles, each a cube of its volume."""
    edge = np.cbrt(body.volumes.mean())
    low, high = body.positions.min(axis=0) - edge / 2, body.positions.max(axis=0) + edge / 2
    return (low + high) / 2, (high - low) / 2


def features(body: Body) -> Array:
    """What a network sees of each particle `[particle_count, 7]`, see `seen_at`."""
    return seen_at(body.positions, body)


def seen_at(places: Array, body: Body) -> Array:
    """What a network sees of places `[n, 3]` [m] in a workspace `[n, 7]`: x, y, z, distances along the xy, xz and yz
    planes from the centre, and the radius, in units of the workspace (centre 0, half extent 1 along each axis) [-].

    Specification F.3, H.3, H.4.
    """
    centre, half = extent(body)
    x, y, z = ((places - centre) / half).T
    return np.stack([x, y, z, np.hypot(x, y), np.hypot(x, z), np.hypot(y, z), np.sqrt(x**2 + y**2 + z**2)], axis=1)
