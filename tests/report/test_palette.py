"""The colours of methods."""

import pytest

from zoobench.report.palette import DASHES, styles
from zoobench.spec import Ref

NAMES = ("cmaes", "diffphysics", "evolution", "external", "neat", "ppo", "quality-diversity", "random", "my-climb")


def luminance(colour: str) -> float:
    """Relative luminance as WCAG 2 defines it, in [0, 1]."""
    parts = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_a_method_has_one_colour_whoever_stands_beside_it() -> None:
    """In a picture of two methods that of a picture of all."""
    every = styles(map(Ref, NAMES))
    assert len({style.colour for style in every.values()}) == len(NAMES)
    for name in NAMES:
        assert styles([Ref(name), Ref("random")])[Ref(name)] == every[Ref(name)]


@pytest.mark.parametrize("name", NAMES)
def test_colours_are_seen_on_white_and_on_black(name: str) -> None:
    """The contrast is at least 3, as WCAG 2 asks of graphics."""
    (style,) = styles([Ref(name)]).values()
    level = luminance(style.colour)
    assert 1.05 / (level + 0.05) >= 3.0
    assert (level + 0.05) / 0.05 >= 3.0


def test_variants_of_a_method_are_told_apart() -> None:
    """The one with the smaller number has the method's own colour."""
    found = styles(Ref.parse(text) for text in ("cmaes[sigma=0.3]", "cmaes[sigma=0.1]", "cmaes[sigma=0.02]"))
    assert len(set(found.values())) == 3
    assert {style.stroke for style in found.values()} <= DASHES.keys()
    assert found[Ref.parse("cmaes[sigma=0.02]")] == styles([Ref("cmaes")])[Ref("cmaes")]
