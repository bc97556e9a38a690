"""The voxel-based design space (SoftZoo's paper, H.2): common parameters for the particles in a cube."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.fields import grow, painted, rows_like, width_of
from zoobench.designs.space import Form
from zoobench.designs.workspace import BasedSpace, extent, features_at
from zoobench.errors import UsageError
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor

_SMALLEST, _LARGEST = 0.001, 1.0  # edges of a voxel [m]


@register(Kind.DESIGN, "voxel", version=5, tags=("space", "sites"))
@dataclass(frozen=True, kw_only=True)
class VoxelSpace(BasedSpace):
    """A design space in which every voxel of the workspace has its own occupancy, stiffness and muscle.

    As `particle`, but all particles in a voxel have the same values. Voxels are cubes on a grid centred on the
    workspace; those without particles have no parameters, so that the number of parameters depends on the fidelity if
    voxels are smaller than its particles. The prior is that of `particle`, with the mean of the base's muscles in each
    voxel. As there, 100 steps of 0.01 can change nearly every place.

    * `base`: the fixed design whose particles are the workspace.
    * `edge`: of a voxel [m].
    * `connected`: whether only the largest connected piece is built.
    * `optimise`: the parts with parameters, joined by +; the others are the base's.
    """

    edge: float = 0.0125

    def __post_init__(self) -> None:
        super().__post_init__()
        if not _SMALLEST <= self.edge <= _LARGEST:
            raise UsageError(
                f"Voxels of {self.edge:g} m are not offered. Give an edge of {_SMALLEST:g} to {_LARGEST:g} m."
            )

    def parameter_count(self, body: Body) -> int:
        """A row of numbers for each voxel that holds particles."""
        return int(self._voxels(body).max() + 1) * width_of(self.optimise, body)

    def initial(self, rng: np.random.Generator, body: Body) -> Array:
        """A draw from the prior `[parameter_count]`."""
        shares = self._means(body.muscle_membership, body)
        return rows_like(shares, self.sites(body)[:, :3], self.optimise, rng)

    def form(self, parameters: "Tensor", body: Body) -> Form:
        """The forms for `parameters` `[worlds, parameter_count]`."""
        import torch

        voxels, width = torch.as_tensor(self._voxels(body)), width_of(self.optimise, body)
        return grow(parameters, body, self.optimise, lambda row: row.reshape(-1, width)[voxels])

    def sites(self, body: Body) -> Array:
        """The voxels, at the mean positions of their particles."""
        return features_at(self._means(body.positions, body), body)

    def painted(self, patterns: Array) -> Array:
        """The parameters for these patterns."""
        return painted(patterns, self.optimise)

    def _means(self, values: Array, body: Body) -> Array:
        """Means in every voxel `[voxel_count, n]` of values of the particles `[particle_count, n]`."""
        voxels = self._voxels(body)
        sums = np.stack([np.bincount(voxels, column) for column in values.T], axis=1)
        return sums / np.bincount(voxels)[:, None]

    def _voxels(self, body: Body) -> NDArray[np.int64]:
        """The number of each particle's voxel `[particle_count]`, among voxels with particles."""
        centre, half = extent(body)
        counts = np.ceil(2 * half / self.edge - 1e-9).astype(int)
        # a particle on a border is in the upper voxel, however its position was rounded
        places = np.floor((body.positions - centre) / self.edge + counts / 2 + 1e-9).astype(int)
        numbers = np.ravel_multi_index(tuple(places.T), tuple(counts))
        return np.unique(numbers, return_inverse=True)[1].astype(np.int64)
