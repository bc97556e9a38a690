"""Design primitives: animals of one length in one workspace, and their properties at every particle of it.

The common part of the spaces that mix animals (SDF-Lerp and the Wasserstein barycenter), which differ in the geometry.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.anatomy import Animal
from zoobench.designs.base import Body
from zoobench.designs.sampling import SolidSample, whole_cells
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box
from zoobench.spec import Ref

if TYPE_CHECKING:
    from torch import Tensor

DEFAULT_PRIMITIVES = "orca+shark+clownfish+tuna"

ROOM = 1.25
"""The workspace's box relative to that of the primitives, so that the surface can move."""

_SAMPLES = 96  # along a primitive, for the search of nearest points inside: tail fins are ten samples thick


@dataclass(frozen=True)
class Tissues:
    """Properties of each primitive at the particles of a workspace; outside, those of the nearest point inside.

    Attributes:
        distances: `[primitive_count, particle_count]` signed distance to the surface, negative inside [m].
        stiffness: `[primitive_count, particle_count]` relative to the stiffest tissue of all, in (0, 1] [-].
        membership: `[primitive_count, particle_count, muscle_count]` share of each muscle, with sum 1 [-].
        fibres: `[primitive_count, particle_count, 3]` unit directions.
    """

    distances: "Tensor"
    stiffness: "Tensor"
    membership: "Tensor"
    fibres: "Tensor"


@dataclass(frozen=True)
class Primitives:
    """Animals between which a space interpolates.

    Muscles are matched by number: the first channel of the controller drives the first muscle of every primitive. A
    muscle with different names in the primitives is called `muscle-1` and so on; a primitive with fewer muscles than
    another does not use the last channels. Passive tissue has the shares of the nearest muscle, since the shares of a
    form have the sum 1 everywhere.

    Attributes:
        names: of registered animals, joined by `+`.
        length: of every animal [m].
    """

    names: str
    length: float

    def __post_init__(self) -> None:
        _ = self.animals  # checks the names

    @cached_property
    def animals(self) -> tuple[Animal, ...]:
        """The primitives, in the order of their coefficients.

        Raises:
            UsageError: fewer than two names, a name given twice, or a design without a signed distance.
            UnknownNameError: a name is unknown.
        """
        names = [name.strip() for name in self.names.split("+")]
        if len(names) < 2 or len(set(names)) < len(names):
            raise UsageError(
                f"{self.names!r} are not two or more different primitives. Join their names, as {DEFAULT_PRIMITIVES}."
            )
        return tuple(_animal(name, self.length) for name in names)

    @property
    def count(self) -> int:
        """Number of primitives."""
        return len(self.animals)

    @property
    def stiffest(self) -> float:
        """The largest stiffness of any tissue [-]."""
        return max(part.stiffness for animal in self.animals for part in animal.parts)

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the muscles, matched by number."""
        most = max(len(animal.muscles) for animal in self.animals)
        by_number = [{animal.muscles[n] for animal in self.animals if n < len(animal.muscles)} for n in range(most)]
        agreed = [next(iter(names)) if len(names) == 1 else f"muscle-{n + 1}" for n, names in enumerate(by_number)]
        return tuple(agreed) if len(set(agreed)) == most else tuple(f"muscle-{n + 1}" for n in range(most))

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Lower and upper corner `[3]` [m] of the workspace; it stands on y = 0."""
        length, height, width = ROOM * np.max(
            [np.subtract(animal.shape.upper, animal.shape.lower) for animal in self.animals], axis=0
        )
        return np.array([-length / 2, 0.0, -width / 2]), np.array([length / 2, height, width / 2])

    @property
    def volumes(self) -> Array:
        """The volume of each primitive `[primitive_count]` [m^3]."""
        return np.array([animal.shape.volume() for animal in self.animals])

    def workspace(self, fidelity: Fidelity) -> Body:
        """The box filled with particles of the stiffest tissue; head and tail are at the mean place of the primitives'.

        Raises:
            SceneError: the fidelity is too coarse for a single particle of any primitive.
        """
        fidelity = fidelity.with_particles(max(animal.particles_per_cell for animal in self.animals))
        lower, upper = self.box
        half = whole_cells(upper - lower, fidelity) * fidelity.grid_spacing / 2
        middle = np.array([0.0, half[1], 0.0])
        positions = fill_box(middle - half, middle + half, fidelity.grid_spacing, fidelity.particles_per_cell)
        if not any(animal.shape.inside(positions).any() for animal in self.animals):
            raise SceneError(
                f"No primitive of {self.length:g} m holds a particle at a grid spacing of {fidelity.grid_spacing:.4g} "
                "m. Use a finer fidelity or a larger length."
            )
        count, names = len(positions), self.muscles
        neck = np.mean([animal.scale * animal.neck for animal in self.animals])
        rump = np.mean([animal.scale * animal.rump for animal in self.animals])
        membership = np.full((count, len(names)), 1.0 / len(names))
        head, tail = positions[:, 0] > neck, positions[:, 0] < rump
        # a form has the density of muscle
        sample = SolidSample.filled(positions, fidelity.particle_edge)
        body = Body.of(sample, membership, names, head=head, tail=tail)
        return replace(body, stiffness=np.full(count, self.stiffest), malleable=True)

    def tissues(self, body: Body) -> Tissues:
        """Properties of each primitive at the particles of `body`, cached for each workspace."""
        return _tissues(self, body.positions.tobytes())


def _animal(name: str, length: float) -> Animal:
    """The registered animal with this name and length."""
    ref = Ref.parse(name)
    component = registry.get(Kind.DESIGN, ref.name, ref.version)
    made = None
    if not component.required and "length" in component.parameters:
        made = registry.create(Kind.DESIGN, ref.with_defaults(length=length))
    if not isinstance(made, Animal):
        raise UsageError(
            f"The design {name!r} is no primitive: it has no signed distance. "
            f"Choose animals made of parts, as {DEFAULT_PRIMITIVES}."
        )
    return made


@lru_cache(maxsize=8)
def _tissues(primitives: Primitives, positions: bytes) -> Tissues:
    import torch

    points = np.frombuffer(positions).reshape(-1, 3)
    muscle_count = len(primitives.muscles)
    columns: list[tuple[Array, ...]] = []
    for animal in primitives.animals:
        anywhere, muscled = _nearest_inside(animal, points)
        shares = np.zeros((len(points), muscle_count))
        shares[:, : len(animal.muscles)] = animal.membership(muscled)
        shares /= shares.sum(axis=1, keepdims=True)
        stiffness = animal.stiffness(anywhere) / primitives.stiffest
        columns.append((animal.distance(points), stiffness, shares, animal.fibres(muscled)))
    return Tissues(*(torch.as_tensor(np.stack(column)) for column in zip(*columns, strict=True)))


def _nearest_inside(animal: Animal, points: Array) -> tuple[Array, Array]:
    """For points `[n, 3]` [m], the nearest points inside the animal and inside one of its muscles, `[n, 3]` [m] each.

    A point inside is its own nearest point. The right side is searched and mirrored, so that the result is symmetric.
    """
    from scipy.spatial import KDTree

    side = np.stack([np.ones(len(points)), np.ones(len(points)), np.sign(np.round(points[:, 2], 9))], axis=1)
    folded = points * side
    right = np.array(animal.shape.lower) * (1.0, 1.0, 0.0)
    samples = fill_box(right, np.array(animal.shape.upper), animal.length / _SAMPLES, 1)
    samples = samples[animal.shape.inside(samples)]
    has_muscle = animal.membership(samples).sum(axis=1) > 0.5

    def nearest(places: Array) -> Array:
        # rounded in units of the length, so that ties are broken in the same way on both sides and at every length
        near, far = (np.round(some / animal.length, 9) for some in (folded, places))
        found: Array = places[KDTree(far).query(near)[1]]
        return found

    inside = animal.distance(points) <= 0.0
    active = inside & (animal.membership(points).sum(axis=1) > 0.5)
    anywhere = np.where(inside[:, None], folded, nearest(samples))
    muscled = np.where(active[:, None], folded, nearest(samples[has_muscle]))
    return anywhere * side, muscled * side


def simplex(parameters: "Tensor", blocks: int) -> "Tensor":
    """Weights `[blocks, primitive_count]`, positive and with sum 1 in each block, from the parameters of one world.

    With weights from a softmax the mean distance stays a distance in metres, stiffness stays within the primitives'
    range, and muscle shares have the sum 1. Free coefficients would only add shapes beyond the primitives.
    """
    import torch

    # a copy, since the rounding of a softmax depends on its alignment in memory, that is, on the worlds before it
    return torch.softmax(parameters.clone().reshape(blocks, -1), dim=1)


def mean(weights: "Tensor", values: "Tensor") -> "Tensor":
    """The mean of `values` `[primitive_count, ...]` by `weights` `[primitive_count]`."""
    return (weights.reshape(-1, *[1] * (values.ndim - 1)) * values).sum(dim=0)
