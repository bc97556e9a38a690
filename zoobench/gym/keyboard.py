"""A robot in a window, whose muscles are moved by keys: to see whether a body can be controlled."""

import os
from collections.abc import Callable, Container, Sequence

import numpy as np
from numpy.typing import NDArray

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.errors import UsageError
from zoobench.gym.worlds import Worlds

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # it greets on standard output, which is for data
import pygame

CONTRACT, EXTEND = "asdfghjkl;zxcvbnm,./", "qwertyuiop1234567890"
"""The keys of each muscle, from the first on."""

_LINE, _MARGIN = 20, 220  # height of a line of text, and width of what stands beside the picture [pixels]


class Keyboard:
    """Keys to muscle activity: a row of keys contracts ten muscles, another extends them.

    Args:
        muscles: their names.

    Raises:
        UsageError: there are more muscles than keys.
    """

    def __init__(self, muscles: Sequence[str]) -> None:
        if len(muscles) > len(CONTRACT):
            raise UsageError(f"There are keys for {len(CONTRACT)} muscles, and this body has {len(muscles)}.")
        self._muscles = muscles

    @property
    def legend(self) -> list[str]:
        """A line for each muscle: its keys and name."""
        return [f"{a} / {b}  {name}" for a, b, name in zip(CONTRACT, EXTEND, self._muscles, strict=False)]

    def activity(self, pressed: Container[str]) -> Array:
        """Muscle activity in [-1, 1] while these keys are held `[muscle_count]`; 1 contracts."""
        count = len(self._muscles)
        return np.array([float(CONTRACT[m] in pressed) - float(EXTEND[m] in pressed) for m in range(count)])


class Window:
    """A window that shows pictures and knows which keys are held; it must be closed.

    Raises:
        UsageError: there is no screen.
    """

    def __init__(self, legend: Sequence[str]) -> None:
        self._legend = [*legend, "enter  begin again", "esc  leave"]
        self._screen: pygame.Surface | None = None
        self.pressed: set[str] = set()
        self.is_left = self.is_again = False
        try:
            pygame.display.init()
        except pygame.error as error:
            raise UsageError(f"No window can be opened here: {error}. `zoobench render` needs no screen.") from None
        pygame.font.init()
        pygame.display.set_caption("zoobench watch")

    def listen(self) -> None:
        """Take note of the keys that were pressed and released since the last call."""
        self.is_again = False
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                self.is_left = True
            elif event.type == pygame.KEYDOWN:
                name = pygame.key.name(event.key)
                self.is_left |= name == "escape"
                self.is_again |= name == "return"
                self.pressed.add(name)
            elif event.type == pygame.KEYUP:
                self.pressed.discard(pygame.key.name(event.key))

    def show(self, picture: NDArray[np.uint8], text: str) -> None:
        """Show a picture `[height, width, 3]` with the keys beside it and a line of text below them."""
        height, width, _ = picture.shape
        if self._screen is None:
            self._screen = pygame.display.set_mode((width + _MARGIN, height))
            self._font = pygame.font.Font(None, _LINE)
        self._screen.fill((255, 255, 255))
        self._screen.blit(pygame.surfarray.make_surface(picture.swapaxes(0, 1)), (0, 0))
        for number, line in enumerate([*self._legend, "", text]):
            is_held = line[:1] in self.pressed or line[4:5] in self.pressed
            written = self._font.render(line, True, (11, 98, 164) if is_held else (28, 32, 36))
            self._screen.blit(written, (width + 10, 10 + number * _LINE))
        pygame.display.flip()

    def close(self) -> None:
        """Close the window."""
        pygame.display.quit()


def play(problem: Problem, every: int, tell: Callable[[str], None]) -> int:
    """Let somebody move the robot until they leave; returns the number of control frames simulated.

    Args:
        problem: the cell; where an episode ends or its simulation diverges, another begins.
        every: show every n-th control frame.
        tell: called with the score of each episode that ends, or why it diverged.

    Raises:
        UsageError: see `Keyboard`, `Window` and `Worlds`.
    """
    keyboard = Keyboard(problem.body.muscles)
    worlds = Worlds(problem, 1, "muscles", (), "rgb_array")
    window = Window(keyboard.legend)
    frames = 0
    try:
        rng = np.random.default_rng(0)
        worlds.begin([rng])
        while not window.is_left:
            if frames % every == 0:
                window.show(worlds.picture(0), f"{float(worlds.session.times[0]):.2f} s")
            window.listen()
            _, step = worlds.step(keyboard.activity(window.pressed)[None].astype(np.float32))
            frames += 1
            for failure in step.failures.values():
                tell(str(failure))
            for evaluation in step.evaluations.values():
                tell(f"score {evaluation.score:.4g} {problem.task.unit}")
            if step.terminated[0] or step.truncated[0] or window.is_again:
                worlds.begin([rng])
    finally:
        worlds.close()
        window.close()
    return frames
