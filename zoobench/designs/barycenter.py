"""Wasserstein barycenter (H.6): shapes between primitives by transport of their mass, with their volume kept."""

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.mixture import Mixture
from zoobench.designs.primitives import DEFAULT_PRIMITIVES, Primitives, mean
from zoobench.designs.wasserstein import barycenter, convolve, gaussian
from zoobench.registry import Kind, register

if TYPE_CHECKING:
    from torch import Tensor

_VOXELS = 32  # along the longest edge of the workspace: the thinnest fin is four voxels thick
_WIDTH = 1.0  # of the entropic kernel [voxels]
_ITERATIONS = 100  # 0.1 s; four times as many change the ends of the simplex by 1 % of their particles

# A particle sees the density through a filter as wide as itself, or its gradient would vanish beside the skin.
_FILTER = 0.4  # [particle spacings]
_LEAST_FILTER = 0.5  # [voxels]

_TEMPERATURE = 0.5  # of the sigmoid: full in the middle of a primitive, where the density is twice the level
_HALVINGS = 60  # of the interval in which the level lies: to the last bit


@register(Kind.DESIGN, "barycenter", tags=("space",))
def barycenter_space(*, primitives: str = DEFAULT_PRIMITIVES, length: float = 0.10, connected: bool = True) -> Mixture:
    """Bodies between animals, by Wasserstein barycenters of their volumes: matter moves from one to another.

    One coefficient per animal and part: geometry, stiffness, and muscle groups; a softmax makes each part's positive
    and 1 together. A form has the mean volume of the animals, by the coefficients of the geometry. Stiffness and muscle
    groups are means; fibres run along the body.

    * `primitives`: names of animals, joined by +.
    * `length`: of each of them [m].
    * `connected`: whether only the largest connected piece is built.
    """
    mixed = Primitives(primitives, length)
    return Mixture(primitives=mixed, connected=connected, occupancy=_occupancy, fibres=_fibres)


def _fibres(primitives: Primitives, weights: "Tensor", body: Body) -> "Tensor":
    """Those of the workspace, which run along the body `[particle_count, 3]`."""
    import torch

    return torch.as_tensor(body.fibres)


def _occupancy(primitives: Primitives, weights: "Tensor", body: Body) -> "Tensor":
    """Where the barycenter's density is above the level at which the volume is the primitives' mean
    `[particle_count]`."""
    import torch
    from torch.utils.checkpoint import checkpoint

    grid, densities = _densities(primitives)
    transport = partial(barycenter, densities, kernels=grid.kernels(_WIDTH), iterations=_ITERATIONS)
    # iterated again on the way back: kept, the iterations of a world would take 0.15 GB
    density = checkpoint(transport, weights, use_reentrant=False)
    width = max(_FILTER * float(np.cbrt(body.volumes.mean())) / grid.edge, _LEAST_FILTER)
    seen = grid.at(body.positions, convolve(density[None], grid.kernels(width))[0])
    volume = mean(weights, torch.as_tensor(primitives.volumes))
    return keep_volume(torch.log(seen + 1e-300), torch.as_tensor(body.volumes), volume)


@dataclass(frozen=True)
class _Grid:
    """The voxels of a workspace's right half, on which mass is moved; animals are symmetric, so is what lies between.

    Attributes:
        lower: corner `[3]` [m], on the plane of symmetry.
        edge: of a voxel [m].
        counts: voxels along each axis.
    """

    lower: Array
    edge: float
    counts: tuple[int, ...]

    @property
    def centres(self) -> Array:
        """Of the voxels `[voxel_count, 3]` [m]."""
        found: Array = self.lower + self.edge * (np.indices(self.counts).reshape(3, -1).T + 0.5)
        return found

    def kernels(self, width: float) -> "list[Tensor]":
        """Gaussians of that width [voxels] along the axes; across the plane of symmetry, the left side is folded in."""
        along, up, side = self.counts
        both = gaussian(2 * side, width)
        return [gaussian(along, width), gaussian(up, width), (both + both.flip(1))[side:, side:]]

    def at(self, points: Array, field: "Tensor") -> "Tensor":
        """A field `[*counts]` at points `[n, 3]` [m] of both sides `[n]`, by trilinear interpolation."""
        import torch

        folded = np.stack([points[:, 0], points[:, 1], np.abs(points[:, 2])], axis=1)
        place = 2.0 * (folded - self.lower) / (self.edge * np.array(self.counts)) - 1.0
        sites = torch.as_tensor(place[:, ::-1].copy()).reshape(1, -1, 1, 1, 3)  # the last axis first
        found = torch.nn.functional.grid_sample(field[None, None], sites, padding_mode="border", align_corners=False)
        return found.reshape(-1)


@lru_cache(maxsize=8)
def _densities(primitives: Primitives) -> "tuple[_Grid, Tensor]":
    """The grid, and the primitives on it as densities of sum 1 `[primitive_count, *counts]`."""
    import torch

    lower, upper = primitives.box
    lower = lower * (1.0, 1.0, 0.0)
    edge = float(np.ptp(primitives.box, axis=0).max()) / _VOXELS
    grid = _Grid(lower, edge, tuple(int(count) for count in np.ceil((upper - lower) / edge - 1e-9)))
    shares = [np.clip(0.5 - animal.distance(grid.centres) / edge, 0.0, 1.0) for animal in primitives.animals]
    return grid, torch.as_tensor(np.stack([share.reshape(grid.counts) / share.sum() for share in shares]))


def keep_volume(field: "Tensor", volumes: "Tensor", volume: "Tensor") -> "Tensor":
    """Occupancy `[n]` by a `field` `[n]`, the logarithm of a density, in particles of `volumes` `[n]` [m^3]: above the
    level at which `volume` [m^3] is filled.

    The level is found by bisection; one Newton step from there, whose value is zero, gives it its gradient by the
    implicit function theorem.
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
        (slope,) = torch.autograd.grad((volumes * _above(field.detach() - free)).sum(), free)
    excess = (volumes * _above(field - level)).sum() - volume
    return _above(field - (level - excess / slope))


def _above(excess: "Tensor") -> "Tensor":
    """Occupancy where the logarithm of a density exceeds the level by `excess`.

    Outside, the logarithm falls with the distance to the skin, which leaves no haze. Inside it stays near log 2, which
    is not enough for a sigmoid to be full: there the cube of the density, (e^(3 excess) - 1) / 3, is added.
    """
    import torch

    return torch.sigmoid((excess + torch.expm1(3.0 * excess.clamp(max=5.0)) / 3.0) / _TEMPERATURE)
