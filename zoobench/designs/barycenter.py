"""The Wasserstein barycenter design space (SoftZoo's paper, H.6): interpolation of primitives by transport of mass."""

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.anatomy import SWIMMER_LENGTH
from zoobench.designs.base import Body
from zoobench.designs.mixture import Mixture
from zoobench.designs.parts import EVERYTHING, Optimised
from zoobench.designs.primitives import DEFAULT_PRIMITIVES, Primitives, mean
from zoobench.designs.wasserstein import barycenter, convolve, gaussian
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor

_VOXELS = 56  # along the longest edge of the workspace: tail fins are nearly five voxels thick
_WIDTH = 1.0  # of the entropic kernel [voxels]
_ITERATIONS = 100  # 0.8 s; with four times as many, 1 % of the particles change at the ends of the simplex

# the density is filtered over the width of a particle, or its gradient would vanish off the surface
_FILTER = 0.5  # [particle spacings]
_LEAST_FILTER = 0.5  # [voxels]

# of the sigmoid: matter between a flat animal and a high one is spread, and its density is little above the level
_TEMPERATURE = 0.25
_HALVINGS = 60  # of the interval of the level: to machine precision


@register(Kind.DESIGN, "barycenter", version=8, tags=("space",))
def barycenter_space(
    *,
    primitives: str = DEFAULT_PRIMITIVES,
    length: float = SWIMMER_LENGTH,
    connected: bool = True,
    optimise: Optimised = EVERYTHING,
) -> Mixture:
    """Bodies between animals, by Wasserstein barycenters of their volumes: matter moves from one to another.

    Geometry, stiffness and muscles have one coefficient for each animal; a softmax turns them into weights. The volume
    of a form is the weighted mean of the animals' volumes. Stiffness and muscles are weighted means; fibres run along
    the body.

    * `primitives`: names of animals, joined by +.
    * `length`: of every animal [m].
    * `connected`: whether only the largest connected piece is built.
    * `optimise`: the parts with coefficients, joined by +; the others are those of the first animal.
    """
    mixed = Primitives(primitives, length)
    return Mixture(primitives=mixed, connected=connected, optimise=optimise, occupancy=_occupancy, fibres=_fibres)


def _fibres(primitives: Primitives, weights: "Tensor", body: Body) -> "Tensor":
    """The fibres of the workspace, which run along the body `[particle_count, 3]`."""
    import torch

    return torch.as_tensor(body.fibres)


def _occupancy(primitives: Primitives, weights: "Tensor", body: Body) -> "Tensor":
    """Occupancy above the level of the barycenter's density that encloses the mean volume `[particle_count]`."""
    import torch
    from torch.utils.checkpoint import checkpoint

    grid, densities = _densities(primitives)
    transport = partial(barycenter, densities, kernels=grid.kernels(_WIDTH), iterations=_ITERATIONS)
    # recomputed in the backward pass: storing the iterations of a world would take 0.15 GB
    density = checkpoint(transport, weights, use_reentrant=False)
    width = max(_FILTER * float(np.cbrt(body.volumes.mean())) / grid.edge, _LEAST_FILTER)
    filtered = grid.at(body.positions, convolve(density[None], grid.kernels(width))[0])
    volume = mean(weights, torch.as_tensor(primitives.volumes))
    return keep_volume(torch.log(filtered + 1e-300), torch.as_tensor(body.volumes), volume)


@dataclass(frozen=True)
class _Grid:
    """Voxels of the right half of a workspace, on which mass is transported; all bodies are symmetric.

    Attributes:
        lower: corner on the plane of symmetry `[3]` [m].
        edge: of a voxel [m].
        counts: number of voxels along each axis.
    """

    lower: Array
    edge: float
    counts: tuple[int, ...]

    @property
    def centres(self) -> Array:
        """Centres of the voxels `[voxel_count, 3]` [m]."""
        return self.lower + self.edge * (np.indices(self.counts).reshape(3, -1).T + 0.5)

    def kernels(self, width: float) -> "list[Tensor]":
        """Gaussians of this width [voxels] along the axes; that across the plane of symmetry includes the left side."""
        along, up, side = self.counts
        both = gaussian(2 * side, width)
        return [gaussian(along, width), gaussian(up, width), (both + both.flip(1))[side:, side:]]

    def at(self, points: Array, field: "Tensor") -> "Tensor":
        """Trilinear interpolation `[n]` of a field `[*counts]` at points of both sides `[n, 3]` [m]."""
        import torch

        folded = np.stack([points[:, 0], points[:, 1], np.abs(points[:, 2])], axis=1)
        coordinates = 2.0 * (folded - self.lower) / (self.edge * np.array(self.counts)) - 1.0
        sites = torch.as_tensor(coordinates[:, ::-1].copy()).reshape(1, -1, 1, 1, 3)  # the last axis first
        found = torch.nn.functional.grid_sample(field[None, None], sites, padding_mode="border", align_corners=False)
        return found.reshape(-1)


@lru_cache(maxsize=8)
def _densities(primitives: Primitives) -> "tuple[_Grid, Tensor]":
    """The grid, and the primitives as densities on it with sum 1 `[primitive_count, *counts]`."""
    import torch

    lower, upper = primitives.box
    lower = lower * (1.0, 1.0, 0.0)
    edge = float(np.ptp(primitives.box, axis=0).max()) / _VOXELS
    grid = _Grid(lower, edge, tuple(int(count) for count in np.ceil((upper - lower) / edge - 1e-9)))
    shares = [np.clip(0.5 - animal.distance(grid.centres) / edge, 0.0, 1.0) for animal in primitives.animals]
    return grid, torch.as_tensor(np.stack([share.reshape(grid.counts) / share.sum() for share in shares]))


def keep_volume(field: "Tensor", volumes: "Tensor", volume: "Tensor") -> "Tensor":
    """Occupancy `[n]` of particles with `volumes` `[n]` [m^3] above the level of `field` `[n]` that encloses `volume`.

    `field` is the logarithm of a density, `volume` in [m^3]. The level is found by bisection. One Newton step from it,
    whose value is zero, gives it the gradient of the implicit function theorem.
    """
    import torch

    with torch.no_grad():
        low, high = field.min() - 5.0, field.max() + 5.0
        for _ in range(_HALVINGS):
            level = (low + high) / 2.0
            too_much = (volumes * _above(field - level)).sum() > volume
            low, high = torch.where(too_much, level, low), torch.where(too_much, high, level)
    with torch.enable_grad():
        free = level.clone().requires_grad_()
        (derivative,) = torch.autograd.grad((volumes * _above(field.detach() - free)).sum(), free)
    excess = (volumes * _above(field - level)).sum() - volume
    return _above(field - (level - excess / derivative))


def _above(excess: "Tensor") -> "Tensor":
    """Occupancy where the logarithm of a density exceeds the level by `excess`.

    Outside, the logarithm falls with the distance to the surface, and occupancy vanishes. Inside it is about log 2,
    too little for a sigmoid near 1; therefore the cube of the density, (e^(3 excess) - 1) / 3, is added.
    """
    import torch

    return torch.sigmoid((excess + torch.expm1(3.0 * excess.clamp(max=5.0)) / 3.0) / _TEMPERATURE)
