"""The plot of energy balances."""

from pathlib import Path

import numpy as np
import pytest

from tests.verify.accuracy.study import balance
from zoobench.errors import UsageError
from zoobench.verify.accuracy.accuracy_plots import draw_energy
from zoobench.verify.accuracy.records import Measurements
from zoobench.verify.accuracy.verdicts import energies


def test_bars_are_as_long_as_their_shares(tmp_path: Path) -> None:
    """Of a bar 0.2 are blue (stored), 0.3 green (viscous) and 0.15 orange (unexplained), whatever the others are."""
    from matplotlib.image import imread

    rows = list(energies(Measurements((), (), balances=(balance("draft", 0.2),))))
    image = (255 * imread(draw_energy(rows, tmp_path))[..., :3]).round()
    widest = {}
    for name, colour in (("stored", (11, 98, 164)), ("viscous", (43, 138, 62)), ("unexplained", (200, 80, 30))):
        widest[name] = (np.abs(image - colour).max(axis=2) < 3).sum(axis=1).max()
    assert widest["viscous"] / widest["stored"] == pytest.approx(0.3 / 0.2, rel=0.03)
    assert widest["unexplained"] / widest["stored"] == pytest.approx(0.15 / 0.2, rel=0.03)


def test_an_environment_has_one_panel_with_its_variants(tmp_path: Path) -> None:
    """Two environments side by side are twice as wide as one; variants make the picture higher, not wider."""
    from matplotlib.image import imread

    shapes = []
    for envs in (("ice",), ("ice", "ground"), ("ocean", "ocean[bulk_modulus=4e5]")):
        given = tuple(balance("draft", 0.2, env) for env in envs)
        shapes.append(imread(draw_energy(list(energies(Measurements((), (), balances=given))), tmp_path)).shape)
    assert shapes[1][1] == 2 * shapes[0][1]
    assert shapes[2][1] == shapes[0][1]
    assert shapes[2][0] > shapes[0][0]


def test_nothing_to_draw_is_said(tmp_path: Path) -> None:
    """With the command to use first."""
    with pytest.raises(UsageError, match="zoobench accuracy"):
        draw_energy([], tmp_path)
