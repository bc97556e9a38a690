"""Network spaces: their formulas in NumPy, and their priors."""

from typing import cast

import numpy as np
import pytest
import torch

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.designs.cppn_space import cppn_space
from zoobench.designs.implicit_space import implicit_space
from zoobench.designs.networks import NetworkSpace
from zoobench.designs.workspace import features
from zoobench.sim.model.fidelity import Fidelity

SMOKE, DRAFT = Fidelity(1 / 32), Fidelity(1 / 64)

both = pytest.mark.parametrize("space", [implicit_space(), cppn_space()], ids=["implicit", "diff-cppn"])


class Reader:
    """Reads parts of a flat vector in order."""

    def __init__(self, numbers: Array) -> None:
        self.rest = numbers

    def take(self, *shape: int) -> Array:
        """The next numbers, in this shape."""
        count = int(np.prod(shape))
        found, self.rest = self.rest[:count], self.rest[count:]
        return cast(Array, found.reshape(shape))


def sigmoid(x: Array) -> Array:
    """1 / (1 + exp(-x))."""
    return cast(Array, 1.0 / (1.0 + np.exp(-x)))


def implicit(numbers: Array, body: Body) -> Array:
    """Two layers of 32 tanh units and an affine head `[particle_count, 2 + muscle_count]`."""
    reader, seen = Reader(numbers), features(body)
    for inputs in (7, 32):
        weights, bias = reader.take(inputs, 32), reader.take(32)
        seen = np.tanh(seen @ weights / np.sqrt(inputs) + bias)
    width = 2 + body.muscle_count
    rows = seen @ reader.take(32, width) / np.sqrt(32) + reader.take(width)
    assert not len(reader.rest)
    return cast(Array, rows)


def cppn(numbers: Array, body: Body) -> Array:
    """Three layers of 20 nodes with inputs from all earlier layers, means of sine and sigmoid, and an affine head."""
    reader, seen = Reader(numbers), features(body)
    for inputs in (7, 27, 47):
        weights, bias, choice = reader.take(inputs, 20), reader.take(20), sigmoid(reader.take(20))
        drive = seen @ weights / np.sqrt(inputs) + bias
        seen = np.hstack([seen, choice * np.sin(drive) + (1.0 - choice) * sigmoid(drive)])
    width = 2 + body.muscle_count
    rows = seen @ reader.take(67, width) / np.sqrt(67) + reader.take(width)
    assert not len(reader.rest)
    return cast(Array, rows)


@pytest.mark.parametrize(("space", "formula", "pace"), [(implicit_space(), implicit, 0.07), (cppn_space(), cppn, 0.2)])
def test_it_is_the_formula(space: NetworkSpace, formula: object, pace: float) -> None:
    """Every output against the network in NumPy."""
    assert callable(formula)
    body = space.body(SMOKE)
    numbers = np.random.default_rng(5).normal(0.0, 10.0, space.parameter_count(body))
    rows = formula(pace * numbers, body)
    form = space.form(torch.as_tensor(numbers[None]), body)
    powers = np.exp(rows[:, 2:])
    np.testing.assert_allclose(form.occupancy[0], sigmoid(rows[:, 0]), rtol=1e-12)
    np.testing.assert_allclose(form.stiffness[0], 0.05 + 0.95 * sigmoid(rows[:, 1]), rtol=1e-12)
    np.testing.assert_allclose(form.muscle_membership[0], powers / powers.sum(axis=1, keepdims=True), rtol=1e-12)


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
def test_the_prior_is_full_and_firm_with_every_muscle(space: NetworkSpace) -> None:
    """Occupancy and stiffness in their ranges; every muscle has a share, and mostly one dominates."""
    body = space.body(DRAFT)
    draws = np.array([space.initial(np.random.default_rng(seed), body) for seed in range(20)])
    form = space.form(torch.as_tensor(draws), body)
    low, high = np.quantile(form.occupancy, [0.05, 0.95])
    assert 0.8 < low < high < 0.95
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
        assert 0.1 * rate < fall < rate
