"""The panel of a page moves the muscles."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tests.render.browser import Page, until
from zoobench.render.panel import CONTRACT, EXTEND, Panel
from zoobench.render.viewer import Viewer

MUSCLES = ("left", "right", "back")


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    """A page that nobody has open."""
    made = Viewer(port=0)
    yield made
    made.close()


def _inputs(viewer: Viewer) -> dict[str, Any]:
    """Everything in the panel that can be used, by its label."""
    return {each.label: each for each in viewer.server.gui._gui_input_handle_from_uuid.values()}


def test_every_muscle_has_a_slider_and_two_keys(viewer: Viewer) -> None:
    """That move it alone, and no further than its bounds; one button lets all rest."""
    panel = Panel(viewer.server.gui, MUSCLES, is_trained=False)
    sliders = [each for name, each in _inputs(viewer).items() if name.split()[0] in MUSCLES]
    assert len(sliders) == 3
    with Page(viewer) as page:
        page.set(sliders[1], -0.5)
        until(lambda: panel.activity.tolist() == [0.0, -0.5, 0.0])
        for times in range(1, 7):
            page.press("D")
            until(lambda: panel.activity[2] == min(0.25 * times, 1.0))  # noqa: B023  (called at once)
        page.press("Q")
        until(lambda: panel.activity.tolist() == [-0.25, -0.5, 1.0])
        page.set(_inputs(viewer)["Rest all"], True)
        until(lambda: not panel.activity.any())


def test_no_page_can_ask_for_more_than_a_muscle_does(viewer: Viewer) -> None:
    """Whatever it sends, activity and speed are within their bounds."""
    panel = Panel(viewer.server.gui, MUSCLES, is_trained=False)
    first, speed = (
        next(each for name, each in _inputs(viewer).items() if name.startswith(word)) for word in ("left", "Speed")
    )
    with Page(viewer) as page:
        for sent in (1e9, float("nan"), float("-inf")):
            page.set(first, sent)
            page.set(speed, sent)
            until(lambda: np.array_equal([first.value, speed.value], [sent, sent], equal_nan=True))  # noqa: B023
            assert np.abs(panel.activity).max() <= 1.0
            assert 0.05 <= panel.speed <= 1.0


def test_an_episode_is_paused_and_begun_again(viewer: Viewer) -> None:
    """By buttons or keys; a wish to begin again is heard once."""
    panel = Panel(viewer.server.gui, MUSCLES, is_trained=False)
    with Page(viewer) as page:
        page.set(_inputs(viewer)["Pause"], True)
        until(lambda: panel.is_paused)
        until(lambda: "Go on" in _inputs(viewer))
        page.press("escape")
        until(lambda: not panel.is_paused)
        assert not panel.wants_again()
        for ask in (lambda: page.press("backspace"), lambda: page.set(_inputs(viewer)["Start again"], True)):
            ask()
            until(panel.wants_again)
            assert not panel.wants_again()


def test_a_trained_gait_is_shown_until_somebody_takes_over(viewer: Viewer) -> None:
    """Its sliders show what it does, and cannot be moved meanwhile; without a gait there is no choice."""
    panel = Panel(viewer.server.gui, MUSCLES, is_trained=True)
    assert not panel.is_by_hand
    panel.tell("", np.array([0.123, -1.0, 0.5]))
    assert panel.activity.tolist() == [0.12, -1.0, 0.5]
    assert all(each.disabled for name, each in _inputs(viewer).items() if name.split()[0] in MUSCLES)
    with Page(viewer) as page:
        page.set(_inputs(viewer)["Trained gait"], False)
        until(lambda: panel.is_by_hand)
    panel.tell("", np.zeros(3))
    assert panel.activity.tolist() == [0.12, -1.0, 0.5]
    assert Panel(viewer.server.gui, MUSCLES, is_trained=False).is_by_hand


def test_keys_are_told_apart(viewer: Viewer) -> None:
    """No key does two things; muscles beyond them have sliders, and an earlier panel keeps no key."""
    assert len(set(CONTRACT + EXTEND)) == len(CONTRACT) + len(EXTEND)
    for _ in range(2):
        panel = Panel(viewer.server.gui, [f"muscle-{number}" for number in range(30)], is_trained=False)
    keys = [each.hotkey for each in viewer.server.gui._command_handle_from_uuid.values()]
    assert len(keys) == len(set(keys)) == 2 * len(CONTRACT) + 3
    assert len(panel.activity) == 30
