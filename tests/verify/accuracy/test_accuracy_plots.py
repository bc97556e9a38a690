"""The picture of the study and that of the energy balances."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.verify.accuracy.study import balance, ladder
from zoobench.errors import UsageError
from zoobench.render import figures
from zoobench_verify.accuracy.accuracy_plots import draw, draw_energy
from zoobench_verify.accuracy.analyse import analyse
from zoobench_verify.accuracy.energy_rows import energies
from zoobench_verify.accuracy.records import Measurements


@pytest.mark.slow
def test_one_picture_has_a_panel_for_each_environment(tmp_path: Path) -> None:
    """Three beside each other, a fourth below; the same height for two as for one."""
    from matplotlib.image import imread

    rows = [replace(row, seconds=4.0**number) for number, row in enumerate(analyse(ladder()).levels)]
    heights = []
    for count in (1, 2, 4):
        several = [replace(row, env=f"place {number}") for number in range(count) for row in rows]
        heights.append(imread(draw(several, tmp_path)).shape[0])
    assert heights[0] == heights[1] < heights[2]


def test_every_task_has_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many there are: after the last colour comes the first."""
    drawn: list[Any] = []
    monkeypatch.setattr(figures, "save", lambda figure, _: drawn.append(figure))
    rows = [replace(row, seconds=4.0**number) for number, row in enumerate(analyse(ladder()).levels)]
    names = [f"task {number}" for number in range(8)]
    draw([replace(row, task=name) for name in names for row in rows], tmp_path)
    assert [text.get_text() for text in drawn[0].legends[0].get_texts()] == names


def test_bars_are_as_long_as_their_shares(tmp_path: Path) -> None:
    """Of a bar 0.2 are blue (stored), 0.3 green (viscous) and 0.15 orange (unexplained), whatever the others are."""
    from matplotlib.image import imread

    rows = list(energies(Measurements((), balances=(balance("draft", 0.2), balance("paper", 0.1)))))
    image = (255 * imread(draw_energy(rows, tmp_path, level="draft"))[..., :3]).round()
    widest = {}
    for name, colour in (("stored", (11, 98, 164)), ("viscous", (43, 138, 62)), ("unexplained", (200, 80, 30))):
        widest[name] = (np.abs(image - colour).max(axis=2) < 3).sum(axis=1).max()
    assert widest["viscous"] / widest["stored"] == pytest.approx(0.3 / 0.2, rel=0.03)
    assert widest["unexplained"] / widest["stored"] == pytest.approx(0.15 / 0.2, rel=0.03)


def test_nothing_to_draw_is_said(tmp_path: Path) -> None:
    """With the command to use first."""
    with pytest.raises(UsageError, match="zoobench verify accuracy"):
        draw_energy([], tmp_path, level="draft")
    with pytest.raises(UsageError, match="zoobench verify accuracy"):
        draw([], tmp_path)
