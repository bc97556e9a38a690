"""The pages of the reference that are made from the code leave nothing out."""

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from zoobench import registry, rounding
from zoobench.db.models import Base
from zoobench.harness.provenance import THREAD_VARIABLES
from zoobench.harness.suite_file import GridSettings, SuiteFile
from zoobench.registry import Kind

ROOT = Path(__file__).parents[2]
LONGEST = 1500
"""Words of a page."""


@pytest.fixture(scope="module")
def made() -> dict[str, Any]:
    """The module that makes the pages."""
    return runpy.run_path(str(ROOT / "docs" / "reference_pages.py"))


@pytest.fixture(scope="module")
def pages(made: dict[str, Any]) -> dict[str, str]:
    """The pages by name."""
    return {Path(name).stem: text for name, text in made["pages"]().items()}


def read_variables() -> set[str]:
    """The environment variables that the code reads or has read by its libraries, by a search through its text."""
    paths = [path for folder in ("zoobench", "verify") for path in (ROOT / folder).rglob("*.py")]
    text = "\n".join(path.read_text(encoding="utf-8") for path in paths)
    used = re.findall(r"(?:environ(?:\.\w+)?[\[(]|envvar=)\s*([\"\w]+)", text)
    constants = dict(re.findall(r"^([A-Z_]+) = (\"[A-Z_]+\")$", text, flags=re.MULTILINE))
    named = {constants.get(word, word) for word in used}
    named |= set(re.findall(r"\"ZOOBENCH_[A-Z_]+\"", text))
    return {word.strip('"') for word in named if word.startswith('"')} | {*THREAD_VARIABLES, *rounding.CHOICES}


def test_every_environment_variable_that_is_read_is_told(made: dict[str, Any]) -> None:
    """None is missing, and none is told that nobody reads."""
    found = read_variables()
    assert {"ZOOBENCH_DB", "ZOOBENCH_MEMORY", "ZOOBENCH_DEBUG", "XDG_CACHE_HOME"} <= found
    assert set(made["VARIABLES"]) == found


def test_every_key_of_a_suite_file_is_told(pages: dict[str, str]) -> None:
    """With its type, whether it must be given, and what it takes."""
    rows = re.findall(r"^\| `(\w+)` \| (.+) \| (.+) \| (.+) \|$", pages["suite-files"], flags=re.MULTILINE)
    assert [row[0] for row in rows] == [*SuiteFile.model_fields, *GridSettings.model_fields]
    types = {key: (kind, default) for key, kind, default, _ in rows}
    assert types["summary"] == ("text", "must be given")
    assert types["grids"] == ("list of mappings", "must be given")
    assert types["seeds"] == ("whole number or list of whole numbers", "that of `common`")


def test_every_column_of_the_database_has_a_meaning(pages: dict[str, str]) -> None:
    """And every table."""
    tables = Base.metadata.tables.values()
    assert not [str(column) for table in tables for column in table.columns if not column.doc]
    for table in tables:
        assert f"\n## {table}\n\n" in pages["database"]
    assert "| `run_id` | integer, key, of `runs` | the run |" in pages["database"]


def test_every_task_has_its_observations(pages: dict[str, str]) -> None:
    """After the part that all have in common; actions of both kinds."""
    text = pages["observations"]
    sections = re.findall(r"^### ([\w-]+)", text, flags=re.MULTILINE)
    assert sections == registry.names(Kind.TASK)
    assert text.count("`phase`") == len(sections)
    assert text.count("`velocity`") == 1
    assert "| `muscle_displacements` | muscles x 3 | body lengths |" in text
    assert "| 0:10 | `activity` | muscles | - |" in text


def test_pages_are_short_and_in_the_navigation(pages: dict[str, str]) -> None:
    """Words are counted without the bars of tables."""
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for name, text in pages.items():
        assert sum(any(map(str.isalnum, word)) for word in text.split()) < LONGEST, name
        assert f"reference/{name}.md" in navigation
