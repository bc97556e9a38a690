"""Water on a grid in pictures: how it spins in the layer of cells at half its height."""

import numpy as np

from zoobench.arrays import Array
from zoobench.render.actors import EDGES, Update
from zoobench.render.canvas import Canvas
from zoobench.render.colours import Colour, medium_colour
from zoobench.render.recording import Recording

STRONG = 40.0
"""Vorticity that is drawn in white or in the darkest blue [1/s]."""

_STILL, _TURNING = 0.08, 0.9  # opacity of the layer, which is no surface, where the water is still and where it turns
_SIDES = 0.13  # and of the sides of the water
_LEFT, _RIGHT = (1.0, 1.0, 1.0), (0.05, 0.1, 0.3)  # colours of water that turns quickly


def put_water(canvas: Canvas, recording: Recording) -> Update:
    """A layer of water and the edges of its box; lighter where it turns to the left, darker where to the right."""
    if recording.vorticity is None:
        return lambda _: None
    low, high = np.array(recording.scene.lower), np.array(recording.scene.upper)
    _, nx, nz = recording.vorticity.shape
    x, z = np.meshgrid(np.linspace(low[0], high[0], nx), np.linspace(low[2], high[2], nz), indexing="ij")
    layer = canvas.pyvista.StructuredGrid(x, np.full_like(x, (low[1] + high[1]) / 2), z)
    layer["colour"] = np.zeros((layer.n_points, 4), np.uint8)
    canvas.plotter.add_mesh(layer, scalars="colour", rgb=True, lighting=False)
    box = canvas.pyvista.Box([value for ends in zip(low, high, strict=True) for value in ends])
    canvas.plotter.add_mesh(box, color=medium_colour(recording.scene), opacity=_SIDES, lighting=False)
    edges = box.extract_all_edges()
    canvas.plotter.add_mesh(edges, color=EDGES, lighting=False, line_width=1.5)
    still = medium_colour(recording.scene)

    shapes = [(mesh, mesh.points.copy()) for mesh in (layer, box, edges)]

    def update(moment: int) -> None:
        assert recording.vorticity is not None
        for mesh, points in shapes:
            mesh.points = points + (0.0 if recording.offsets is None else recording.offsets[moment])
        colours = water_colours(recording.vorticity[moment].ravel(order="F"), still)
        layer["colour"] = (255.0 * colours).astype(np.uint8)

    return update


def water_colours(vorticity: Array, still: Colour) -> Array:
    """Colour and opacity of water that spins so fast `[...]` [1/s], in [0, 1] `[..., 4]`; `still` where it does not."""
    strength = np.clip(vorticity / STRONG, -1.0, 1.0)[..., None]
    left, right = np.array(_LEFT) - still, np.array(_RIGHT) - still
    colour = still + np.maximum(strength, 0.0) * left + np.maximum(-strength, 0.0) * right
    opacity = _STILL + (_TURNING - _STILL) * np.sqrt(np.abs(strength))
    return np.concatenate([colour, opacity], axis=-1)
