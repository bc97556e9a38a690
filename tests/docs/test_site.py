"""The documentation site builds without a warning and holds what is made from the code."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from zoobench import registry
from zoobench.registry import Kind

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site."""
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", folder]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return folder


def test_links_between_pages_lead_somewhere() -> None:
    """To a file of the documents, or to a page of the navigation that is made from the code."""
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    links = [
        (page, Path(os.path.normpath(page.parent / link)))
        for page in (ROOT / "docs").rglob("*.md")
        for link in re.findall(r"\]\(([^)#:\s]+)", page.read_text(encoding="utf-8"))
    ]
    assert len(links) > 100
    broken = [
        f"{page.name}: {target}"
        for page, target in links
        if not target.exists() and f" {os.path.relpath(target, ROOT / 'docs')}\n" not in navigation
    ]
    assert not broken


@pytest.mark.slow
def test_every_link_leads_to_a_file_of_the_site(site: Path) -> None:
    """Of pages and pictures; those to other places are not tried."""
    broken = [
        f"{page.relative_to(site)}: {link}"
        for page in site.rglob("index.html")
        for link in re.findall(r'(?:href|src)="([^"#:]+)(?:#[^"]*)?"', page.read_text(encoding="utf-8"))
        if not (page.parent / link).exists()
    ]
    assert not broken


@pytest.mark.slow
def test_no_markup_is_left_on_a_page(site: Path) -> None:
    """A table or list that the site does not recognise, as in a list's item, is printed with its bars and stars."""
    left = [
        f"{page.relative_to(site)}: {match.group()}"
        for page in site.rglob("index.html")
        for match in re.finditer(r"\* <(?:strong|code)>.{0,40}|\| -{3}.{0,40}", page.read_text(encoding="utf-8"))
    ]
    assert not left


@pytest.mark.slow
def test_the_reference_holds_all_commands_and_components(site: Path) -> None:
    """Those of today, by their headings."""
    commands = (site / "reference" / "commands" / "index.html").read_text(encoding="utf-8")
    assert 'id="zoobench-new"' in commands
    assert 'id="zoobench-design-export"' in commands
    assert 'id="zoobench-verify-validate"' in commands
    components = (site / "reference" / "components" / "index.html").read_text(encoding="utf-8")
    assert not [name for kind in Kind for name in registry.names(kind) if f'id="{name}' not in components]


@pytest.mark.slow
def test_pages_of_guide_and_leaderboards_are_in_the_navigation(site: Path) -> None:
    """Every page can be reached from the first."""
    first = (site / "index.html").read_text(encoding="utf-8")
    pages = [path for path in (ROOT / "docs").rglob("*.md") if path.name != "index.md"]
    assert len(pages) > 10
    places = [path.relative_to(ROOT / "docs").with_suffix("").as_posix() for path in pages]
    places += [f"notebooks/{notebook.stem}" for notebook in (ROOT / "docs" / "notebooks").glob("*.py")]
    places += [f"leaderboards/{board.stem}" for board in (ROOT / "leaderboards").glob("*.md")]
    assert not [place for place in places if f'href="{place}/' not in first]


@pytest.mark.slow
def test_a_notebook_is_a_page_of_text_and_code(site: Path) -> None:
    """Its comments are text with headings, its cells are blocks, and no mark of the percent format is left."""
    page = (site / "notebooks" / "compare" / "index.html").read_text(encoding="utf-8")
    assert 'id="learning-curves"' in page
    assert "zoobench" in page
    assert "# %%" not in page
    assert "jupytext:" not in page


def test_tables_of_pages_are_those_of_what_was_published() -> None:
    """`python docs/tables.py` writes them anew."""
    made = runpy.run_path(str(ROOT / "docs" / "tables.py"))
    stale = [name for name in made["PAGES"] if (ROOT / name).read_text(encoding="utf-8") != made["page"](name)]
    assert not stale
    assert len(re.findall(r"<!-- tables.py: ", "".join(map(made["page"], made["PAGES"])))) >= 3


@pytest.mark.parametrize("name", ["README.md", "docs/guide/results.md"])
def test_the_rows_that_the_gradient_leads_are_counted(name: str) -> None:
    """In the sentence on what lasts as in the table."""
    text = (ROOT / name).read_text(encoding="utf-8")
    (table,) = re.findall(r"<!-- tables.py: speeds -->\n\n.*?\n.*?\n(.*?)\n<!-- end -->", text, re.DOTALL)
    rows = table.splitlines()
    leads = sum("(gradient)" in row for row in rows)
    assert f"fastest in {leads} of {len(rows)} rows" in text.replace("\n", " ")
