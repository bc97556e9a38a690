"""Film three animals in three media for the README: `python docs/animals.py` writes docs/animals.gif."""

from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from PIL import Image

from zoobench.cli.solutions import solution_named
from zoobench.render.canvas import side_by_side
from zoobench.render.film import film
from zoobench.render.film_files import film_images

ANIMALS = (
    ("best:ground/movement-speed/panda", "panda on firm ground"),
    ("best:snow/movement-speed/baby-seal", "baby seal on snow"),
    ("best:beds/desert/movement-speed/fish", "fish on sand"),
)
FRAMES, EVERY, SIZE, COLOURS = 100, 3, (400, 260), 220
SLOWED = 4


def main() -> None:
    """Simulate, draw and write."""
    rows = []
    for name, title in ANIMALS:
        found = solution_named(name, "")
        episode = film(replace(found.spec, frames=FRAMES), found.params, moments=range(0, FRAMES + 1, EVERY))
        rows.append(list(film_images(episode, title, SIZE, smooth=True)))
    images = [side_by_side(moment, columns=3) for moment in zip(*rows, strict=True)]
    palette = Image.fromarray(np.vstack(images[:: len(images) // 3])).quantize(COLOURS)
    pictures = [np.asarray(_in(palette, image)) for image in images]
    iio.imwrite(Path(__file__).with_suffix(".gif"), pictures, duration=SLOWED * 8 * EVERY, loop=0)


def _in(palette: Image.Image, image: np.ndarray) -> Image.Image:
    return Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE).convert("RGB")


if __name__ == "__main__":
    main()
