"""Design primitives: animals of one length in one workspace, and what each of them is at every particle of it.

The spaces that mix animals (SDF-Lerp and the Wasserstein barycenter) differ in the geometry only; what they share is
here.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.designs.anatomy import Animal
from zoobench.designs.base import Body
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.lattice import fill_box, particle_volume
from zoobench.spec import Ref

if TYPE_CHECKING:
    from torch import Tensor

DEFAULT_PRIMITIVES = "orca+shark+clownfish+tuna"

ROOM = 1.25
"""The workspace's box relative to that of the primitives: the surface can move, and at the default length every named
fidelity tiles the box with whole cells."""

_SAMPLES = 64  # along a primitive, when what lies outside it looks for the nearest point inside


@dataclass(frozen=True)
class Tissues:
    """What each primitive is at the particles of a workspace; outside its skin, as at the nearest point inside.

    Attributes:
        distances: `[primitive_count, particle_count]` signed distance to the skin, negative inside [m].
        stiffness: `[primitive_count, particle_count]` relative to the stiffest tissue of all, in (0, 1] [-].
        membership: `[primitive_count, particle_count, muscle_count]` share of each muscle, 1 together [-].
        fibres: `[primitive_count, particle_count, 3]` unit directions.
    """

    distances: "Tensor"
    stiffness: "Tensor"
    membership: "Tensor"
    fibres: "Tensor"


@dataclass(frozen=True)
class Primitives:
    """Animals between which a space interpolates.

    Muscles are matched by their number: the first channel of the controller drives the first muscle of every primitive.
    A name that the primitives do not agree on becomes `muscle-1` and so on; a primitive with fewer muscles than another
    leaves the last channels unused. Where a primitive has no muscle, the nearest one reaches: the shares of a form are
    1 together everywhere, as those of the other spaces are.

    Attributes:
        names: of registered animals, joined by `+`.
        length: of each of them [m].
    """

    names: str
    length: float

    def __post_init__(self) -> None:
        _ = self.animals  # names that cannot be used are refused now

    @cached_property
    def animals(self) -> tuple[Animal, ...]:
        """The primitives themselves, in the order of their coefficients.

        Raises:
            UsageError: fewer than two names, one of them twice, or one without a signed distance.
            UnknownNameError: no design has this name.
        """
        names = [name.strip() for name in self.names.split("+")]
        if len(names) < 2 or len(set(names)) < len(names):
            raise UsageError(
                f"{self.names!r} are no two or more different primitives. Join their names, as {DEFAULT_PRIMITIVES}."
            )
        return tuple(_animal(name, self.length) for name in names)

    @property
    def count(self) -> int:
        """How many there are."""
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
        """The true volume of each primitive `[primitive_count]` [m^3]."""
        return _volumes(self)

    def workspace(self, fidelity: Fidelity) -> Body:
        """The box filled with particles, each of the stiffest tissue; where the primitives' heads and tails are, on
        average, are head and tail of every form.

        Raises:
            SceneError: the fidelity is too coarse to hold any primitive.
        """
        lower, upper = self.box
        half = np.ceil((upper - lower) / fidelity.grid_spacing - 1e-9) * fidelity.grid_spacing / 2
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
        return Body(
            positions=positions,
            volumes=np.full(count, particle_volume(fidelity.grid_spacing, fidelity.particles_per_cell)),
            stiffness=np.full(count, self.stiffest),
            density_ratio=np.ones(count),  # a form weighs what as much muscle weighs, whatever of the box it fills
            occupancy=np.ones(count),
            muscle_membership=np.full((count, len(names)), 1.0 / len(names)),
            fibres=np.tile([1.0, 0.0, 0.0], (count, 1)),
            head=positions[:, 0] > neck,
            tail=positions[:, 0] < rump,
            muscles=names,
            malleable=True,
        )

    def tissues(self, body: Body) -> Tissues:
        """What each primitive is at the particles of `body`; computed once for each workspace."""
        return _tissues(self, body.positions.tobytes())

    def draw(self, rng: np.random.Generator, blocks: int) -> Array:
        """Coefficients from the prior `[blocks * primitive_count]`, before their softmax: standard normal, so that one
        primitive often leads and none is out of reach."""
        found: Array = rng.normal(size=blocks * self.count)
        return found


def _animal(name: str, length: float) -> Animal:
    """The registered animal of that name and length."""
    ref = Ref.parse(name)
    component = registry.get(Kind.DESIGN, ref.name, ref.version)
    made = None
    if not component.required and "length" in component.parameters:
        made = registry.create(Kind.DESIGN, ref.with_defaults(length=length))
    if not isinstance(made, Animal):
        raise UsageError(
            f"The design {name!r} is no primitive: its skin has no signed distance. "
            f"Choose animals made of parts, as {DEFAULT_PRIMITIVES}."
        )
    return made


@lru_cache(maxsize=8)
def _volumes(primitives: Primitives) -> Array:
    return np.array([animal.shape.volume() for animal in primitives.animals])


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
    """For points `[n, 3]` [m] the nearest inside the animal, and the nearest inside one of its muscles, each
    `[n, 3]` [m]: themselves, where they are there.

    The right side is searched and mirrored, so that a symmetric animal has symmetric surroundings.
    """
    from scipy.spatial import KDTree

    side = np.stack([np.ones(len(points)), np.ones(len(points)), np.sign(np.round(points[:, 2], 9))], axis=1)
    folded = points * side
    right = np.array(animal.shape.lower) * (1.0, 1.0, 0.0)
    samples = fill_box(right, np.array(animal.shape.upper), animal.length / _SAMPLES, 1)
    samples = samples[animal.shape.inside(samples)]
    has_muscle = animal.membership(samples).sum(axis=1) > 0.5

    inside = animal.distance(points) <= 0.0
    moved = inside & (animal.membership(points).sum(axis=1) > 0.5)
    anywhere = np.where(inside[:, None], folded, samples[KDTree(samples).query(folded)[1]])
    muscled = np.where(moved[:, None], folded, samples[has_muscle][KDTree(samples[has_muscle]).query(folded)[1]])
    return anywhere * side, muscled * side


def simplex(parameters: "Tensor", blocks: int) -> "Tensor":
    """Coefficients `[blocks, primitive_count]`, each block's positive and 1 together, of one world's parameters.

    A softmax: a mean of primitives stays a distance in metres, a stiffness between theirs and a whole muscle, and a
    space of free coefficients holds no other shapes but those beyond the primitives.
    """
    import torch

    # a copy: how a softmax rounds depends on where in memory it starts, that is, on the worlds before
    return torch.softmax(parameters.clone().reshape(blocks, -1), dim=1)


def mean(weights: "Tensor", values: "Tensor") -> "Tensor":
    """The mean of `values` `[primitive_count, ...]` with `weights` `[primitive_count]`."""
    return (weights.reshape(-1, *[1] * (values.ndim - 1)) * values).sum(dim=0)
