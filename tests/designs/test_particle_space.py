"""The particle-based space: parameters of a particle act on it alone."""

import numpy as np
import torch
from scipy.special import expit, softmax

from zoobench.designs.particle_space import ParticleSpace
from zoobench.sim.model.fidelity import Fidelity

SPACE = ParticleSpace()
BODY = SPACE.body(Fidelity(1 / 32))


def test_it_is_the_formula() -> None:
    """Sigmoid, sigmoid above the least stiffness, and softmax, for one particle."""
    rows = np.random.default_rng(0).normal(size=(BODY.particle_count, 2 + BODY.muscle_count))
    form = SPACE.form(torch.as_tensor(rows.reshape(1, -1)), BODY)
    for particle in (0, 17, 71):
        fullness, firmness, *muscles = rows[particle]
        np.testing.assert_allclose(form.occupancy[0, particle], expit(4.0 * fullness), rtol=1e-12)
        np.testing.assert_allclose(form.stiffness[0, particle], 0.05 + 0.95 * expit(2.0 * firmness), rtol=1e-12)
        np.testing.assert_allclose(form.muscle_membership[0, particle], softmax(4.0 * np.array(muscles)), rtol=1e-12)


def test_a_particle_is_its_own() -> None:
    """Each occupancy depends on one parameter."""
    start = torch.as_tensor(SPACE.initial(np.random.default_rng(0), BODY)[None])
    jacobian = torch.autograd.functional.jacobian(lambda rows: SPACE.form(rows, BODY).occupancy[0], start)[:, 0]
    assert ((jacobian != 0.0).sum(dim=1) == 1).all()
    assert ((jacobian != 0.0).sum(dim=0) <= 1).all()


def test_the_prior_has_the_muscles_of_the_base() -> None:
    """Where a particle lies mostly in one of them; and it is firm."""
    draws = np.array([SPACE.initial(np.random.default_rng(seed), BODY) for seed in range(50)])
    form = SPACE.form(torch.as_tensor(draws), BODY)
    low, high = np.quantile(form.stiffness, [0.05, 0.95])
    assert 0.5 < low < high < 0.9
    own, clear = BODY.muscle_membership.argmax(axis=1), BODY.muscle_membership.max(axis=1) > 0.75
    assert clear.mean() > 0.7  # the others lie across the border of two
    assert (form.muscle_membership.argmax(dim=2).numpy() == own)[:, clear].mean() > 0.99
