"""Marks on the skin of a robot that only pictures have: eyes at its head, and rings between its segments."""

from collections.abc import Callable
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.designs.base import Body
from zoobench.render.canvas import Canvas
from zoobench.render.skin import Skin

_FACE = 0.22
"""Share of a body's length from its foremost point that is its face."""

_TOWARDS = np.array([0.3, 0.8, 1.0])
"""Direction from the middle of the face to its right eye, by its length, height and width."""

_EYE, _PUPIL = 0.09, 0.055  # radius by the smaller of a body's height and width
_LOOK = {"ambient": 0.55, "diffuse": 0.5, "smooth_shading": True}


def put_marks(canvas: Canvas, mesh: Any, cover: Skin, body: Body) -> Callable[[], None]:
    """Eyes and rings on a skin that was put on the canvas as `mesh`; they go to where it is when this is called."""
    rest = cover.places @ body.positions
    updates = [_put_eye(canvas, mesh, rest, side) for side in (-1.0, 1.0)]
    if body.rings:
        updates.append(_put_rings(canvas, mesh, rest[:, 0], body.rings))

    def update() -> None:
        for each in updates:
            each()

    return update


def _put_eye(canvas: Canvas, mesh: Any, rest: Array, side: float) -> Callable[[], None]:
    """An eye on the right (+1) or left (-1) side of the foremost part of a skin at `rest` `[vertex_count, 3]` [m]."""
    face = np.flatnonzero(rest[:, 0] >= rest[:, 0].max() - _FACE * np.ptp(rest[:, 0]))
    low, high = rest[face].min(axis=0), rest[face].max(axis=0)
    unit = (rest[face] - (low + high) / 2) / np.maximum(high - low, 1e-9)
    vertex = face[(unit @ (_TOWARDS * (1.0, 1.0, side))).argmax()]
    girth = float(np.ptp(rest, axis=0)[1:].min())
    balls = []
    for radius, out, colour in ((_EYE, 0.0, "white"), (_PUPIL, 0.7 * _EYE, "#1a1a1a")):
        ball = canvas.pyvista.Sphere(radius=radius * girth)
        canvas.plotter.add_mesh(ball, color=colour, **_LOOK)
        balls.append((ball, ball.points.copy(), out * girth))

    def update() -> None:
        outward = mesh.point_data["Normals"][vertex]
        for ball, around, out in balls:
            ball.points = around + mesh.points[vertex] + out * outward

    return update


def _put_rings(canvas: Canvas, mesh: Any, along: Array, rings: tuple[float, ...]) -> Callable[[], None]:
    """Dark lines around a skin where its vertices had these places `along` the body at rest [m]."""
    mesh["along"] = along

    def drawn() -> Any:
        return mesh.contour(list(rings), scalars="along").tube(radius=0.006 * np.ptp(along))

    lines = drawn()
    canvas.plotter.add_mesh(lines, color="#3a2a44", scalars=None, **_LOOK)

    def update() -> None:
        lines.copy_from(drawn())

    return update
