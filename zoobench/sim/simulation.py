"""The state of one scene in a number of worlds, and the primitive operations on it that need no choice."""

import math
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from zoobench.arrays import Array
from zoobench.errors import UsageError
from zoobench.sim import runtime
from zoobench.sim.kernels.anchors import HEAVINESS
from zoobench.sim.kernels.boundary import WALL_NODES
from zoobench.sim.launcher import Launcher
from zoobench.sim.model.diagnostics import Neighbours
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.grid_water import cover
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.rollout import FloatArray, Rollout, SubstepMeter
from zoobench.sim.model.scene import Effect, Scene
from zoobench.sim.model.state import BodyState, IntArray, Matter, Parameters, initial_matter, medium_share, with_objects
from zoobench.sim.model.step_limits import StepLimit
from zoobench.sim.model.tensors import fetch, memory
from zoobench.sim.muscle_energy import MuscleEnergy
from zoobench.sim.rest_frame_launcher import RestFrameLauncher

LARGEST_PLACE = 2.0**30
"""Distance from the grid's first node [cells] up to which it is a whole number to the kernels."""


class Simulation:
    """Tensors and launcher of one scene, shared by the solver, its step control and its adjoint.

    Args:
        limit: the declared step.
        start: the state of one world at time zero; the scene's own if None.
        parallel: all worlds at once, with atomic adds but for robots in their rest frame; the default on CUDA only.

    Attributes:
        origin: the grid's first node at time zero [m]; the positions of `matter` are measured from `origins`.
        matter: the present state, one slot.
        parameters: mass, volume, stiffness, fibres and the tension of the present control frame.
        alive: `[worlds]` 0 for a world that has diverged.
        start: the state of all worlds at time zero, one slot.
        offsets: `[worlds, 3]` how far the arena has moved after the robot [m].
        driven: the particles of a base that moves.

    Raises:
        SceneError: the arena has more grid nodes than can be held, or on a GPU matter fills more.
        UsageError: water by forces on the surface asks for a robot in its rest frame; or as of `RestFrameLauncher`.
    """

    def __init__(
        self,
        scene: Scene,
        fidelity: Fidelity,
        worlds: int,
        limit: StepLimit,
        *,
        frame_seconds: float,
        start: Matter | None,
        parallel: bool | None,
    ) -> None:
        self._device = device = fidelity.device
        runtime.start(fidelity.precision, device)
        self._real = runtime.real(fidelity.precision)
        self.scene, self.fidelity, self.worlds = scene, fidelity, worlds
        self.limit, self.frame_seconds = limit, frame_seconds
        self.robot_count, self.particle_count = scene.robot.particle_count, scene.particle_count
        self.elastic_count = scene.elastic.particle_count
        self.muscle_count = scene.robot.muscle_count if Effect.MUSCLE in scene.effects else 0
        self.meter = SubstepMeter()
        if scene.surface_water is not None and fidelity.robot != "lagrangian":
            raise UsageError(
                "Water by forces on the surface has its robot in its rest frame. Give robot=lagrangian with the "
                "fidelity."
            )
        kind = Launcher if fidelity.robot == "mpm" else RestFrameLauncher
        self.launcher = kind(
            scene, fidelity, worlds, self._real, device, device == "cuda" if parallel is None else parallel
        )
        self.origin = np.array(scene.lower) - WALL_NODES * fidelity.grid_spacing
        cells = scene.water_cells(fidelity.grid_spacing)
        self.offsets = np.zeros((worlds, 3))
        self.matter = initial_matter(scene, worlds, self.origin, self._real, device, cells, self.launcher.robot_nodes)
        self.launcher.place_nodes(self.matter, self.origin)
        self.refresh_window()
        self.launcher.check_room(self.matter.window[0])
        self.start = self.matter.copy_slot(0)
        if start is not None:
            self.start_at(start)
        self.parameters = Parameters.zeros(worlds, self.elastic_count, self.particle_count, self._real, device)
        self.alive = torch.ones(worlds, dtype=torch.int32, device=device)
        self._alive = memory(self.alive)
        order = self.particle_count if self.launcher.variant.sleep else 0
        self._plan = LaunchPlan.none(worlds, self._real, device, order)
        if scene.water:
            # of all particles, absent ones too: it must not change with the variables that a design optimises
            # each body by itself: what is near it when it begins makes no part of it thicker
            covered = [cover(body.positions, body.volumes, fidelity.grid_spacing) for body in scene.elastic_bodies]
            self.parameters.cover[:] = self.tensor(np.concatenate(covered))
        drive = scene.robot.drive
        self.driven: IntArray = np.flatnonzero(drive.particles) if drive is not None else np.zeros(0, np.int64)
        self._muscle_energy = MuscleEnergy(scene.robot.material.muscle_strength)
        self._membership: tuple[Array, Tensor] | None = None  # of a body, and the same on the device
        self.set_body(with_objects(BodyState().filled(scene, worlds), scene))

    @property
    def origins(self) -> Array:
        """The origin of the positions of `matter` in every world `[worlds, 3]` [m]: the grid's first node,
        where its arena is now; of a robot that carries its own, that of time zero."""
        return self.origin + self.offsets * (self.fidelity.robot == "mpm")

    @cached_property
    def neighbours(self) -> dict[str, Neighbours]:
        """Neighbours of the particles of the robot and of every object, absent ones too."""
        edge = self.fidelity.particle_edge
        return {name: Neighbours(body.positions, body.edge or edge) for name, body in self.scene.bodies.items()}

    def is_alive(self) -> IntArray:
        """`[worlds]` 0 for a world that has diverged, on the host."""
        return self._alive if isinstance(self._alive, np.ndarray) else self._alive.cpu().numpy()

    def tensor(self, value: FloatArray) -> Tensor:
        """An array in the simulation's precision on its device."""
        return torch.as_tensor(np.ascontiguousarray(value), dtype=self._real, device=self._device)

    def start_at(self, state: Matter) -> None:
        """Take a state of one world for the initial state of all."""
        self.matter.load_slot(0, state.on(self._device))
        self.offsets[:] = 0.0
        self.start = self.matter.copy_slot(0)

    def rewind(self) -> None:
        """Put all worlds back to the initial state, alive and with all muscles at rest."""
        self.matter.load_slot(0, self.start)
        self.offsets[:] = 0.0
        self.alive.fill_(1)
        self.parameters.tension.zero_()

    def restart(self, world: int) -> None:
        """Put one world back to the initial state, alive; the others are unchanged."""
        self.matter.copy_world(world, self.start)
        self.offsets[world] = 0.0
        self.alive[world] = 1

    def plan(
        self,
        first: IntArray,
        counts: IntArray,
        whole: IntArray | None = None,
        *,
        begins: bool | NDArray[np.bool_] = True,
    ) -> LaunchPlan:
        """The launch of `counts` substeps from the slots `first` on, of `whole` in the frame (all if None).

        `begins` says where it is the first of the frame.
        """
        self._plan.set(first, counts, self.frame_seconds / np.maximum(counts if whole is None else whole, 1), begins)
        return self._plan

    @property
    def sleepers(self) -> int:
        """Number of the medium's particles if they may sleep, else 0."""
        return self.particle_count - self.elastic_count if self.launcher.variant.sleep else 0

    def put_to_sleep(self, asleep: NDArray[np.bool_]) -> None:
        """Have some of the medium's particles `[worlds, sleepers]` sleep in the launches to come."""
        if self.sleepers:
            self._plan.put_to_sleep(asleep)

    def advance(
        self, matter: Matter, first: IntArray, counts: IntArray, stride: int, whole: IntArray | None = None
    ) -> None:
        """The substeps of `plan`, to `stride` slots further."""
        self.launcher.advance(matter, self.parameters, self.plan(first, counts, whole), stride)

    def substeps(self, count: int, dt: float) -> None:
        """Move `matter` on in place by `count` steps of `dt` [s] in every world, all of it awake."""
        self.put_to_sleep(np.zeros((self.worlds, self.sleepers), np.bool_))
        self._plan.set(np.zeros(self.worlds, np.int64), np.full(self.worlds, count), np.full(self.worlds, dt))
        self.launcher.advance(self.matter, self.parameters, self._plan, 0)

    def refresh_window(self, matter: Matter | None = None, slot: int = 0, world: int | slice = slice(None)) -> None:
        """Find the grid nodes that the particles of a state touch, by default the present one, after their positions
        were set from outside."""
        matter = matter or self.matter
        width, nodes = self.fidelity.spline.width, torch.tensor(self.launcher.shape, device=self._device)
        # the first node of each particle's stencil, as `splines.first_node` has it
        base = torch.floor(matter.x[slot, world] / self.fidelity.grid_spacing - (0.5 * width - 1.0))
        # a node more on every side: the kernels may round the quotient otherwise; and from end to end where a place is
        # no number, or too large a one, of which processors make different integers
        wild = ~(base.abs() < LARGEST_PLACE)
        first, last = torch.where(wild, 0.0, base - 1), torch.where(wild, math.inf, base + 1)
        end = nodes - width
        matter.window[slot, world, ..., :3] = first.clamp(min=0.0).minimum(end).amin(-2).int()
        matter.window[slot, world, ..., 3:6] = last.clamp(min=0.0).minimum(end).amax(-2).int() + width

    def set_body(self, arrays: dict[str, Array]) -> None:
        """Give the particles mass, volume, stiffness and fibres from a design's complete arrays."""
        robot, medium, count = self.scene.elastic, self.scene.medium, self.elastic_count
        # occupancy scales mass and volume together: an absent particle has neither inertia nor stress
        volume = arrays["occupancy"] * robot.volumes
        mass = volume * arrays["density_ratio"] * robot.material.density
        self.parameters.volume[:, :count] = self.tensor(volume)
        self.parameters.mass[:, :count] = self.tensor(mass)
        self.parameters.stiffness[:] = self.tensor(arrays["stiffness"])
        self.parameters.fibre[:] = self.tensor(arrays["fibres"])
        if self.driven.size:
            self.parameters.mass[:, self.driven] *= HEAVINESS
            self.parameters.stiffness[:, self.driven] = 0.0
            self.parameters.fibre[:, self.driven] = 0.0  # at rest
        self._muscle_energy.set_body(self.parameters)
        self._membership = None
        if medium is not None:
            room = medium.volumes * medium_share(medium, arrays["occupancy"])
            self.parameters.volume[:, count:] = self.tensor(room)
            self.parameters.mass[:, count:] = self.tensor(room * medium.material.density)

    def set_tension(self, rollout: Rollout, frame: int) -> None:
        """Apply a control frame's actuation: the active stress of every robot particle, which is noted."""
        if not self.muscle_count:
            return
        self._move_base(rollout.actuation[frame])
        strength, actuation = self.scene.robot.material.muscle_strength, rollout.actuation[frame]
        if self._device == "cpu":
            rollout.tension[frame] = strength * np.einsum("wpk,wk->wp", rollout.body["muscle_membership"], actuation)
            self.parameters.set_tension(rollout.tension[frame])
        else:
            there = torch.as_tensor(actuation, device=self._device)
            tension = strength * torch.einsum("wpk,wk->wp", self._on_device(rollout), there)
            fetch(rollout.tension[frame], tension)
            self.parameters.tension[...] = tension

    def _move_base(self, actuation: Array) -> None:
        """Give a robot's driven particles the velocity that the actuation of a frame `[worlds, muscles]` asks for."""
        if (drive := self.scene.robot.drive) is not None:
            velocity = self.tensor(drive.speed * actuation[:, -3:])
            self.parameters.fibre[:, self.driven] = velocity[:, None]

    def repeat_tension(self, rollout: Rollout, frame: int) -> None:
        """Apply a control frame's actuation once more, by the active stress that was noted."""
        self.parameters.set_tension(rollout.tension[frame])
        self._move_base(rollout.actuation[frame])

    def by_actuation(self, rollout: Rollout, adjoint: Parameters) -> Array:
        """Derivative of a loss by the actuation of a frame `[worlds, muscles]`, from that by its tension and by the
        velocity of the driven particles, which is in the place of their fibres."""
        strength = self.scene.robot.material.muscle_strength
        by_activity = strength * adjoint.tension.double()
        if self._device == "cpu":
            membership = rollout.body["muscle_membership"]
            found = np.asarray(np.einsum("wpk,wp->wk", membership, by_activity.numpy()))
        else:
            found = torch.einsum("wpk,wp->wk", self._on_device(rollout), by_activity).cpu().numpy()
        if (drive := self.scene.robot.drive) is not None:
            found[:, -3:] += drive.speed * adjoint.fibre[:, self.driven].double().sum(1).cpu().numpy()
        return found

    def _on_device(self, rollout: Rollout) -> Tensor:
        """The muscle membership of a rollout's robots, which stays on the device until they are others."""
        given = rollout.body["muscle_membership"]
        if self._membership is None or self._membership[0] is not given:
            self._membership = given, torch.as_tensor(given, device=self._device)
        return self._membership[1]

    def record(self, rollout: Rollout, frame: int, *, goes_on: bool = False) -> None:
        """Write the robot's present state into the rollout as that at the beginning of a frame.

        If more is to be recorded, the muscles' energy may be missing until the last record or `finish_records`.
        """
        self.record_motion(rollout, frame)
        if self.muscle_count and self._device == "cpu":
            self._muscle_energy.note(rollout, frame, self.matter)
        elif self.muscle_count:
            potential = self._muscle_energy.potential(self._on_device(rollout), self.matter.F[0])
            rollout.muscle_potential[frame] = potential
        if not goes_on:
            self.finish_records()

    def record_motion(self, rollout: Rollout, frame: int) -> None:
        """Write only places and velocities."""
        places, velocities = rollout.positions[frame], rollout.velocities[frame]
        origin = self.origins[:, None]
        if self._device == "cpu":
            rows = self.matter.robot_rows(0, 2)
            places[...], velocities[...] = rows[:, :, 0, :3] + origin, rows[:, :, 1, :3]
        else:
            there = torch.as_tensor(origin, device=self._device)
            fetch(places, self.matter.x[0, :, : self.elastic_count] + there)
            fetch(velocities, self.matter.v[0, :, : self.elastic_count])
        if self.scene.follows and self.fidelity.robot != "mpm":
            # no grid has to go with it, but the scenery drawn around the robot does, by whole cells
            h, moved = (
                self.fidelity.grid_spacing,
                places[:, : self.robot_count].mean(1) - self.scene.robot.positions.mean(0),
            )
            self.offsets[:, ::2] = h * np.round(moved[:, ::2] / h)
        rollout.offsets[frame] = self.offsets

    def finish_records(self) -> None:
        """Complete the rollout that was recorded last."""
        self._muscle_energy.finish()
