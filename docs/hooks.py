"""Pages of the site that are made from the code: the reference, the leaderboards and the notebooks."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import component_pages
import reference_pages
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from typer.main import get_command

from zoobench.cli.main import app

ROOT = Path(__file__).parents[1]


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not files of the folder `docs`."""
    pages = {"reference/commands.md": commands(), "reference/components.md": component_pages.components()}
    pages |= reference_pages.pages()
    for notebook in sorted((ROOT / "docs" / "notebooks").glob("*.py")):
        pages[f"notebooks/{notebook.stem}.md"] = notebook_page(notebook)
    for board in sorted((ROOT / "leaderboards").glob("*.md")):
        pages[f"leaderboards/{board.name}"] = board.read_text(encoding="utf-8")
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    return files


def notebook_page(notebook: Path) -> str:
    """A notebook in percent format as Markdown: its text, and its code in blocks."""
    _, *cells = re.split(r"^# %%", notebook.read_text(encoding="utf-8"), flags=re.MULTILINE)
    parts = []
    for cell in cells:
        kind, _, body = cell.partition("\n")
        is_text = kind.strip() == "[markdown]"
        parts.append(re.sub(r"^# ?", "", body, flags=re.MULTILINE) if is_text else f"```python\n{body.strip()}\n```\n")
    name = notebook.relative_to(ROOT).as_posix()
    parts.append(
        f"The notebook is the file `{name}`. It runs as a script, and Jupyter opens it with `pip install jupytext`.\n"
    )
    return "\n".join(parts)


def commands() -> str:
    """The help of every command, as the command prints it."""
    sections = (f"## {name}\n\n```text\n{text}\n```\n" for name, text in _helps(get_command(app), "zoobench"))
    return "\n".join(["# Commands\n", *sections])


def _helps(command: Any, name: str, parent: Any = None) -> Iterator[tuple[str, str]]:
    context = command.context_class(command, info_name=name.split()[-1], parent=parent)
    yield name, command.get_help(context)
    for word in getattr(command, "commands", ()):
        _, child, _ = command.resolve_command(context, [word])
        yield from _helps(child, f"{name} {word}", context)
