"""Draw the small pictures of components in the reference: `python docs/pictures.py [KIND ...]` writes docs/pictures/.

The kinds are envs, tasks, designs, controllers and methods; all take a minute of one core. Environments are cut out of
docs/environments.png, which `zoobench design picture --out docs` draws. Bodies of design spaces and learning curves are
those of the published boards.
"""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.muscle_places import placed_on
from zoobench.controllers.base import Controller, OpenLoop
from zoobench.db import published
from zoobench.registry import Kind
from zoobench.render import figures
from zoobench.render.actors import put_fibres, put_skin
from zoobench.render.bodies import Sampled, body_at, formed
from zoobench.render.canvas import Canvas, save
from zoobench.render.colours import OBJECT, palette, tints
from zoobench.render.skin import skin
from zoobench.render.viewpoint import camera_at
from zoobench.report.curve_plot import AMOUNTS, line
from zoobench.report.leaderboard_files import from_text
from zoobench.report.learning_curves import LearningCurve
from zoobench.report.palette import styles
from zoobench.spec import FRAME_SECONDS, Ref
from zoobench.tasks.paths import INTERVAL
from zoobench.tasks.paths import Path as Route

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOCS = Path(__file__).parent
FOLDER = DOCS / "pictures"
WIDTH, HEIGHT = 480, 270  # of a picture [pixels]
COLOURS = 64
DPI = 100  # dots in an inch of a figure
VARIATION = 0.4  # of parameters, by their standard deviation
SECONDS = 4.0  # of a target's path
FRAMES = 100  # of a controller's signal
LETTERS = 9  # [points]
CELLS = {
    "diffphysics": ("gaits", "ground", "caterpillar"),
    "cmaes": ("gaits", "ground", "caterpillar"),
    "random": ("gaits", "ground", "caterpillar"),
    "ppo": ("control", "ground", "caterpillar"),
    "evolution": ("codesign", "ocean", "voxel"),
    "neat": ("design", "ocean", "voxel"),
}
"""Board, environment and design of the cell in which each method is shown; the task is movement-speed."""

ROUTES = {"straight": "-", "arc": "--", "s-curve": "-.", "random": ":"}
"""Strokes of the target's paths."""

MANIPULATED = {
    "push": ((6, 6), (10, 0), (12, 0), "way of the object at the end [m]"),
    "push-to": ((6, 6), (10, 0), (11, -4), "by how much nearer\nto the place it is at the end [m]"),
    "kick": ((6, 6), (10, 0), (16, 0), "its way less that of the robot [m]"),
    "carry": ((16, 3), (0, 6), (14, 0), "its way, less ten times\nhow far it is below its start [m]"),
    "lift": ((6, 6), (9, 3), (0, 5), "its rise,\non average [m]"),
    "catch": ((6, 6), (20, 3), (-20, 5), "its height above its start,\non average in the last quarter [m]"),
    "topple": ((4, 10), (9, 5), (8, -3), "turn of its upright\naxis at the end [rad]"),
    "spin": ((8, 3), (10, 0), (0, 0), "its turn about the\nvertical at the end [rad]"),
}
"""Of tasks with an object: its size, its place, its way [cm] and what counts."""


def main() -> None:
    """Draw the kinds that were asked for, or all."""
    for kind in sys.argv[1:] or DRAWN:
        for name, image in DRAWN[kind]():
            save(image, FOLDER / f"{kind}-{name}.png", colours=COLOURS)


def envs() -> Iterator[tuple[str, np.ndarray]]:
    """The tiles of the sheet of environments, which are in the order of their names, two in a row."""
    sheet = np.asarray(Image.open(DOCS / "environments.png").convert("RGB"))
    for number, name in enumerate(registry.names(Kind.ENV)):
        top, left = HEIGHT * (number // 2), WIDTH * (number % 2)
        yield name, sheet[top : top + HEIGHT, left : left + WIDTH]


def designs() -> Iterator[tuple[str, np.ndarray]]:
    """Bodies, their muscles in colour; of a design space the fastest that was published."""
    for name in registry.names(Kind.DESIGN):
        component = registry.get(Kind.DESIGN, name)
        if component.needs_settings:
            continue
        if "space" in component.tags:
            found = published.named(f"best:codesign/ocean/movement-speed/{name}")
            yield name, body_image(formed(found.spec, list(found.params)))
        else:
            yield name, body_image(body_at(Ref(name)))


def body_image(sampled: Sampled) -> np.ndarray:
    """A body from the front and the right, and how long it is."""
    body = sampled.body
    cover = skin(body)
    with Canvas(WIDTH, HEIGHT, smooth=True) as canvas:
        put_skin(canvas, cover, body.positions, tints(body.muscle_membership, body.muscles), rgb=True)
        put_fibres(canvas, cover, body)
        canvas.aim(
            camera_at(cover.places @ body.positions, 24.0, 62.0, WIDTH / HEIGHT, room=(0.9, 0.85), shift=(0.0, 0.0))
        )
        canvas.text(f"{1e3 * body.size[0]:.0f} mm long, {body.muscle_count} muscles", 0.02, 0.03)
        return canvas.image()


def tasks() -> Iterator[tuple[str, np.ndarray]]:
    """What each task asks for, seen from above or from the side."""
    for name, draw in _ways().items():
        figure, axes = _blank()
        robot = _robot()
        axes.plot(robot[:, 0], robot[:, 2], ".", color="0.85", markersize=5, zorder=0)
        draw(axes)
        axes.invert_yaxis()  # the robot's right is below where it looks to the right
        _scaled(axes, "z, to the right [cm]")
        yield name, _pixels(figure)
    for name, (after, text) in _forms().items():
        figure, axes = _blank()
        across = 2 if name == "area" else 1
        robot = _robot()
        axes.plot(robot[:, 0], robot[:, across], ".", color="0.85", markersize=5, zorder=0)
        axes.plot(after[:, 0], after[:, across], ".", color="#2878bd", markersize=2)
        axes.set_title(text, fontsize=LETTERS)
        if across == 1:
            axes.axhline(0.0, color="0.3", linewidth=1.0)
        axes.set(xlim=(-8, 8), ylim=(-1, 11) if across == 1 else (5, -5))
        _scaled(axes, "z, to the right [cm]" if across == 2 else "y, up [cm]")
        yield name, _pixels(figure)
    for name, (size, place, way, text) in MANIPULATED.items():
        figure, axes = _blank()
        across = 2 if name in ("push", "push-to", "kick", "spin") else 1
        robot = _robot()
        axes.plot(robot[:, 0], robot[:, across], ".", color="0.85", markersize=5, zorder=0)
        _object(axes, name, np.array(size), np.array(place), np.array(way))
        axes.text(0.02, 0.05 if across == 2 else 0.84, text, fontsize=LETTERS, transform=axes.transAxes)
        axes.set(xlim=(-10, 30), ylim=(11, -11) if across == 2 else (-3, 19))
        _scaled(axes, "z, to the right [cm]" if across == 2 else "y, up [cm]")
        yield name, _pixels(figure)


def _robot() -> Array:
    """Particles of a caterpillar about the middle of its sole `[n, 3]` [cm]."""
    robot: Array = 100.0 * body_at(Ref("caterpillar"), Ref("standard")).body.positions
    return robot - robot.mean(axis=0) * (1.0, 0.0, 1.0) - (0.0, float(robot[:, 1].min()), 0.0)


def _scaled(axes: "Axes", across: str) -> None:
    """Equal scales, marks every 5 cm, and what the axes are."""
    from matplotlib.ticker import MultipleLocator

    axes.set_aspect("equal", adjustable="datalim")
    axes.xaxis.set_major_locator(MultipleLocator(5))
    axes.yaxis.set_major_locator(MultipleLocator(5))
    axes.set_xlabel("x, ahead [cm]", fontsize=LETTERS)
    axes.set_ylabel(across, fontsize=LETTERS)


def _ways() -> "dict[str, Callable[[Axes], None]]":
    """Of tasks with a way over the ground, what draws it."""
    return {
        "movement-speed": _ahead, "turning": _turn, "final-position": _goal,
        "velocity-tracking": lambda axes: _paths(axes, every=None),
        "waypoint-following": lambda axes: _paths(axes, every=INTERVAL),
    }  # fmt: skip


def _forms() -> dict[str, tuple[Array, str]]:
    """Of tasks without a way, a robot that does what is asked for `[n, 3]` [cm], and what counts."""
    robot = _robot()
    middle = np.array([0.0, 2.5, 0.0])
    return {
        "jump": (robot + 2.0 * middle, "greatest height of the lowest particle [m]"),
        "flip": (middle + (robot - middle) @ _pitch(-0.8).T + (3.0, 5.0, 0.0), "forward pitch at the end [rad]"),
        "balance": (robot @ _pitch(1.2).T + (0.0, 4.3, 0.0), "mean elevation of the direction ahead [rad]"),
        "height": (robot * (0.9, 1.4, 1.0), "mean growth of the extent along y [m]"),
        "span": (robot * (1.3, 0.9, 1.0), "mean growth of the extent along x [m]"),
        "area": (robot * (1.15, 1.0, 1.3), "mean growth of the area covered [m$^2$]"),
        "climb": (robot + np.array([0.0, 4.0, 0.0]), "mean height gained, last quarter [m]"),
        "reach": (robot @ _pitch(0.5).T + (0.0, 2.4, 0.0), "fall of the head's distance from a place [m]"),
        "shape": (robot * (0.9, 1.1, 1.0), "mean fall of the error of the proportions [m]"),
    }


def _pitch(angle: float) -> Array:
    """The matrix of a rotation by which what is ahead goes up."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _object(axes: "Axes", task: str, size: Array, place: Array, way: Array) -> None:
    """An object at the start, pale where it ends, and an arrow between both [cm]."""
    from matplotlib.patches import Circle, Rectangle

    turned = {"topple": 90.0, "spin": 50.0}.get(task, 0.0)
    for centre, alpha, turn in ((place, 1.0, 0.0), (place + way, 0.35, turned)):
        if task == "kick":
            shape = Circle(tuple(centre), size[0] / 2, color=OBJECT, alpha=alpha, linewidth=0)
        else:
            shape = Rectangle(
                tuple(centre - size / 2), *size, angle=-turn, rotation_point="center", color=OBJECT, alpha=alpha,
                linewidth=0,
            )  # fmt: skip
        axes.add_patch(shape)
    if way.any():
        axes.annotate("", place + way, place, arrowprops={"arrowstyle": "-|>", "color": "#2878bd", "linewidth": 2})
    if task == "push-to":
        axes.plot(*(place + way), "x", color="#c2188f", markersize=9, markeredgewidth=2)


def _ahead(axes: "Axes") -> None:
    axes.annotate("", (16, 0), (0, 0), arrowprops={"arrowstyle": "-|>", "color": "#2878bd", "linewidth": 2})
    axes.text(8, -1.2, "mean speed of the centre of mass [m/s]", fontsize=LETTERS, ha="center")
    axes.set_xlim(-8, 22)


def _turn(axes: "Axes") -> None:
    angles = np.linspace(0.0, 1.4 * np.pi, 60)
    x, z = 7.0 * np.cos(angles), -7.0 * np.sin(angles)
    axes.plot(x, z, color="#2878bd", linewidth=2)
    axes.annotate("", (x[-1] + 0.9, z[-1] - 0.1), (x[-1], z[-1]), arrowprops={"arrowstyle": "-|>", "color": "#2878bd"})
    axes.text(9.5, -4, "mean speed of matter around\nthe centre of mass [m/s],\ncounter-clockwise", fontsize=LETTERS)
    axes.set(xlim=(-10, 28), ylim=(-9, 9))


def _goal(axes: "Axes") -> None:
    task = registry.create(Kind.TASK, Ref("final-position"))
    x, z = 100.0 * task.x, 100.0 * task.z
    axes.plot(x, z, "x", color="#c2188f", markersize=9, markeredgewidth=2)
    axes.text(x, z - 1.2, "where the centre of mass\nis to be at the end", fontsize=LETTERS, ha="center", va="bottom")
    axes.set_xlim(-8, 22)


def _paths(axes: "Axes", *, every: float | None) -> None:
    """The target's paths, with its place at times so far apart, or its velocity."""
    speed = registry.create(Kind.TASK, Ref("waypoint-following")).speed
    times = np.arange(0.0, SECONDS, FRAME_SECONDS)
    marks = np.arange(0.0, SECONDS, every or 0.8)
    for shape, stroke in ROUTES.items():
        route = Route(shape, speed)
        x, _, z = 100.0 * route.positions(times).T
        axes.plot(x, z, stroke, color="0.3", linewidth=1.2, label=shape)
        at_x, _, at_z = 100.0 * route.positions(marks).T
        if every:
            axes.plot(at_x, at_z, "o", color="#c2188f", markersize=3)
        else:
            along, _, aside = 100.0 * route.velocities(marks).T
            axes.quiver(
                at_x, at_z, along, aside, color="#c2188f", angles="xy", scale_units="xy", scale=2.0, width=0.005
            )  # fmt: skip
    title = f"path, {100 * speed:g} cm/s"
    figure = axes.get_figure(root=True)
    figure.legend(fontsize=LETTERS, loc="outside right upper", title=title, title_fontsize=LETTERS, frameon=False)


def controllers() -> Iterator[tuple[str, np.ndarray]]:
    """The activity of three muscles under random parameters; what a closed loop observes changes halfway."""
    for name in registry.names(Kind.CONTROLLER):
        if registry.get(Kind.CONTROLLER, name).needs_settings:
            continue
        body = body_at(Ref("fish"), Ref("standard")).body
        figure, axes = _blank()
        controller = placed_on(body, registry.create(Kind.CONTROLLER, Ref(name)))
        signal = activity(controller, body.muscle_count)
        times = np.arange(FRAMES + 1) * FRAME_SECONDS
        for muscle in range(0, 6, 2):
            colour = palette(body.muscles)[muscle]
            axes.stairs(signal[:, muscle], times, color=colour, baseline=None, label=body.muscles[muscle])
        axes.set(ylim=(-1.08, 1.08), xlim=(0.0, times[-1]))
        axes.set_xlabel("time [s]", fontsize=LETTERS)
        axes.set_ylabel("activity [-]", fontsize=LETTERS)
        if not isinstance(controller, OpenLoop):
            axes.axvline(times[FRAMES // 2], color="0.3", linewidth=1.0, linestyle=":")
            axes.text(times[FRAMES // 2], -1.04, " what it observes changes", fontsize=LETTERS)
        figure.legend(fontsize=LETTERS, loc="outside upper center", ncols=3, frameon=False)
        yield name, _pixels(figure)


def activity(controller: Controller, muscles: int, observed: int = 40) -> Array:
    """Activity of every muscle in every frame `[FRAMES, muscles]`, near a draw from the prior."""
    import torch

    rng = np.random.default_rng(0)
    times = torch.arange(FRAMES, dtype=torch.float64) * FRAME_SECONDS
    if isinstance(controller, OpenLoop):
        parameters = torch.as_tensor(_varied(controller.initial(rng, muscles), rng))[None]
        return np.asarray(controller.actuation(parameters, times, muscles))[:, 0]
    parameters = torch.as_tensor(_varied(controller.initial(rng, muscles, observed), rng))
    seen = [np.zeros(observed), rng.normal(size=observed)]
    return np.array(
        [
            controller.response(parameters, float(time), torch.as_tensor(seen[2 * frame // FRAMES]), muscles).numpy()
            for frame, time in enumerate(times)
        ]
    )


def _varied(parameters: Array, rng: np.random.Generator) -> Array:
    """Parameters a little away from a draw; the priors of several controllers begin with the same waves."""
    return parameters + (VARIATION * parameters.std() * rng.normal(size=parameters.shape) if len(parameters) else 0.0)


def methods() -> Iterator[tuple[str, np.ndarray]]:
    """The learning curves of a published cell; the method in bold, what it is compared with beside it."""
    for name, (board, env, design) in CELLS.items():
        text = (DOCS.parent / "leaderboards" / f"{board}.json").read_text(encoding="utf-8")
        published_board = from_text(text, board)
        chosen = {
            result.run.id: result for result in published_board.results()
            if (result.spec.env.name, result.spec.design.name, result.spec.task.name) == (env, design, "movement-speed")
        }  # fmt: skip
        if name == "ppo":
            chosen = {run: result for run, result in chosen.items() if result.spec.controller.name == "policy-network"}
        known = {
            run: LearningCurve(curve.spent, curve.scores, chosen[run], "substeps")
            for run, curve in published_board.curves(chosen).items()
        }
        figure, axes = _blank()
        looks = styles({result.spec.method for result in chosen.values()})
        for method, (colour, stroke) in looks.items():
            drawn = line([known[run] for run, result in chosen.items() if result.spec.method == method], 1000.0)
            if drawn is None:
                continue
            width, opacity = (2.4, 1.0) if method.name == name else (1.0, 0.8)
            axes.step(
                drawn.spent, drawn.mean, stroke, where="post", color=colour, linewidth=width, alpha=opacity,
                label=method.name + (f", sigma {method.kwargs['sigma']:g}" if method.name == "cmaes" else ""),
            )  # fmt: skip
            if method.name == name:
                axes.fill_between(drawn.spent, drawn.low, drawn.high, step="post", color=colour, alpha=0.2, linewidth=0)
        axes.set_title(f"{design}, {env}, movement-speed, 3 seeds", fontsize=LETTERS)
        axes.set_xlabel(AMOUNTS["substeps"], fontsize=LETTERS)
        axes.set_ylabel("best speed so far [mm/s]", fontsize=LETTERS)
        axes.locator_params(axis="x", nbins=4)
        axes.legend(fontsize=LETTERS)
        yield name, _pixels(figure)


def _blank() -> "tuple[Figure, Axes]":
    figure = figures.blank((WIDTH / DPI, HEIGHT / DPI), dpi=DPI)
    axes = figure.add_subplot()
    axes.tick_params(labelsize=LETTERS)
    axes.grid(alpha=0.3)
    return figure, axes


def _pixels(figure: "Figure") -> np.ndarray:
    canvas = figure.canvas
    canvas.draw()
    canvas.draw()  # the first drawing sets limits that the layout of the second needs
    return np.asarray(canvas.buffer_rgba())[..., :3]


DRAWN = {"envs": envs, "tasks": tasks, "designs": designs, "controllers": controllers, "methods": methods}

if __name__ == "__main__":
    main()
