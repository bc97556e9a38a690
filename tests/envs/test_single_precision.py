"""Gradients in single precision, in which runs are made, of whole episodes at the fidelity of most of them."""

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench.cell.problem import Problem
from zoobench.registry import Kind, names

FRAMES = 100

BETWEEN_WALLS = "ocean[water=grid,width=0.078125]"
"""So narrow that the stencils of the body reach faces beyond its walls, which have next to no mass."""


_UNKNOWN = pytest.mark.xfail(reason="it is off by 1.4 %, after 25 frames by 0.8 %, and nobody knows why", strict=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    "env",
    [*(pytest.param(name, marks=_UNKNOWN if name == "ocean" else ()) for name in names(Kind.ENV)), BETWEEN_WALLS],
)
def test_a_gradient_is_that_of_double_precision(env: str) -> None:
    """Within 1 % for a caterpillar, whose motion is not chaotic: a gradient divided by masses that single precision
    rounds to zero had hidden behind checks in double precision."""
    gradients = {}
    for bits in (32, 64):
        problem = Problem(cell(frames=FRAMES, environment=env, fidelity=f"draft[precision={bits}]"))
        draws = np.random.default_rng(3)
        gradients[bits] = [np.asarray(problem.episode(problem.initial(draws), gradient=True).gradient) for _ in "ab"]
    for single, double in zip(gradients[32], gradients[64], strict=True):
        assert np.linalg.norm(single - double) <= 1e-2 * np.linalg.norm(double)
