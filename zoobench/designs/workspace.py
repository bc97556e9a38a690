"""The workspace of a design space: the particles of a fixed design, and the inputs of networks at each of them."""

from dataclasses import dataclass, replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.base import Body, Design
from zoobench.designs.parts import EVERYTHING, Optimised, parts_of
from zoobench.designs.space import DesignSpace
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.sim.model.elastic_bodies import uniform_arrays
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref

FEATURES = 7
"""Number of inputs of networks over space, see `features_at`."""


def base_design(base: str) -> Design:
    """The fixed design of a workspace, such as `block`, `panda-v2` or `caterpillar[length=0.2]`.

    Raises:
        UnknownNameError, UsageError: the design is unknown, is a design space itself, or comes from a file that is
            given without its digest.
    """
    ref = Ref.parse(base)
    pinned = registry.resolve(Kind.DESIGN, ref).kwargs
    parameters = registry.get(Kind.DESIGN, ref.name, ref.version).parameters
    files = {name: pinned[name] for name, expected in parameters.items() if registry.names_file(expected)}
    if files and not files.items() <= ref.kwargs.items():
        whole = Ref(ref.name, ref.version, tuple(sorted({**ref.kwargs, **files}.items())))
        raise UsageError(f"The base {base!r} must name its file with the digest of the content. Write base={whole}.")
    design: Design = registry.create(Kind.DESIGN, ref)
    if isinstance(design, DesignSpace):
        raise UsageError(
            f"The base {base!r} is a design space, but a workspace needs a fixed body. "
            "Give one, such as base=block or base=caterpillar."
        )
    return design


@dataclass(frozen=True, kw_only=True)
class BasedSpace:
    """The workspace part of a design space.

    Attributes:
        base: the fixed design whose particles are the workspace.
        connected: whether only the largest connected piece is built.
        optimise: the parts with parameters; the others are the base's: its solid, its stiffness, its muscles.

    Raises:
        UnknownNameError, UsageError: as `base_design`.
    """

    base: str = "block"
    connected: bool = True
    optimise: Optimised = EVERYTHING

    def __post_init__(self) -> None:
        base_design(self.base)

    def body(self, fidelity: Fidelity) -> Body:
        """All particles of the base with full occupancy; where these are optimised, of stiffness 1 with fibres ahead.

        Raises:
            SceneError: the fidelity is too coarse for the base.
        """
        body = base_design(self.base).body(fidelity)
        uniform, parts = uniform_arrays(body.particle_count), parts_of(self.optimise)
        for part, name in (("stiffness", "stiffness"), ("muscles", "fibres")):
            if part in parts:
                body = replace(body, **{name: uniform[name]})
        return replace(body, occupancy=uniform["occupancy"], malleable=True)


def extent(body: Body) -> tuple[Array, Array]:
    """Centre and half extent of the box around the workspace, `[3]` each [m]."""
    low, high = body.box
    return (low + high) / 2, (high - low) / 2


def features_at(places: Array, body: Body) -> Array:
    """Inputs of a network at places `[n, 3]` [m] in a workspace `[n, 7]` (SoftZoo's paper, F.3, H.3, H.4).

    x, y, z, distances from the centre in the xy, xz and yz planes, and the radius, in units of the workspace (centre 0,
    half extent 1 along each axis) [-].
    """
    centre, half = extent(body)
    x, y, z = ((places - centre) / half).T
    return np.stack([x, y, z, np.hypot(x, y), np.hypot(x, z), np.hypot(y, z), np.sqrt(x**2 + y**2 + z**2)], axis=1)
