"""The Wasserstein barycenter of densities on a grid.

Convolutional (Solomon et al., "Convolutional Wasserstein Distances", SIGGRAPH 2015): with the cost |x - y|^2 the
entropic kernel is a Gaussian, which is applied one axis after the other. Debiased (Janati et al., "Debiased Sinkhorn
Barycenters", ICML 2020): without the blur of the entropy, so that the barycenter of one density is that density.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor

_LARGEST_EXPONENT = 200.0  # of the kernel along an axis: beyond it, products would underflow
_TINY = 1e-300


def gaussian(count: int, width: float) -> "Tensor":
    """The kernel exp(-(i - j)^2 / (2 width^2)) `[count, count]` along an axis; the width in voxels.

    The entropic regularisation is 2 width^2 [voxels^2].
    """
    import torch

    index = torch.arange(count, dtype=torch.float64)
    return torch.exp(-torch.clamp((index[:, None] - index) ** 2 / (2.0 * width**2), max=_LARGEST_EXPONENT))


def convolve(fields: "Tensor", kernels: Sequence["Tensor"]) -> "Tensor":
    """Convolution of `fields` `[count, *grid]` with a symmetric kernel `[n, n]` along every axis of the grid."""
    import torch

    for kernel in kernels:  # moves the first axis of the grid to the end, so that finally they are in order
        fields = torch.tensordot(fields, kernel, dims=([1], [0]))
    return fields


def barycenter(
    densities: "Tensor",
    weights: "Tensor",
    kernels: Sequence["Tensor"],
    *,
    iterations: int,
    refinements: int = 3,
    debiased: bool = True,
) -> "Tensor":
    """The density `[*grid]` with the least weighted sum of entropic transport costs to `densities` `[count, *grid]`.

    Iterative Bregman projections by scalings u and v of each plan K, one marginal of which is the given density; the
    other, common to all, is the weighted geometric mean. Each iteration is followed by `refinements` of the debiasing
    factor. Both numbers are fixed, so that the result is a smooth function of `weights` `[count]`, with sum 1, and its
    gradient exact.
    """
    import torch

    shares = weights.reshape(-1, *[1] * len(kernels))
    common = torch.full_like(densities[0], 1.0 / densities[0].numel())
    log_unbias = torch.zeros_like(common)  # a logarithm, since it goes to minus infinity where the barycenter is empty
    spread = convolve(torch.ones_like(densities), kernels)  # K u
    for _ in range(iterations):
        v = common / (spread + _TINY)
        u = densities / (convolve(v, kernels) + _TINY)
        spread = convolve(u, kernels)
        log_common = (shares * torch.log(spread + _TINY)).sum(dim=0)
        if debiased:
            log_common = log_common + log_unbias
        for _ in range(refinements if debiased else 0):
            blurred = convolve(torch.exp(log_unbias)[None], kernels)[0]
            log_unbias = (log_unbias + log_common - torch.log(blurred + _TINY)) / 2.0
        common = torch.exp(log_common)
    return common
