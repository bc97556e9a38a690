"""Pictures of a gait: the period that is found, and what is drawn of it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.render.filmed import SPEC, needs_drawing, params
from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.render import figures, gait
from zoobench.render.film import film
from zoobench.render.gait import BODIES, body_images, draw_gait, period_of

TIMES = 0.008 * np.arange(200)


def waves(*rates: float) -> Array:
    """Two muscles of opposite phase, driven by these waves [rad/s], the slowest the strongest."""
    wave = sum(np.sin(rate * TIMES) / (1 + number) for number, rate in enumerate(rates))
    return np.tanh(np.stack([wave, -wave], axis=1))


@pytest.mark.parametrize(
    ("activity", "period"),
    [(waves(20.0, 80.0), 39), (waves(80.0), 10), (np.random.default_rng(0).normal(size=(200, 2)), None),
     (np.ones((200, 2)), None), (waves(20.0)[:60], 39), (waves(20.0)[:50], None), (waves(20.0)[:2], None)],
)  # fmt: skip
def test_the_period_is_that_of_the_slowest_wave(activity: Array, period: int | None) -> None:
    """0.314 s are 39 control frames; noise, rest and an episode of hardly more than a period have none."""
    assert period_of(activity) == period


@pytest.mark.slow
def test_a_gait_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bodies differ from moment to moment, and the picture is as wide as they are together.

    Channels of a base are below a line of their own, and it is said what red means for them.
    """
    from PIL import Image

    needs_drawing()
    whole = film(SPEC, params())
    draw_gait(whole, tmp_path / "gait.png", title="run 1")
    with Image.open(tmp_path / "gait.png") as picture:
        assert picture.width > 100 * BODIES > picture.height
    first, last = body_images(whole, [0, 10])
    assert first.shape == last.shape
    assert (first != last).any()
    monkeypatch.setattr(gait, "BODIES", 2)  # what follows does not depend on how many are drawn
    with pytest.raises(UsageError, match="No picture can be written"):
        draw_gait(whole, tmp_path / "gait.xyz", title="run 1")
    drawn: list[Any] = []
    monkeypatch.setattr(figures, "save", lambda figure, path: drawn.append(figure))
    draw_gait(replace(whole, body=replace(whole.body, base_speed=0.1)), tmp_path / "gait.png", title="run 1")
    assert "red moves the base ahead" in drawn[0].get_suptitle()
    levels = {float(line.get_ydata()[0]) for line in drawn[0].axes[-1].lines}
    assert len(whole.body.muscles) - 3.5 in levels
