"""Network spaces: their formulas in NumPy, and their priors."""

from collections.abc import Iterator
from typing import cast

import numpy as np
import pytest
import torch
from scipy.special import expit, softmax

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.cppn_space import cppn_space
from zoobench.designs.implicit_space import implicit_space
from zoobench.designs.networks import NetworkSpace
from zoobench.designs.workspace import features_at
from zoobench.sim.model.fidelity import Fidelity

SMOKE, DRAFT = Fidelity(1 / 32), Fidelity(1 / 64)

both = pytest.mark.parametrize("space", [implicit_space(), cppn_space()], ids=["implicit", "diff-cppn"])


def arrays(numbers: Array, *shapes: tuple[int, ...]) -> Iterator[Array]:
    """The parts of a flat vector in order, in these shapes."""
    *parts, rest = np.split(numbers, np.cumsum([np.prod(shape) for shape in shapes]))
    assert not len(rest)
    return (part.reshape(shape) for part, shape in zip(parts, shapes, strict=True))


def implicit(numbers: Array, body: Body) -> Array:
    """Two layers of 32 tanh units and an affine head `[particle_count, 2 + muscle_count]`."""
    width, seen = 2 + body.muscle_count, features_at(body.positions, body)
    parts = arrays(numbers, (7, 32), (32,), (32, 32), (32,), (32, width), (width,))
    for inputs in (7, 32):
        seen = np.tanh(seen @ next(parts) / np.sqrt(inputs) + next(parts))
    return cast(Array, seen @ next(parts) / np.sqrt(32) + next(parts))


def cppn(numbers: Array, body: Body) -> Array:
    """Three layers of 20 nodes with inputs from all earlier layers, means of sine and sigmoid, and an affine head."""
    width, seen = 2 + body.muscle_count, features_at(body.positions, body)
    layers = [shape for inputs in (7, 27, 47) for shape in ((inputs, 20), (20,), (20,))]
    parts = arrays(numbers, *layers, (67, width), (width,))
    for inputs in (7, 27, 47):
        drive, choice = seen @ next(parts) / np.sqrt(inputs) + next(parts), expit(next(parts))
        seen = np.hstack([seen, choice * np.sin(drive) + (1.0 - choice) * expit(drive)])
    return cast(Array, seen @ next(parts) / np.sqrt(67) + next(parts))


@pytest.mark.parametrize(("space", "formula", "pace"), [(implicit_space(), implicit, 0.07), (cppn_space(), cppn, 0.2)])
def test_it_is_the_formula(space: NetworkSpace, formula: object, pace: float) -> None:
    """Every output against the network in NumPy."""
    assert callable(formula)
    body = space.body(SMOKE)
    numbers = np.random.default_rng(5).normal(0.0, 10.0, space.parameter_count(body))
    rows = formula(pace * numbers, body)
    form = space.form(torch.as_tensor(numbers[None]), body)
    np.testing.assert_allclose(form.occupancy[0], expit(4.0 * rows[:, 0]), rtol=1e-12)
    np.testing.assert_allclose(form.stiffness[0], 0.05 + 0.95 * expit(2.0 * rows[:, 1]), rtol=1e-12)
    np.testing.assert_allclose(form.muscle_membership[0], softmax(4.0 * rows[:, 2:], axis=1), rtol=1e-12)


@both
def test_a_design_is_the_same_on_every_grid(space: NetworkSpace) -> None:
    """The same parameters give about the same volume on another grid."""
    coarse, fine = space.body(DRAFT), space.body(Fidelity(1 / 128))
    assert space.parameter_count(coarse) == space.parameter_count(fine)
    numbers = np.random.default_rng(3).normal(0.0, 5.0, (4, space.parameter_count(coarse)))
    volumes = [
        (space.form(torch.as_tensor(numbers), body).occupancy.numpy() * body.volumes).sum(axis=1)
        for body in (coarse, fine)
    ]
    np.testing.assert_allclose(*volumes, rtol=0.05)


@both
def test_the_prior_is_firm_with_every_muscle(space: NetworkSpace) -> None:
    """Stiffness in its range; every muscle has a share, and mostly one dominates."""
    body = space.body(DRAFT)
    draws = np.array([space.initial(np.random.default_rng(seed), body) for seed in range(20)])
    form = space.form(torch.as_tensor(draws), body)
    low, high = np.quantile(form.stiffness, [0.05, 0.95])
    assert 0.5 < low < high < 0.9
    assert form.muscle_membership.mean(dim=1).min() > 0.01
    assert form.muscle_membership.max(dim=2).values.median() > 0.6


@both
@pytest.mark.parametrize("rate", [0.1, 0.01])
def test_a_step_of_the_optimiser_is_of_moderate_size(space: NetworkSpace, rate: float) -> None:
    """Adam's first step towards less matter removes a moderate share."""
    body = space.body(DRAFT)
    for seed in range(4):
        start = torch.tensor(space.initial(np.random.default_rng(seed), body)[None], requires_grad=True)
        before = space.form(start, body).occupancy.mean()
        start.grad = torch.autograd.grad(before, start)[0]
        torch.optim.Adam([start], lr=rate).step()
        fall = (before - space.form(start, body).occupancy.mean()).item()
        assert 0.1 * rate < fall < 4.0 * rate
