"""`zoobench picture`: what each environment looks like, with a robot in it."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import random_actuation
from zoobench.errors import DivergenceError, UsageError
from zoobench.registry import Kind
from zoobench.spec import FRAME_SECONDS, Ref

if TYPE_CHECKING:
    from zoobench.controllers.base import Controller
    from zoobench.designs.base import Body
    from zoobench.envs.base import Environment
    from zoobench.sim.model.scene import Scene
    from zoobench.sim.solver import Solver


SHEET = "environments.png"
"""Name of the contact sheet."""


@dataclass(frozen=True)
class Snapshot:
    """A world at one moment.

    Attributes:
        env, fidelity: what was simulated.
        seconds: since the episode began [s].
        scene: its matter and ground; the positions in it are those at time zero.
        robot: `[robot_count, 3]` where the robot's particles are [m].
        medium: `[medium_count, 3]` where the medium's are [m]; none on bare ground.
        particle_edge: edge of the cube that a particle stands for [m].
        membership: `[robot_count, muscle_count]` share of each muscle [-].
        muscles: their names.
    """

    env: str
    fidelity: str
    seconds: float
    scene: "Scene"
    robot: Array
    medium: Array
    particle_edge: float
    membership: Array
    muscles: tuple[str, ...]


def snapshots(
    envs: Sequence[Ref],
    *,
    design: Ref = Ref("caterpillar"),  # noqa: B008  (frozen)
    controller: Ref = Ref("sine-basis"),  # noqa: B008
    fidelity: Ref = Ref("draft"),  # noqa: B008
    frames: int = 0,
    seed: int = 0,
) -> Iterator[Snapshot]:
    """Every environment equilibrated, and after `frames` control frames of the controller with random parameters.

    Raises:
        UnknownNameError, UsageError: a name or a number that cannot be used.
        DivergenceError: the episode blew up.
    """
    from zoobench.sim.equilibrium import equilibrated
    from zoobench.sim.solver import Solver

    if frames < 0:
        raise UsageError(f"An episode of {frames} frames cannot be drawn. Give 0 or more.")
    grid = registry.create(Kind.FIDELITY, fidelity)
    body: Body = registry.create(Kind.DESIGN, design).body(grid)
    driver: Controller = registry.create(Kind.CONTROLLER, controller)
    for name in envs:
        env: Environment = registry.create(Kind.ENV, name)
        scene = env.scene(body, grid)
        solver = Solver(scene, grid, start=equilibrated(scene, grid, env.equilibration_frames))
        if frames:
            _move(solver, driver, frames, seed)
        place = solver.matter.x[0, 0].double().cpu().numpy() + solver.origin
        yield Snapshot(
            env=_label(name),
            fidelity=_label(fidelity),
            seconds=frames * FRAME_SECONDS,
            scene=scene,
            robot=place[: solver.robot_count],
            medium=place[solver.robot_count :],
            particle_edge=grid.particle_edge,
            membership=body.muscle_membership,
            muscles=body.muscles,
        )


def pictures(shots: Sequence[Snapshot], folder: Path) -> Iterator[Path]:
    """Draw each snapshot into a PNG of its own and, of several, a contact sheet; the files as they are written.

    Raises:
        UsageError: the folder cannot be written, or matplotlib is not installed.
    """
    from zoobench.render.drawing import draw_one, draw_sheet

    try:
        folder.mkdir(parents=True, exist_ok=True)
        for shot in shots:
            path = folder / f"{re.sub(r'[^a-z0-9.]+', '-', shot.env).strip('-')}.png"
            draw_one(shot, path)
            yield path
        if len(shots) > 1:
            draw_sheet(shots, folder / SHEET)
            yield folder / SHEET
    except OSError as error:
        raise UsageError(f"No picture can be written to {str(folder)!r}: {error}. Give another --out.") from error


def _label(ref: Ref) -> str:
    """Name and parameters, as they are written on the command line."""
    values = ",".join(f"{key}={value}" for key, value in ref.params)
    return f"{ref.name}[{values}]" if values else ref.name


def _move(solver: "Solver", controller: "Controller", frames: int, seed: int) -> None:
    """One episode from the equilibrated state; the solver's matter is at its end afterwards."""
    rollout = solver.run(random_actuation(controller, solver.muscle_count, frames, 1, seed))
    if rollout.divergences:
        raise DivergenceError(rollout.divergences[0])
