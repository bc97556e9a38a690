"""Muscles in matter that is too soft for them."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.optimize import fsolve

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.firm_muscles import MOST_ACTIVE, firm_body, firm_form, firmness
from zoobench.cell.problem import Problem
from zoobench.designs.base import Body
from zoobench.designs.space import Form
from zoobench.envs.physics import LAND, SWIMMER
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.spec import Ref


def _block() -> Body:
    body: Body = registry.create(Kind.DESIGN, Ref("block")).body(Fidelity(1 / 32))
    return body


def _form(body: Body, stiffness: torch.Tensor, membership: torch.Tensor) -> Form:
    return replace(Form.filling(body, 1), stiffness=stiffness[None], muscle_membership=membership[None])


def test_the_strongest_muscle_lengthens_a_free_fibre_by_less_than_its_length() -> None:
    """Along a free fibre (mu - T) s^2 - mu + lambda log J = 0, across it mu (r^2 - 1) + lambda log J = 0."""
    mu, lam = lame_parameters(1.0, 0.2)

    def unbalanced(x: np.ndarray) -> list[float]:
        stretch, across = x
        volumetric = lam * np.log(stretch * across**2)
        return [mu * ((1.0 - MOST_ACTIVE) * stretch**2 - 1.0) + volumetric, mu * (across**2 - 1.0) + volumetric]

    assert fsolve(unbalanced, [1.5, 0.9])[0] == pytest.approx(1.77, abs=0.01)


def test_no_matter_has_more_muscle_than_it_bears() -> None:
    """Where matter is soft the tension at full activity is `MOST_ACTIVE` of its shear modulus, elsewhere whole."""
    body, material = _block(), SWIMMER.robot
    stiffness = torch.linspace(0.05, 1.0, body.particle_count, dtype=torch.float64)
    whole = torch.as_tensor(body.muscle_membership)
    found = firm_form(_form(body, stiffness, whole), body, material).muscle_membership[0]
    tension = material.muscle_strength * found.sum(1)
    asked = material.muscle_strength * whole.sum(1)
    bearable = MOST_ACTIVE * material.mu * stiffness
    torch.testing.assert_close(tension, torch.minimum(asked, bearable))
    assert (asked > bearable).any()
    assert (asked < bearable).any()


@pytest.mark.slow
def test_gradients_pass_through_what_matter_bears() -> None:
    """By stiffness and membership, with and without muscles, above and below what matter bears."""
    body = _block()
    material = replace(SWIMMER.robot, muscle_strength=0.5 * MOST_ACTIVE * SWIMMER.robot.mu)
    rng = np.random.default_rng(2)
    stiffness = torch.tensor(rng.uniform(0.1, 0.9, body.particle_count), requires_grad=True)
    shares = torch.tensor(rng.uniform(0.1, 0.3, body.muscle_membership.shape), requires_grad=True)

    def membership(k: torch.Tensor, m: torch.Tensor) -> torch.Tensor:
        return firm_form(_form(body, k, m), body, material).muscle_membership

    assert torch.autograd.gradcheck(membership, (stiffness, shares), atol=1e-7)
    nothing = torch.zeros_like(shares).requires_grad_()
    (slope,) = torch.autograd.grad(membership(stiffness, nothing).sum(), nothing)
    assert slope.isfinite().all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["baby-seal", "caterpillar", "clownfish", "fish", "orca", "panda", "shark", "tuna"])
def test_animals_bear_all_of_their_muscles(name: str) -> None:
    """On land and in water, so that what is said of their muscles holds."""
    body: Body = registry.create(Kind.DESIGN, Ref(name)).body(Fidelity(1 / 64))
    for physics in (LAND, SWIMMER):
        assert firm_body(body, physics.robot) is body


def test_a_fixed_body_of_soft_matter_has_weaker_muscles() -> None:
    """One that came from a file, such as an exported solution."""
    body = _block()
    soft = replace(body, stiffness=np.full(body.particle_count, 0.1))
    found = firm_body(soft, SWIMMER.robot).muscle_membership
    share = 0.1 / firmness(SWIMMER.robot)
    np.testing.assert_allclose(found, body.muscle_membership * share)


@pytest.mark.slow
def test_soft_matter_outlives_muscles_that_push_at_full_strength() -> None:
    """A block in water, as soft as can be, all of whose muscles push: it lengthened without bound."""
    spec = cell(environment="ocean", design="voxel[optimise=stiffness]", controller="trajectory", frames=40)
    problem = Problem(spec)
    parameters = np.full(problem.parameter_count, -9.0)  # full activity, the least stiffness
    assert problem.evaluate(parameters).failure is None
