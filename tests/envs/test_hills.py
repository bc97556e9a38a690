"""Seeded hills."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zoobench.envs.hills import hills, perlin
from zoobench.errors import UsageError


def test_the_same_seed_gives_the_same_hills_everywhere() -> None:
    """These numbers are the same on every machine and with every library."""
    noise = perlin(np.array([0.3, 1.7, -2.2]), np.array([0.4, 5.1, 3.3]), seed=3, octaves=3)
    assert noise == pytest.approx([-0.537165955659364, -0.27570034089921847, -0.04989665997075983], abs=1e-12)


def test_another_seed_gives_other_hills() -> None:
    """They are uncorrelated."""
    axis = np.linspace(0.0, 40.0, 401)
    one, two = (perlin(axis[:, None], axis[None, :], seed=seed).ravel() for seed in (0, 1))
    assert abs(np.corrcoef(one, two)[0, 1]) < 0.1


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**63 - 1), octaves=st.integers(1, 5))
def test_noise_is_bounded_and_has_no_mean(seed: int, octaves: int) -> None:
    """Between -1 and 1, with mean 0 over many waves."""
    axis = np.linspace(0.0, 40.0, 401)
    noise = perlin(axis[:, None], axis[None, :], seed=seed, octaves=octaves)
    assert np.abs(noise).max() <= 1.0
    assert abs(noise.mean()) < 0.02
    assert noise.std() > 0.1


def test_one_octave_vanishes_at_whole_coordinates() -> None:
    """Gradient noise is zero on its lattice, on both sides of the origin."""
    whole = np.arange(-4.0, 5.0)
    assert np.abs(perlin(whole[:, None], whole[None, :], seed=5)).max() == 0.0


def test_hills_are_smooth() -> None:
    """First and second derivatives are continuous across cells."""
    step = 1e-3
    line = perlin(np.arange(0.0, 4.0, step), np.array(0.37), seed=2)
    gradient, curvature = np.diff(line) / step, np.diff(line, 2) / step**2
    assert np.abs(np.diff(gradient)).max() < 40 * step
    assert np.abs(np.diff(curvature)).max() < 300 * step


def test_a_terrain_keeps_its_relief_and_covers_the_arena() -> None:
    """Heights from 0 to the relief for any size of the arena, with the same hills in a larger one."""
    small = hills((0.3, 0.2), (0.1, 0.1), relief=0.02, wavelength=0.1, seed=7)
    large = hills((0.6, 0.4), (0.1, 0.1), relief=0.02, wavelength=0.1, seed=7)
    assert small is not None
    assert large is not None
    small.check(0.3)
    assert 0.005 < np.ptp(small.heights) <= 0.02
    assert 0.0 <= small.heights.min() <= small.heights.max() <= 0.02
    assert ((np.array(small.heights.shape) - 1) * small.spacing >= (0.3, 0.2)).all()
    rows, columns = small.heights.shape
    assert (large.heights[:rows, :columns] == small.heights).all()


def test_without_relief_the_ground_is_a_plane() -> None:
    """There is no terrain."""
    assert hills((1.0, 1.0), (0.5, 0.5), relief=0.0, wavelength=0.1, seed=0) is None


@pytest.mark.parametrize(
    "params",
    [{"relief": -0.1}, {"wavelength": 0.0}, {"seed": -1}, {"seed": 2**63}, {"octaves": 0}, {"relief": float("nan")}],
)
def test_impossible_hills_are_refused(params: dict[str, float]) -> None:
    """The message has the remedy, every bound in it."""
    with pytest.raises(UsageError, match=r"Give a relief of 0 or more, .* a seed from 0 to 9223372036854775807"):
        hills((1.0, 1.0), (0.5, 0.5), **({"relief": 0.02, "wavelength": 0.1, "seed": 0} | params))  # type: ignore[arg-type]
