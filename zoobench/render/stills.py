"""Still pictures: environments with a robot in them, and bodies alone."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from zoobench.render.actors import put_fibres, put_ground, put_medium, put_objects, put_robot, put_skin
from zoobench.render.bodies import DENSITY, Sampled
from zoobench.render.canvas import INK, Canvas, Image, save, side_by_side
from zoobench.render.colours import NO_MUSCLE, named, tints
from zoobench.render.recording import Snapshot
from zoobench.render.skin import skin
from zoobench.render.viewpoint import camera_at, camera_for, region_of
from zoobench.render.vortices import put_water

SHEET = "environments.png"
"""Name of the sheet of several environments."""

_SIZE, _TILE = (1200, 675), (480, 270)  # of a picture, and of one on a sheet [pixels]
_SHEET_COLOURS = 224
_VIEWS = (("", 24.0, 62.0), ("from the right", 0.0, 90.0), ("from above", 90.0, 90.0))
"""Caption, elevation and azimuth of the views of a body [degrees], see `camera_at`."""


def draw_snapshots(shots: Sequence[Snapshot], folder: Path) -> Iterator[Path]:
    """Draw each snapshot into a PNG of its own and, of several, a sheet; the files as they are written.

    Raises:
        UsageError: the extra `render` is not installed, or the folder cannot be written.
    """
    for shot in shots:
        path = folder / f"{re.sub(r'[^a-z0-9.]+', '-', shot.env).strip('-')}.png"
        save(snapshot_image(shot, _SIZE), path)
        yield path
    if len(shots) > 1:
        sheet = side_by_side([snapshot_image(shot, _TILE, small=True) for shot in shots], columns=2)
        save(sheet, folder / SHEET, colours=_SHEET_COLOURS)
        yield folder / SHEET


def snapshot_image(shot: Snapshot, size: tuple[int, int], *, small: bool = False) -> Image:
    """The world of a snapshot, the muscles in colour; a small one with fewer words."""
    region = region_of(shot)
    camera = camera_for(region, size[0] / size[1])
    with Canvas(*size, smooth=True) as canvas:
        put_ground(canvas, region, camera.towards)
        put_medium(canvas, region, size[1] / 2 / camera.half_height)(0)
        put_water(canvas, shot)(0)
        put_robot(canvas, region, tints(shot.body.muscle_membership, shot.body.muscles)[None], rgb=True)(0)
        put_objects(canvas, region)(0)
        first, second = titles(shot, small=small)
        canvas.text(first, 0.02, 0.94, size=1.15)
        canvas.text(second, 0.02, 0.885)
        if not small:
            canvas.legend(named(shot.body.muscles), 0.86, 0.94)
            canvas.text("ruler: ahead and to the right of the robot's centre", 0.02, 0.02)
        canvas.aim(camera)
        return canvas.image()


def titles(shot: Snapshot, *, small: bool = False) -> tuple[str, str]:
    """Environment, fidelity, particles and moment in words, on two lines."""
    count = sum(places.shape[1] for places in (shot.robot, *shot.objects.values(), shot.medium))
    medium = shot.scene.medium
    below = "bare ground" if medium is None else medium.material.name
    if shot.scene.water is not None or shot.scene.surface_water is not None:
        below = "water"
    if small:
        return f"{shot.env} ({below})", f"{shot.fidelity}, {count:,} particles"
    moment = f"after {shot.times[0]:.3g} s" if shot.times[0] else "at rest, before the first frame"
    return f"{shot.env} ({below})", f"fidelity {shot.fidelity}, {count:,} particles, {moment}"


def portrait_image(sampled: Sampled, title: str) -> Image:
    """A body from three sides, its muscles in colour and their fibres as strokes."""
    body = sampled.body
    cover = skin(body)
    vertices = cover.places @ body.positions
    size, mass = body.size, body.masses(DENSITY).sum()
    layout: dict[str, Any] = {
        "shape": (2, 3),
        "groups": [(slice(None), 0), (slice(None), 2)],
        "col_weights": [0.56, 0.29, 0.15],
    }
    with Canvas(*_SIZE, smooth=True, **layout) as canvas:
        for (caption, elevation, azimuth), place in zip(_VIEWS, ((0, 0), (0, 1), (1, 1)), strict=True):
            canvas.plotter.subplot(*place)
            put_skin(canvas, cover, body.positions, tints(body.muscle_membership, body.muscles), rgb=True)
            put_fibres(canvas, cover, body)
            canvas.text(caption, 0.02, 0.88)
            width, height = canvas.view_size
            canvas.aim(camera_at(vertices, elevation, azimuth, width / height, room=(0.92, 0.84), shift=(0.0, 0.15)))
        canvas.plotter.subplot(0, 0)
        canvas.text(
            f"{title}: {' x '.join(f'{1e3 * length:.0f}' for length in size)} mm, {1e3 * mass:.0f} g, "
            f"{body.particle_count:,} particles at 1/{1 / sampled.grid.grid_spacing:.0f} m",
            0.02, 0.94, size=1.15,
        )  # fmt: skip
        canvas.plotter.subplot(0, 2)
        canvas.legend([*named(body.muscles), NO_MUSCLE, ("strokes: fibres", INK)], 0.05, 0.94)
        return canvas.image()
