"""Figures without a screen."""

import sys
from pathlib import Path

import pytest

from zoobench.errors import UsageError
from zoobench.render import figures


def test_a_figure_is_written_into_folders_that_are_made(tmp_path: Path) -> None:
    """With its size in pixels: inches times dots per inch."""
    from matplotlib.image import imread

    path = tmp_path / "new" / "one.png"
    figures.save(figures.blank((2.0, 1.0), dpi=50), path)
    assert imread(path).shape[:2] == (50, 100)


@pytest.mark.parametrize("name", ["one.doc", "taken/one.png"])
def test_what_cannot_be_written_is_named(tmp_path: Path, name: str) -> None:
    """An ending that is no picture, a file where a folder should be: what to give instead."""
    (tmp_path / "taken").write_text("")
    with pytest.raises(UsageError, match=r"one\.(doc|png)'.*as one\.png"):
        figures.save(figures.blank((1.0, 1.0)), tmp_path / name)


@pytest.mark.parametrize("name", ["one", ".", ".png"])
def test_a_file_without_an_ending_is_refused(tmp_path: Path, name: str) -> None:
    """Else the picture would be in another file than the one that was named."""
    with pytest.raises(UsageError, match=r"has no ending.*\.png"):
        figures.save(figures.blank((1.0, 1.0)), tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("module", ["matplotlib.figure", "matplotlib.backends.backend_agg"])
def test_without_matplotlib_it_says_what_to_install(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are an extra."""
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(UsageError, match=r"pip install 'zoobench\[plots\]'"):
        figures.blank((1.0, 1.0))
