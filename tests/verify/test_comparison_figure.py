"""The figures of cases."""

import sys
from pathlib import Path

import numpy as np
import pytest

from zoobench.errors import UsageError
from zoobench_verify.comparison_figure import Figure, draw

X = np.linspace(1.0, 2.0, 5)
FIGURE = Figure("title", "time [s]", "height [m]", log="xy")
FIGURE.computed("found", X, X**2, points=True)
FIGURE.computed("found too", X, X**3)
FIGURE.reference("exact", X, X**2)
FIGURE.level("bound", X, 2.0)
FIGURE.band("measured", X, 1.0, 3.0)


def test_a_figure_becomes_a_picture(tmp_path: Path) -> None:
    """A PNG file in a folder that is made, with more than a blank page in it."""
    from matplotlib.image import imread

    path = tmp_path / "new" / "case.png"
    draw(FIGURE, path)
    picture = imread(path)
    assert picture.shape[0] > 400
    assert picture.shape[1] > 600
    assert (picture[..., :3].min(-1) < 0.5).mean() > 0.005


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    """A file in the folder's place is a usage error that names the plot."""
    (tmp_path / "taken").write_text("")
    with pytest.raises(UsageError, match="No picture can be written"):
        draw(FIGURE, tmp_path / "taken" / "case.png")


def test_missing_matplotlib_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says what to install."""
    monkeypatch.setitem(sys.modules, "matplotlib.backends.backend_agg", None)
    with pytest.raises(UsageError, match=r"zoobench\[plots\]"):
        draw(FIGURE, tmp_path / "case.png")
