"""The colours and strokes of methods: the same in every picture of results.

Colours are seen on white and on black, and told apart by those who do not see all.
"""

from collections import Counter
from collections.abc import Hashable, Iterable, Mapping
from hashlib import sha256
from typing import NamedTuple, TypeVar

from zoobench.report.labels import in_order
from zoobench.spec import Ref

K = TypeVar("K", bound=Hashable)

_OWN = {
    "diffphysics": "#2878bd", "cmaes": "#d1602c", "ppo": "#38974b", "evolution": "#9161b8", "neat": "#a57f16",
    "quality-diversity": "#d9478b", "external": "#159aa9", "random": "#7f7f7f",
}  # fmt: skip
_OTHERS = ("#6a6fd0", "#b0604a", "#4f9a82", "#a86fa0", "#7d8f2e")  # of plug-ins, by their names
_STROKES = ("-", "--", "-.", ":")  # of the variants of a method
_SHADES = (0.0, 0.35, -0.25)  # mixed with white, or below zero with black

DASHES = {"-": [1, 0], "--": [6, 3], "-.": [6, 2, 2, 2], ":": [2, 2]}
"""Strokes as Vega-Lite draws them."""


class Style(NamedTuple):
    """The colour and the stroke of a line."""

    colour: str
    stroke: str


def styles(methods: Iterable[Ref]) -> dict[Ref, Style]:
    """The style of each method: the colour of its name, for further variants another shade and stroke."""
    return styles_of({method: method for method in sorted(set(methods), key=in_order)})


def styles_of(methods: Mapping[K, Ref]) -> dict[K, Style]:
    """The same of whatever has a method, such as the entries of a table; those of one name are told apart in order."""
    places: Counter[str] = Counter()
    found = {}
    for key, method in methods.items():
        number = places[method.name]
        places[method.name] += 1
        shade = _SHADES[number % len(_SHADES)]
        found[key] = Style(_shaded(_base(method.name), shade), _STROKES[number % len(_STROKES)])
    return found


def _base(name: str) -> str:
    return _OWN.get(name) or _OTHERS[int(sha256(name.encode()).hexdigest()[:8], 16) % len(_OTHERS)]


def _shaded(colour: str, shade: float) -> str:
    parts = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    mixed = (part + shade * (255 - part) if shade > 0.0 else part * (1.0 + shade) for part in parts)
    return "#" + "".join(f"{round(part):02x}" for part in mixed)
