"""Positions of a world at some moments: the data of pictures and films."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import random_actuation
from zoobench.cell.firm_muscles import firm_body
from zoobench.cell.muscle_places import placed_on
from zoobench.designs.base import Body
from zoobench.designs.feasibility import SOLID
from zoobench.envs.base import Environment
from zoobench.errors import DivergenceError, UsageError
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.state import medium_share
from zoobench.sim.solver import Solver
from zoobench.spec import FRAME_SECONDS, Ref
from zoobench.tasks.base import Task

Positions = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A world at some moments.

    Attributes:
        scene: its matter and ground; the positions in it are those before it came to rest.
        body: the robot at rest in its own frame, as it was simulated.
        particle_edge: edge of the cube that a particle stands for [m].
        times: `[moments]` since the episode began [s].
        robot: `[moments, robot_count, 3]` positions of the robot's particles [m].
        objects: the same of every object by name.
        medium: `[moments, medium_count, 3]` positions of the medium's particles [m], without those whose place the
            robot takes; none on bare ground and in water on a grid.
        centre: `[n, 3]` the robot's centre of mass, from the first moment on [m].
        target: `[n, 3]` position of the target [m]; None if there is none that moves.
        vorticity: of water on a grid `[moments, nx + 1, nz + 1]` [1/s], see `vorticity`; None without it.
        offsets: `[moments, 3]` how far the arena had moved after the robot [m]; None if it stayed where it was.
    """

    scene: Scene
    body: Body
    particle_edge: float
    times: Array
    robot: Positions
    medium: Positions
    centre: Array
    target: Array | None = None
    vorticity: Array | None = None
    offsets: Array | None = None
    objects: Mapping[str, Positions] = field(default_factory=dict)

    @property
    def corners(self) -> tuple[Array, Array]:
        """Corners of the box around the arena at all moments `[3]` [m]."""
        offsets = np.zeros((1, 3)) if self.offsets is None else self.offsets
        return self.scene.lower + offsets.min(axis=0), self.scene.upper + offsets.max(axis=0)

    @property
    def solid(self) -> NDArray[np.bool_]:
        """Whether a robot particle exists `[robot_count]`; the others are empty space of a design."""
        return self.body.occupancy > SOLID


@dataclass(frozen=True, kw_only=True)
class Snapshot(Recording):
    """A world at one moment.

    Attributes:
        env, fidelity: names and parameters.
    """

    env: str
    fidelity: str


@dataclass(frozen=True)
class BodyPlaces:
    """Positions of all particles `[moments, particle_count, 3]` [m] by the bodies that they belong to; views."""

    robot: Positions
    objects: dict[str, Positions]
    medium: Positions

    @classmethod
    def of(cls, scene: Scene, places: Positions) -> "BodyPlaces":
        """Those of a scene: its robot's first, then its objects' and its medium's."""
        objects = {each.name: places[:, scene.slice_of(each.name)] for each in scene.objects}
        return cls(places[:, scene.slice_of("robot")], objects, places[:, scene.elastic.particle_count :])


def medium_exists(scene: Scene, occupancy: Array) -> NDArray[np.bool_]:
    """Whether a medium particle has most of its place `[medium_count]`: the robot may have it, or a part of it."""
    if scene.medium is None:
        return np.zeros(0, bool)
    volumes = scene.medium.volumes
    found: NDArray[np.bool_] = medium_share(scene.medium, occupancy[None])[0] * volumes > 0.5 * volumes.max()
    return found


def vorticity(flow: Array, spacing: float) -> Array:
    """About the vertical, du/dz - dw/dx `[nx + 1, nz + 1]` [1/s]: at the vertical edges of the cells at half height.

    It is zero on the walls, along which water slips.

    Args:
        flow: velocities (u, v, w) on the lower faces of the cells `[nx, ny, nz, 3]` [m/s].
        spacing: edge of a cell [m].
    """
    u, _, w = np.moveaxis(flow[:, flow.shape[1] // 2], -1, 0)
    found = np.zeros((u.shape[0] + 1, u.shape[1] + 1))
    found[1:-1, 1:-1] = (np.diff(u, axis=1)[1:] - np.diff(w, axis=0)[:, 1:]) / spacing
    return found


def target_path(task: Task, start: Array, frames: int) -> Array | None:
    """Where the target is after every control frame `[frames + 1, 3]` [m]; None if there is none that moves.

    The tasks of a mixture share one path.

    Args:
        start: the robot's centre of mass at the start `[3]` [m].
    """
    # a task of a plug-in may lack new parts of the protocol
    route = next(iter(getattr(task, "routes", ())), None)
    clock = np.arange(frames + 1, dtype=np.float64) * FRAME_SECONDS
    return None if route is None else start + route.positions(clock)


def snapshots(
    envs: Sequence[Ref],
    *,
    design: Ref = Ref("caterpillar"),  # noqa: B008  (frozen)
    controller: Ref = Ref("sine-basis"),  # noqa: B008
    fidelity: Ref = Ref("draft"),  # noqa: B008
    frames: int = 0,
    seed: int = 0,
) -> Iterator[Snapshot]:
    """Every environment after equilibration and `frames` control frames of the controller with random parameters.

    Raises:
        UnknownNameError, UsageError: a name or a number that cannot be used.
        DivergenceError: the episode diverged.
    """
    if frames < 0:
        raise UsageError(f"An episode of {frames} frames cannot be drawn. Give 0 or more.")
    for name in envs:
        env: Environment = registry.create(Kind.ENV, name)
        grid = env.simulated(registry.create(Kind.FIDELITY, fidelity))
        body: Body = firm_body(registry.create(Kind.DESIGN, design).body(grid), env.robot)
        driver = placed_on(body, registry.create(Kind.CONTROLLER, controller))
        scene = env.scene(body, grid)
        solver = Solver(scene, grid, start=equilibrated(scene, grid, env.equilibration_frames))
        if frames:
            rollout = solver.run(random_actuation(driver, solver.muscle_count, frames, 1, seed))
            if rollout.divergences:
                raise DivergenceError(rollout.divergences[0])
        flow, places = solver.flow(0), BodyPlaces.of(scene, solver.positions(0)[None].astype(np.float32))
        yield Snapshot(
            env=str(replace(name, version=0)),
            fidelity=str(replace(fidelity, version=0)),
            scene=scene,
            body=body,
            particle_edge=grid.particle_edge,
            times=np.array([frames * FRAME_SECONDS]),
            robot=places.robot,
            objects=places.objects,
            medium=places.medium[:, medium_exists(scene, body.occupancy)],
            centre=np.average(places.robot.astype(float), axis=1, weights=body.masses(1.0)),
            vorticity=None if flow is None else vorticity(flow, grid.grid_spacing)[None],
            offsets=solver.simulation.offsets[:1].copy(),
        )
