"""Film published solutions: `python docs/films.py` writes docs/animals.gif, docs/manipulation.mp4 and docs/skills.mp4.

The first has three animals in three media, the others the best solutions of rows of the board of their name, of which
docs/manipulation.png has stills. Six minutes of one core; `python docs/films.py skills` writes that film alone.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from PIL import Image

from zoobench.db import published
from zoobench.db.published import PublishedRun
from zoobench.render.canvas import save, side_by_side
from zoobench.render.film import film
from zoobench.render.film_files import film_images
from zoobench.spec import FRAME_SECONDS

DOCS = Path(__file__).parent
ANIMALS = (
    ("best:gaits/ground/movement-speed/panda", "panda on firm ground"),
    ("best:gaits/ice/movement-speed/baby-seal", "baby seal on ice"),
    ("best:gaits/desert/movement-speed/fish", "fish on sand"),
)
MANIPULATIONS = (
    ("best:manipulation/ground/push/caterpillar", "push a box"),
    ("best:manipulation/ground/push-to/caterpillar", "push it to a place"),
    ("best:manipulation/ground/kick/block", "kick a ball"),
    ("best:manipulation/ground/carry/block", "carry a sheet"),
    ("best:manipulation/ground/catch/block", "catch a ball"),
    ("best:manipulation/ground/lift/gripper", "lift a ball"),
    ("best:manipulation/ground[obstacle=ceiling]/movement-speed/caterpillar", "pass a ceiling"),
    ("best:manipulation/ground[obstacle=slot]/movement-speed/caterpillar", "pass a slot"),
    ("best:manipulation/ground/reach/arm", "reach a place"),
    ("best:manipulation/ground/jump/panda", "jump"),
    ("best:manipulation/ground/shape/caterpillar", "change the shape"),
)
SKILLS = (
    ("best:skills/ground/height/block", "be higher"),
    ("best:skills/ground/span/block", "be longer"),
    ("best:skills/ground/topple/caterpillar", "topple a column"),
    ("best:skills/ground/kick/block", "throw a box"),
    ("best:skills/ground/reach/arm", "reach around a post"),
    ("best:skills/ground/spin/gripper", "turn a box"),
    ("best:skills/ground/flip/block", "flip"),
    ("best:skills/ground/balance/block", "raise the head"),
    ("best:skills/ground[step_height=0.02]/movement-speed/block", "mount a step"),
    ("best:skills/ground[obstacle=hurdle]/movement-speed/block", "leap a hurdle"),
    ("best:skills/ground[obstacle=slot]/movement-speed/caterpillar", "pass a slot"),
    ("best:skills/ground/push/caterpillar", "push a smooth box"),
)
BOARDS = {"manipulation": MANIPULATIONS, "skills": SKILLS}
"""Name and title of each solution."""
STILLS = ("manipulation",)  # boards with a picture of their stills, too

SLOWED = 4
EVERY = 3  # frames from picture to picture
SHOWN_SECONDS = SLOWED * FRAME_SECONDS * EVERY  # of a picture
COLUMNS = 3
SIZE = 400, 256  # of each robot's picture [pixels]
STILL_WIDTH = 350  # without the colour bar [pixels]
COLOURS = 220  # of the .gif and of stills


def main() -> None:
    """Simulate, draw and write the films that are named, or all."""
    wanted = sys.argv[1:] or ["animals", *BOARDS]
    if "animals" in wanted:
        _write_animals()
    for board, solutions in BOARDS.items():
        if board in wanted:
            rows = [list(_pictures(published.named(name), title)) for name, title in solutions]
            iio.imwrite(DOCS / f"{board}.mp4", _sheets(rows), fps=1 / SHOWN_SECONDS, quality=5)
            if board in STILLS:
                save(_stills(rows), DOCS / f"{board}.png", colours=COLOURS)


def _write_animals() -> None:
    pictures = _sheets([list(_pictures(_shortened(published.named(name)), title)) for name, title in ANIMALS])
    palette = Image.fromarray(np.vstack(pictures[:: len(pictures) // 3])).quantize(COLOURS)
    reduced = [np.asarray(_in(palette, picture)) for picture in pictures]
    iio.imwrite(DOCS / "animals.gif", reduced, duration=1000 * SHOWN_SECONDS, loop=0)


def _shortened(run: PublishedRun) -> PublishedRun:
    return replace(run, spec=replace(run.spec, frames=100))


def _sheets(rows: list[list[np.ndarray]]) -> list[np.ndarray]:
    """Pictures of solutions side by side from start to end; one whose episode is over stands still."""
    longest = max(map(len, rows))
    return [
        side_by_side([row[min(moment, len(row) - 1)] for row in rows], columns=COLUMNS) for moment in range(longest)
    ]


def _stills(rows: list[list[np.ndarray]]) -> np.ndarray:
    """A row for each solution: its start, two and four fifths of its episode, and its end."""
    moments = [row[round(share * (len(row) - 1))][:, :STILL_WIDTH] for row in rows for share in (0.0, 0.4, 0.8, 1.0)]
    whole = Image.fromarray(side_by_side(moments, columns=4))
    return np.asarray(whole.resize((3 * whole.width // 4, 3 * whole.height // 4), Image.Resampling.LANCZOS))


def _pictures(run: PublishedRun, title: str) -> Iterator[np.ndarray]:
    episode = film(run.spec, run.params, moments=range(0, run.spec.frames + 1, EVERY))
    return film_images(episode, title, SIZE, smooth=True)


def _in(palette: Image.Image, image: np.ndarray) -> Image.Image:
    return Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE).convert("RGB")


if __name__ == "__main__":
    main()
