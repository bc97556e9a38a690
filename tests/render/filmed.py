"""A short film for the tests, ten frames in the desert of a robot with a target, and snapshots; all coarse."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.conformance.cells import cell
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.render.canvas import check_drawing
from zoobench.render.film import Film, film
from zoobench.render.recording import Recording, Snapshot, snapshots
from zoobench.spec import Ref, RunSpec
from zoobench.testing import DOUBLE

ENVS = ("ground", "ice", "desert", "clay", "wetland", "snow", "shallow-water", "ocean[water=grid]")
SLOW = ("clay", "wetland", "snow", "shallow-water")
EACH_ENV = pytest.mark.parametrize(
    # the desert stands for the beds, and the ocean for waters: each compiles kernels of its own
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in ENVS],
)
SPEC: RunSpec = cell(environment="desert", task="waypoint-following", frames=10, fidelity=DOUBLE)

CLEAR = 0.357
"""Distance of a medium particle that has half of its place from a full cube of the robot [edges], at least: it gives up
(1 - |d|) along each axis, which is half at sqrt(3) (1 - 2^(-1/3)) along a diagonal."""


def full_cubes(shot: Recording) -> NDArray[np.bool_]:
    """Whether a robot's particle fills its cube `[robot_count]`, in whose centre it then is."""
    found: NDArray[np.bool_] = shot.body.volumes > 0.999 * shot.particle_edge**3
    return found


@cache
def params() -> tuple[float, ...]:
    """Of a controller that drives its muscles hard."""
    return tuple(np.random.default_rng(0).normal(0.0, 1.0, Problem(SPEC).parameter_count))


@cache
def short_film() -> Film:
    """The start, the middle and the end."""
    return film(SPEC, params(), moments=[0, 5, 10])


@cache
def smoke_snapshot(name: str) -> Snapshot:
    """An environment at rest, coarsely."""
    (shot,) = snapshots([Ref.parse(name)], fidelity=Ref.parse(DOUBLE))
    return shot


def needs_drawing() -> None:
    """Skip the test where the extra `render` is not installed, or a system without OpenGL cannot draw."""
    try:
        check_drawing()
    except UsageError as error:
        pytest.skip(str(error))
