"""Colours tell muscles apart."""

import numpy as np

from zoobench.render.colours import PASSIVE, palette, tints


def test_muscles_have_colours_of_their_own() -> None:
    """Left and right of one group share a hue, no two muscles a colour."""
    names = ("ventral-1-left", "ventral-1-right", "dorsal-left", "dorsal-right", "tail")
    colours = np.array(palette(names))
    gaps = np.abs(colours[:, None] - colours[None]).max(axis=2) + np.eye(len(names))
    assert gaps.min() > 0.1


def test_a_particle_has_the_colours_of_its_muscles_by_share() -> None:
    """The rest is grey, also in a body without muscles."""
    names = ("flank-left", "flank-right")
    first, second = np.array(palette(names))
    found = tints(np.array([[1.0, 0.0], [0.25, 0.25], [0.0, 0.0]]), names)
    np.testing.assert_allclose(found, [first, 0.25 * (first + second) + 0.5 * np.array(PASSIVE), PASSIVE])
    np.testing.assert_allclose(tints(np.zeros((1, 0)), ()), [PASSIVE])
