"""The two spaces between primitives: their parameters and gradients."""

from functools import cache

import numpy as np
import pytest
import torch

from zoobench.arrays import Array
from zoobench.designs.barycenter import barycenter_space
from zoobench.designs.base import Body
from zoobench.designs.mixture import Mixture
from zoobench.designs.sdf_lerp import sdf_lerp
from zoobench.designs.space import DesignSpace, Form
from zoobench.sim.model.fidelity import Fidelity

COUNT = 4
ORCA, TUNA = 0, 3


@cache
def workspace(cells: int) -> Body:
    """That of the default primitives with cells of 1 / `cells` m, cached."""
    return sdf_lerp().body(Fidelity(1 / cells))


def mixture(space: Mixture, weights: Array, cells: int) -> Form:
    """The form in which geometry, stiffness and muscles have these weights `[COUNT]`."""
    return space.form(torch.log(torch.as_tensor(weights) + 1e-40).repeat(3)[None], workspace(cells))


@pytest.mark.parametrize("space", [sdf_lerp(), barycenter_space()], ids=["sdf-lerp", "barycenter"])
def test_it_is_a_design_space(space: Mixture) -> None:
    """Three coefficients for each primitive."""
    assert isinstance(space, DesignSpace)
    body = space.body(Fidelity(1 / 32))
    assert space.parameter_count(body) == 3 * COUNT == len(space.initial(np.random.default_rng(0), body))


@pytest.mark.parametrize(
    "space",
    [
        pytest.param(sdf_lerp(), id="sdf-lerp"),
        pytest.param(barycenter_space(primitives="orca+tuna"), id="barycenter", marks=pytest.mark.slow),
    ],
)
@pytest.mark.usefixtures("few_iterations")
def test_the_gradient_is_right(space: Mixture) -> None:
    """Of all outputs, by all parameters, against finite differences."""
    body = space.body(Fidelity(1 / 32))
    parameters = torch.tensor(space.initial(np.random.default_rng(1), body)[None], requires_grad=True)
    rng = np.random.default_rng(0)

    def parts(parameters: torch.Tensor) -> tuple[torch.Tensor, ...]:
        form = space.form(parameters, body)
        return form.occupancy, form.stiffness, form.muscle_membership, form.fibres

    probes = [torch.as_tensor(rng.normal(size=part.shape)) for part in parts(parameters)]

    def readings(parameters: torch.Tensor) -> torch.Tensor:
        return torch.stack([(part * probe).sum() for part, probe in zip(parts(parameters), probes, strict=True)])

    assert torch.autograd.gradcheck(readings, parameters, fast_mode=True)
