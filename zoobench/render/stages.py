"""The body of a run as it became: the best after some iterations, side by side."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.feasibility import SOLID
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.render.actors import put_skin
from zoobench.render.bodies import Sampled, formed
from zoobench.render.canvas import Canvas, Image
from zoobench.render.colours import NO_MUSCLE, named, tints
from zoobench.render.film import evenly
from zoobench.render.skin import Skin, skin
from zoobench.render.viewpoint import Camera, camera_at
from zoobench.spec import RunSpec, repeat_command

MOST = 7
"""Bodies in a picture."""

_TILE = (270, 215)  # of a body [pixels]
_KEY = 150  # width of the column of words [pixels]
_VIEW = (24.0, 62.0)  # elevation and azimuth, see `camera_at` [degrees]


class Stage(NamedTuple):
    """A body with its caption and its score."""

    words: str
    score: str
    sampled: Sampled


class Milestone(Protocol):
    """The best parameters of a run after `step` iterations, and their score."""

    @property
    def step(self) -> int:
        """Iterations done."""

    @property
    def score(self) -> float:
        """The score of the parameters."""

    @property
    def params(self) -> Sequence[float]:
        """Parameters of controller and design."""


def stages_of(spec: RunSpec, milestones: Sequence[Milestone], text: Callable[[float], str]) -> list[Stage]:
    """The bodies of a run at its milestones, the last of which is its solution; `MOST` of them where there are more.

    `text` is how a score reads.

    Raises:
        UsageError: the body is given, an earlier zoobench kept the solution alone, or it does not fit this version.
    """
    component = registry.get(Kind.DESIGN, spec.design.name)
    if "space" not in component.tags:
        raise UsageError(
            f"The body of this run is given, {spec.design.name}, and is the same in every iteration. "
            "Draw its gait with --strip gait."
        )
    *before, last = milestones
    if not before:
        raise UsageError(
            "This run has only its solution, since an earlier zoobench executed it. Repeat it with "
            f"`{repeat_command(spec)} --rerun {spec.method.name}`."
        )
    distinct = [*(each for each in before if tuple(each.params) != tuple(last.params)), last]
    return [
        Stage(
            f"after {each.step:,} iteration" + "s" * (each.step != 1),
            text(each.score),
            formed(spec, each.params),
        )
        for each in (distinct[place] for place in chosen(len(distinct)))
    ]


def chosen(count: int) -> list[int]:
    """The places of the bodies to show among so many: the first, the last, and evenly between."""
    return evenly(count - 1, min(count, MOST))


def stages_image(stages: Sequence[Stage], title: str) -> Image:
    """Bodies side by side at one scale: above by muscles, below by stiffness.

    Raises:
        UsageError: there is none, or the extra `render` is not installed.
    """
    if not stages:
        raise UsageError("There is no body to draw. Give one stage or more.")
    bodies = [stage.sampled.body for stage in stages]
    covers = [skin(body) for body in bodies]
    camera = _camera(bodies, covers)
    solid = np.concatenate([body.stiffness[body.occupancy > SOLID] for body in bodies])
    limits = (float(solid.min()), float(solid.max()) if np.ptp(solid) > 1e-6 else float(solid.min()) + 1e-3)
    width = _TILE[0] * len(stages) + _KEY
    layout = {
        "shape": (2, len(stages) + 1),
        "groups": [(slice(None), len(stages))],
        "col_weights": [_TILE[0] / width] * len(stages) + [_KEY / width],
    }
    with Canvas(width, 2 * _TILE[1], smooth=True, **layout) as canvas:
        for column, (stage, cover) in enumerate(zip(stages, covers, strict=True)):
            _put_body(canvas, stage, cover, camera, column, limits)
        canvas.plotter.subplot(0, 0)
        canvas.text(title, 0.03, 0.92)
        canvas.plotter.subplot(0, len(stages))
        canvas.text("muscles", 0.05, 0.94)
        canvas.legend([*named(bodies[-1].muscles), NO_MUSCLE], 0.05, 0.89)
        return canvas.image()


def _put_body(
    canvas: Canvas, stage: Stage, cover: Skin, camera: Camera, column: int, limits: tuple[float, float]
) -> None:
    body = stage.sampled.body
    canvas.plotter.subplot(0, column)
    put_skin(canvas, cover, body.positions, tints(body.muscle_membership, body.muscles), rgb=True)
    canvas.text(stage.words, 0.03, 0.81)
    canvas.text(stage.score, 0.03, 0.73)
    canvas.aim(camera)
    canvas.plotter.subplot(1, column)
    bar = {
        "title": "stiffness / its material's", "n_labels": 2, "fmt": "%.2f", "position_x": 0.1, "position_y": 0.82,
        "width": 0.7, "height": 0.12, "title_font_size": canvas.font_size + 2, "label_font_size": canvas.font_size + 2,
    }  # fmt: skip
    look = {"scalar_bar_args": bar} if column == 0 else {"show_scalar_bar": False}
    put_skin(canvas, cover, body.positions, body.stiffness, cmap="viridis", clim=limits, **look)
    canvas.aim(camera)


def _camera(bodies: Sequence[Body], covers: Sequence[Skin]) -> Camera:
    """One view for all, so that sizes can be compared."""
    points = np.vstack([cover.places @ body.positions for body, cover in zip(bodies, covers, strict=True)])
    return camera_at(points, *_VIEW, _TILE[0] / _TILE[1], room=(0.9, 0.62), shift=(0.0, 0.8))
