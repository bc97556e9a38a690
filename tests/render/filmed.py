"""A short film for the tests: ten frames in the desert, coarsely, of a robot with a target."""

from functools import cache

import numpy as np
import pytest

from tests.conformance.cells import cell
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.render.film import Film, film
from zoobench.render.film_files import check_tools
from zoobench.render.formats import FilmFormat
from zoobench.spec import RunSpec

SPEC: RunSpec = cell(environment="desert", task="waypoint-following", frames=10)


@cache
def params() -> tuple[float, ...]:
    """Of a controller that drives its muscles hard."""
    return tuple(np.random.default_rng(0).normal(0.0, 1.0, Problem(SPEC).parameter_count))


@cache
def short_film() -> Film:
    """The start, the middle and the end."""
    return film(SPEC, params(), moments=[0, 5, 10])


def needs_drawing() -> None:
    """Skip the test where the extra `render` is not installed, or a system without OpenGL cannot draw."""
    for module in ("pyvista", "imageio", "imageio_ffmpeg", "skimage"):
        pytest.importorskip(module)
    try:
        check_tools(FilmFormat.PNG)
    except UsageError as error:
        pytest.skip(str(error))
