"""A robot in a window is moved by the keys that are held."""

from collections.abc import Iterator

import numpy as np
import pytest

from zoobench.cell.session import Step
from zoobench.errors import UsageError
from zoobench.gym.keyboard import Keyboard, Window, play
from zoobench.gym.worlds import Worlds, problem_of

pygame = pytest.importorskip("pygame")


@pytest.fixture(autouse=True)
def _unseen(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Windows that nobody sees."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    pygame.quit()


def test_one_row_of_keys_contracts_and_the_other_extends() -> None:
    """Both at once do nothing, and no other key does anything."""
    keyboard = Keyboard(["left", "right", "back"])
    assert keyboard.activity({"a", "w", "x"}).tolist() == [1.0, -1.0, 0.0]
    assert keyboard.activity({"d", "e"}).tolist() == [0.0, 0.0, 0.0]
    assert keyboard.legend == ["a / q  left", "s / w  right", "d / e  back"]
    with pytest.raises(UsageError, match="keys for 20 muscles, and this body has 21"):
        Keyboard([str(number) for number in range(21)])


def test_the_window_tells_keys_from_each_other() -> None:
    """Held until they are released; Enter and Esc are seen."""
    window = Window([])
    for kind, key in ((pygame.KEYDOWN, "a"), (pygame.KEYDOWN, "s"), (pygame.KEYUP, "a"), (pygame.KEYDOWN, "return")):
        pygame.event.post(pygame.event.Event(kind, key=pygame.key.key_code(key)))
    window.listen()
    assert (window.pressed - {"return"}, window.is_again, window.is_left) == ({"s"}, True, False)
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.key.key_code("escape")))
    window.listen()
    assert (window.is_again, window.is_left) == (False, True)
    window.close()


def test_the_robot_moves_while_a_key_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the frame after it was pressed; an episode that ends is told with its score, and another begins."""
    window, worlds = Window.show, Worlds.step
    shown: list[str] = []
    moved: list[float] = []

    def show(self: Window, picture: np.ndarray, text: str) -> None:
        window(self, picture, text)
        shown.append(text)
        if len(shown) == 3:
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.key.key_code("a")))
        if len(shown) == 8:
            pygame.event.post(pygame.event.Event(pygame.QUIT))

    def step(self: Worlds, actions: np.ndarray) -> tuple[np.ndarray, Step]:
        seen, found = worlds(self, actions)
        moved.append(float(self.session.activity(0)[0]))
        return seen, found

    monkeypatch.setattr(Window, "show", show)
    monkeypatch.setattr(Worlds, "step", step)
    told: list[str] = []
    frames = play(problem_of("ground", "caterpillar", "turning", "smoke", frames=5, worlds=1), 1, told.append)
    assert (frames, moved) == (8, [0.0] * 2 + [1.0] * 6)
    assert shown == [f"{0.008 * n:.2f} s" for n in (0, 1, 2, 3, 4, 0, 1, 2)]
    assert len(told) == 1
    assert told[0].startswith("score ")
