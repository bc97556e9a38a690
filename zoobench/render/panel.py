"""The controls of a robot on the page: a slider and two keys for every muscle, and buttons for the episode."""

import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from zoobench.arrays import Array

if TYPE_CHECKING:
    from viser import GuiApi

CONTRACT, EXTEND = "ASDFGHJKLZXCVBNM", "QWERTYUIOP123456"
"""The keys of each muscle, from the first on; further ones have their sliders alone."""

_PRESS = 0.25  # activity that a press of a key adds or takes; one that is held is pressed many times
_SPEED, _SLOWEST = 0.25, 0.05  # of the robot's time by that of its viewers, at first and at least


class Panel:
    """The panel of a page.

    Args:
        gui: of the page; its contents are removed.
        muscles: their names.
        is_trained: whether there is a gait that can drive them.
    """

    def __init__(self, gui: "GuiApi", muscles: Sequence[str], is_trained: bool) -> None:
        gui.reset()
        gui.main_panel.dock_right()
        self.muscles, self.is_trained, self.is_paused = tuple(muscles), is_trained, False
        self._again = threading.Event()
        self._title, self._state = gui.add_markdown(""), gui.add_markdown("")
        self._pause = gui.add_button("Pause", hint="Escape")
        again = gui.add_button("Start again", hint="Backspace")
        self._speed = gui.add_slider("Speed", _SLOWEST, 1.0, 0.05, _SPEED, hint="1 is real time, if this machine can")
        self._gait = gui.add_checkbox("Trained gait", is_trained, visible=is_trained, hint="Else the sliders drive it")
        with gui.add_folder("Muscles: 1 contracts, -1 extends"):
            rest = gui.add_button("Rest all", hint="0")
            # their types hide from mypy that a value can be set
            self._sliders: list[Any] = [
                gui.add_slider(_label(*each), -1.0, 1.0, 0.05, 0.0) for each in enumerate(muscles)
            ]
        for button, key, name, act in (
            (self._pause, "escape", "Pause or go on", self._toggle),
            (again, "backspace", "Start again", self._again.set),
            (rest, "0", "Rest all muscles", self._rest),
        ):
            button.on_click(_ignoring(act))
            _on_key(gui, key, name, act)
        for number, (more, less) in enumerate(zip(CONTRACT, EXTEND, strict=True)):
            if number < len(muscles):
                _on_key(gui, more, f"Contract {muscles[number]}", self._press(number, _PRESS))
                _on_key(gui, less, f"Extend {muscles[number]}", self._press(number, -_PRESS))

    @property
    def speed(self) -> float:
        """The robot's time divided by that of its viewers."""
        return _within(_SLOWEST, float(self._speed.value), 1.0)

    @property
    def is_by_hand(self) -> bool:
        """Whether the sliders drive the robot."""
        return not self._gait.value

    @property
    def activity(self) -> Array:
        """Activity of every muscle by its slider `[muscle_count]`."""
        return np.array([_within(-1.0, float(slider.value), 1.0) for slider in self._sliders])

    def wants_again(self) -> bool:
        """Whether somebody has asked to start again since the last call."""
        asked = self._again.is_set()
        self._again.clear()
        return asked

    def entitle(self, text: str) -> None:
        """Show this text."""
        self._title.content = text

    def tell(self, text: str, activity: Array) -> None:
        """Say how the episode goes, and show the activity of a trained gait `[muscle_count]` on the sliders."""
        self._state.content = text
        for slider, value in zip(self._sliders, activity.tolist(), strict=True):
            slider.disabled = not self.is_by_hand
            if not self.is_by_hand:
                slider.value = round(value, 2)

    def _toggle(self) -> None:
        self.is_paused = not self.is_paused
        self._pause.label = "Go on" if self.is_paused else "Pause"

    def _rest(self) -> None:
        for slider in self._sliders:
            slider.value = 0.0

    def _press(self, muscle: int, change: float) -> Callable[[], None]:
        """The action of a key: change the activity of a muscle."""
        slider = self._sliders[muscle]

        def press() -> None:
            slider.value = _within(-1.0, slider.value + change, 1.0)

        return press


def _label(muscle: int, name: str) -> str:
    keys = f" {CONTRACT[muscle]}\N{NO-BREAK SPACE}{EXTEND[muscle]}" if muscle < len(CONTRACT) else ""
    return name + keys


def _within(low: float, value: float, high: float) -> float:
    """A value within bounds, as the page may send any; the lower bound for one that is no number."""
    return min(max(low, value), high)


def _on_key(gui: "GuiApi", key: Any, name: str, act: Callable[[], None]) -> None:
    gui.add_command(name, hotkey=key).on_trigger(_ignoring(act))


def _ignoring(act: Callable[[], None]) -> Callable[[object], None]:
    """A callback of viser, which does not ask what happened."""
    return lambda _: act()
