"""Bodies that `neat` begins with, as a picture: `python benchmarks/first_bodies.py docs/first-bodies.png`.

The first generations of three populations of ten in the design space `voxel` at `draft`. A colour is the strongest
muscle of a voxel; the title is the share of the workspace that is solid. A body that cannot be built is an empty frame.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from zoobench.arrays import Array
from zoobench.cell.problem import Problem
from zoobench.designs.base import Body
from zoobench.errors import SceneError
from zoobench.methods.hyperneat import Bodies
from zoobench.render.figures import blank, save
from zoobench.testing import small_cell

POPULATIONS = 3
POPULATION = 10
COLUMNS = 6
EDGE = 0.0125  # of a voxel [m]
_COLOURS = 64


def main() -> None:
    """Draw them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    problem = Problem(small_cell(design="voxel", fidelity="draft"))
    points = [
        point for seed in range(POPULATIONS) for point in Bodies(problem, np.random.default_rng(seed), POPULATION).ask()
    ]
    rows = -(-len(points) // COLUMNS)
    figure = blank((1.5 * COLUMNS, 1.2 * rows), dpi=100)
    for number, point in enumerate(points, start=1):
        axes: Any = figure.add_subplot(rows, COLUMNS, number, projection="3d")
        axes.set_axis_off()
        axes.set_box_aspect((8, 4, 4), zoom=1.15)
        axes.set(xlim=(0, 8), ylim=(0, 4), zlim=(0, 4))
        draw(axes, problem, np.concatenate([np.zeros(problem.robot.control_count), point]))
    save(figure, out)
    with Image.open(out) as image:  # a palette, a fifth of the size
        small = image.convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
    small.save(out, optimize=True)


def draw(axes: Any, problem: Problem, parameters: Array) -> None:
    """One body in its axes."""
    from matplotlib import colormaps

    try:
        body: Body = problem.robot.formed(parameters)
    except SceneError:
        axes.set_title("empty", fontsize=8, y=0.94)
        return
    low = problem.body.box[0]
    x, y, z = np.floor((body.positions - low) / EDGE).astype(int).T.clip(0, 7)
    solid, muscle = np.zeros((8, 4, 4), bool), np.zeros((8, 4, 4), int)
    solid[x, z, y], muscle[x, z, y] = True, body.muscle_membership.argmax(axis=1)
    axes.voxels(solid, facecolors=colormaps["tab10"](muscle), edgecolor=(0, 0, 0, 0.25), linewidth=0.3)
    axes.set_title(f"{body.volumes.sum() / problem.body.volumes.sum():.0%}", fontsize=8, y=0.94)


if __name__ == "__main__":
    main()
