"""The tutorials and notebooks run as they are printed, each in a process of its own."""

import os
import re
import subprocess
import sys
from pathlib import Path
from shutil import which

import pytest

from tests import programs

DOCS = Path(__file__).parents[2] / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
_SECONDS = 900  # that training may take where other tests run beside it
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.py"))
WHOLE = "<!-- every block runs, in this order -->"
"""Mark of a page whose commands run, too; those of other pages take hours."""


def blocks_of(page: Path) -> list[tuple[str, str]]:
    """Language and text of the blocks of a page that run: its Python, and its commands where it says so."""
    text = page.read_text(encoding="utf-8")
    found: list[tuple[str, str]] = re.findall(r"^```(python|sh)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    return [block for block in found if block[0] == "python" or WHOLE in text]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.stem) for page in TUTORIALS if WHOLE not in page.read_text(encoding="utf-8")],
)
def test_a_tutorial_runs(page: Path, tmp_path: Path) -> None:
    """In an empty folder, without an error."""
    code = "\n".join(text for _, text in blocks_of(page))
    (tmp_path / "tutorial.py").write_text(code)
    done = programs.run("tutorial.py", cwd=tmp_path)
    assert code
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.timeout(_SECONDS)
@pytest.mark.parametrize(
    "page", [page for page in TUTORIALS if WHOLE in page.read_text(encoding="utf-8")], ids=lambda page: page.stem
)
def test_a_tutorial_runs_word_for_word(page: Path, tmp_path: Path) -> None:
    """Python and commands in the order of the page, in an empty folder, each without an error."""
    tools = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    blocks = blocks_of(page)
    for number, (language, text) in enumerate(blocks):
        code = "".join(text for known, text in blocks[: number + 1] if known == "python")
        (tmp_path / f"{number}.{language}").write_text(code if language == "python" else text)
        if language == "python":  # which knows the names of the blocks before it
            done = programs.run(f"{number}.python", cwd=tmp_path, timeout=_SECONDS)
        else:
            done = run_commands(tmp_path / f"{number}.sh", {**os.environ, "PATH": tools})
        assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"


@pytest.mark.slow
@pytest.mark.timeout(_SECONDS)
@pytest.mark.parametrize(
    "notebook",
    [pytest.param(page, id=page.stem) for page in NOTEBOOKS],
)
def test_a_notebook_runs(notebook: Path, tmp_path: Path) -> None:
    """As plain Python in an empty folder, where it draws its pictures into files."""
    for module in ("matplotlib", *(("pyvista",) if notebook.stem == "film" else ())):
        pytest.importorskip(module)
    (tmp_path / "notebook.py").write_text(notebook.read_text(encoding="utf-8"))
    done = programs.run("notebook.py", cwd=tmp_path, environ={"MPLBACKEND": "agg"}, timeout=_SECONDS)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("*.png"))


def run_commands(script: Path, variables: dict[str, str]) -> "subprocess.CompletedProcess[str]":
    """Run a block of commands; one of a tool that is not installed here is left out."""
    lines = script.read_text().splitlines(keepends=True)
    script.write_text("".join(line for line in lines if not line.startswith("pdflatex") or which("pdflatex")))
    command = ["bash", "-eu", str(script)]
    return subprocess.run(command, cwd=script.parent, env=variables, capture_output=True, text=True, check=False)
