"""The page of the reference that shows every component with its picture, its parameters and their units."""

import inspect
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from zoobench import registry
from zoobench.registry import Component, Kind

PICTURES = Path(__file__).parent / "pictures"
"""Drawn by docs/pictures.py."""

SHOWN = {
    Kind.ENV: "The environment {} at rest, with a caterpillar in it",
    Kind.TASK: "What counts in the task {}",
    Kind.DESIGN: "A body of the design {}, its muscles in colour",
    Kind.CONTROLLER: "Activity of three muscles over 0.8 s under {}",
    Kind.METHOD: "Learning curves of {} and of the methods that it was compared with",
}
"""What the pictures of a kind show."""

_ITEM = re.compile(r"^\* ((?:`\w+`(?:, )?)+): (.*(?:\n  .*)*)\n?", re.MULTILINE)
_ATTRIBUTE = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)\n?", re.MULTILINE)


def components() -> str:
    """Every component with its picture and its parameters, as `zoobench show` tells of them."""
    parts = [
        "# Components\n",
        "A component is written `name` or, with parameters, `name[parameter=value]`. Brackets hold the unit of a "
        "parameter; [-] is a pure number. The bodies of design spaces and the learning curves are of the published "
        "leaderboards.\n",
    ]
    for kind in Kind:
        parts.append(f"## {kind.value.capitalize()}\n")
        every = [registry.get(kind, name) for name in registry.names(kind)]
        if kind is Kind.FIDELITY:
            parts += _fidelities(every)
        else:
            parts += [section(component) for component in every]
    return "\n".join(parts)


def section(component: Component) -> str:
    """A component: its picture if there is one, its version, what it is, and tables of its parameters.

    Parameters that components share have a docstring of their own, and a table.
    """
    parts = [f"### {component.name}\n"]
    picture = PICTURES / f"{component.kind.value}-{component.name}.png"
    if picture.exists():
        parts.append(f"![{SHOWN[component.kind].format(component.name)}](../pictures/{picture.name})\n")
    opening = f"Version {component.version}. "
    for item in (component.factory, *map(type, component.groups.values())):
        doc = inspect.getdoc(item) or ""
        texts = {name: text for name, text in meanings(doc).items() if name in component.parameters}
        left = _ITEM.sub(lambda found, texts=texts: "" if set(_names(found[1])) <= set(texts) else found[0], doc)
        text = re.sub(r"\n{3,}", "\n\n", left).strip().removesuffix("Parameters:").strip()
        parts.append(f"{opening}{text}\n")
        opening = ""
        if texts:
            parts.append(_table(component, texts))
    return "\n".join(parts)


def meanings(doc: str) -> dict[str, str]:
    """What each parameter is, by the items of a docstring; parameters of one item have its text in common."""
    items = [*_ITEM.findall(doc), *_ATTRIBUTE.findall(doc)]
    return {name: " ".join(text.split()) for names, text in items for name in _names(names)}


def _names(text: str) -> list[str]:
    return re.findall(r"\w+", text)


def _fidelities(every: Iterable[Component]) -> Iterable[str]:
    """Each in a sentence, and the settings that all of them have, in one table."""
    every = list(every)
    for component in every:
        summary, spacing = component.description.splitlines()[0], component.defaults["grid_spacing"]
        yield f"### {component.name}\n\nVersion {component.version}. {summary} The `grid_spacing` is {spacing:.5g} m.\n"
    yield f"### Settings of every fidelity\n\n{_table(every[0], meanings(every[0].description), but='grid_spacing')}"


def _table(component: Component, texts: Mapping[str, str], but: str = "") -> str:
    defaults = {key: component.defaults.get(key, "") for key in texts}
    rows = (
        f"| `{key}` | {texts[key].replace('|', '&#124;')} | {f'`{value}`' if value != '' and key != but else 'none'} |"
        for key, value in defaults.items()
    )
    return "\n".join(["| parameter | what it is | default |", "| --- | --- | --- |", *rows]) + "\n"
