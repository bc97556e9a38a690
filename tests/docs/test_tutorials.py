"""The tutorials run as they are printed, each in a process of its own."""

import re
from pathlib import Path

import pytest

from tests import forking

DOCS = Path(__file__).parents[2] / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))


def code_of(page: Path) -> str:
    """The Python of a page, from top to bottom."""
    return "\n".join(re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE))


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_runs(page: Path, tmp_path: Path) -> None:
    """In an empty folder, without an error."""
    (tmp_path / "tutorial.py").write_text(code_of(page))
    done = forking.run("tutorial.py", cwd=tmp_path)
    assert code_of(page)
    assert done.returncode == 0, done.stderr
