"""Archives as pictures: every elite has its place."""

import sys
from pathlib import Path

import numpy as np
import pytest

from zoobench.errors import UsageError
from zoobench.methods.archive import Archive
from zoobench.render.elites import cells_of, write

ARCHIVE = Archive(
    np.zeros((3, 4)), np.array([3.0, 1.0, -1.0]), np.array([[0.0, 0.99], [0.5, 0.5], [1.0, 0.0]]), ("a", "b"), 4
)


def test_an_elite_lies_in_the_cell_of_its_measures() -> None:
    """Cells hold their lower edge; the last one holds 1 too."""
    assert cells_of(ARCHIVE).tolist() == [[0, 3], [2, 2], [3, 0]]


def test_the_map_has_the_elites_where_they_belong(tmp_path: Path) -> None:
    """The first measure to the right, the second upwards; thirteen of sixteen cells are white."""
    image = pytest.importorskip("matplotlib.image")
    write(ARCHIVE, tmp_path / "a.png", title="three", unit="m/s")
    inside = _frame(image.imread(tmp_path / "a.png")[..., :3])
    height, width = inside.shape[:2]
    shown = np.zeros((4, 4), dtype=bool)
    for row in range(4):
        for column in range(4):
            # a corner of the cell, beside the star in its middle
            y, x = int(height * (row + 0.15) / 4), int(width * (column + 0.15) / 4)
            shown[3 - row, column] = inside[y, x].min() < 0.9
    assert sorted(np.argwhere(shown).tolist()) == sorted([up, across] for across, up in cells_of(ARCHIVE).tolist())


def _frame(picture: np.ndarray) -> np.ndarray:
    """What lies within the axes: between the long dark lines on the left of the colour bar."""
    dark = picture.max(axis=2) < 0.3
    rows = np.flatnonzero(dark.sum(axis=1) > 0.4 * picture.shape[1])
    columns = np.flatnonzero(dark.sum(axis=0) > 0.4 * picture.shape[0])
    columns = columns[columns < 0.83 * picture.shape[1]]
    return picture[rows[0] : rows[-1], columns[0] : columns[-1]]


def test_without_matplotlib_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No traceback."""
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(UsageError, match=r"zoobench\[plots\]"):
        write(ARCHIVE, tmp_path / "a.png", title="three", unit="m/s")
