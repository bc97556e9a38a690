"""The reference of components has a picture and every parameter of each."""

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from zoobench import registry
from zoobench.registry import Kind

DOCS = Path(__file__).parents[2] / "docs"
LARGEST = 600_000
"""[bytes] of all pictures."""

NOT_PICTURED = {"mesh", "cloud", "stored", "mix", "external", "probe", "quality-diversity"}
"""What is nothing without a file, a run or other tasks, does not learn, or has no published runs."""


@pytest.fixture(scope="module")
def made() -> dict[str, Any]:
    """The module that makes the page."""
    return runpy.run_path(str(DOCS / "component_pages.py"))


def test_every_component_has_its_picture(made: dict[str, Any]) -> None:
    """None is missing and none is left over, and a page that shows all of them loads quickly."""
    wanted = {
        f"{kind.value}-{name}.png"
        for kind in made["SHOWN"]
        for name in registry.names(kind)
        if name not in NOT_PICTURED
    }
    pictures = list((DOCS / "pictures").iterdir())
    assert {picture.name for picture in pictures} == wanted
    assert sum(picture.stat().st_size for picture in pictures) < LARGEST
    page = made["components"]()
    shown = re.findall(r"!\[([^\]]{20,})\]\(\.\./pictures/([\w-]+\.png)\)", page)
    assert {file for _, file in shown} == wanted
    assert len({words for words, _ in shown}) == len(wanted)


@pytest.mark.parametrize("kind", [kind for kind in Kind if kind is not Kind.FIDELITY])
def test_every_parameter_stands_in_a_table(made: dict[str, Any], kind: Kind) -> None:
    """Once each, with what it is and its default; and what is no parameter stays in the text."""
    for name in registry.names(kind):
        component = registry.get(kind, name)
        section = made["section"](component)
        rows = re.findall(r"^\| `(\w+)` \| (.+) \| (?:none|`[^`]+`) \|$", section, flags=re.MULTILINE)
        assert sorted(key for key, _ in rows) == sorted(component.parameters), name
        assert f"Version {component.version}." in section
        assert "Parameters:" not in section
        assert not set(re.findall(r"^\* `(\w+)`", section, flags=re.MULTILINE)) & component.parameters.keys(), name
    assert "* `qd_score`" in made["section"](registry.get(Kind.METHOD, "quality-diversity"))


def test_settings_of_fidelities_stand_once(made: dict[str, Any]) -> None:
    """They are the same for all but the grid spacing, which each one tells."""
    page = made["components"]().partition("## Fidelities")[2]
    for key in registry.get(Kind.FIDELITY, "draft").parameters:
        assert len(re.findall(rf"^\| `{key}` \|", page, flags=re.MULTILINE)) == 1, key
    assert "The `grid_spacing` is 0.015625 m." in page
