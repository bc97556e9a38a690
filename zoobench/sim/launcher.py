"""Launches of kernels: compiled for a scene's effects, with its constants, and counted."""

import importlib
import math
from collections import Counter

import numpy as np
import torch
from torch import Tensor

from zoobench.arrays import Array
from zoobench.errors import SceneError, UsageError
from zoobench.sim.kernels import half_step, serial, sleep_survey, survey
from zoobench.sim.kernels.boundary import NONE, PLANE, TERRAIN, WALL_NODES
from zoobench.sim.kernels.laws.law import Law
from zoobench.sim.kernels.layout import BEFORE, CONSTANTS, MOMENTUM, PUSH, RATIO, SURFACE, VELOCITY, Variant
from zoobench.sim.kernels.transfer import AFLIP, APIC, PIC
from zoobench.sim.kernels.water_grid import immersed, water_layout
from zoobench.sim.launch import Launch
from zoobench.sim.model.elastic_bodies import ElasticBody, within
from zoobench.sim.model.fidelity import Fidelity, Transfer
from zoobench.sim.model.grid_water import LEAST_CELLS, solver_modes
from zoobench.sim.model.ground_skin import GroundSkin
from zoobench.sim.model.launch_plan import LaunchPlan
from zoobench.sim.model.laws.elastic import lame_parameters
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.scene import Effect, Scene, check_grid, has_fbar, has_skin, medium_transfer
from zoobench.sim.model.state import Matter, Parameters
from zoobench.sim.model.tensors import LARGEST_ARRAY, lazy_zeros
from zoobench.sim.parallel_driver import ParallelDriver

_ROUNDING = 1e-3  # [cells] by which the node on the face of an anchor is in it

_TRANSFERS: dict[Transfer, int] = {"apic": APIC, "pic": PIC, "aflip": AFLIP}


class Launcher:
    """Owns the grid and launches the substep, its reverse, the survey and the search for matter that may sleep.

    Args:
        parallel: all worlds at once (CUDA), with atomic adds but for robots in their rest frame; else in turn on one
            thread.

    Attributes:
        shape: grid nodes in x, y, z.
        fields: number of fields of every node, see `layout`.
        constants: the kernels' scalars, see `layout.CONSTANTS`.
        variant: for which the kernels are compiled.
        terrain: `[nx, nz, 4]` height [cells] above the grid's first node and normal; empty for a plane.
        launches: counts of kernel launches by direction, of surveys, and of world-substeps by direction and effect,
            "decomposition" for a law that needs principal values far from rest; an effect that the scene does not call
            for has no entry.
    """

    def __init__(
        self, scene: Scene, fidelity: Fidelity, worlds: int, real: torch.dtype, device: str, parallel: bool
    ) -> None:
        self._scene, self._fidelity = scene, fidelity
        self._worlds, self._real, self._device = worlds, real, device
        self.shape = _grid_shape(scene, fidelity.grid_spacing)
        self.launches: Counter[str] = Counter()
        law = law_of(scene.medium.material) if scene.medium else None
        self.variant = Variant(
            muscle=Effect.MUSCLE in scene.effects,
            damping=Effect.DAMPING in scene.effects,
            law=law,
            ground=self._ground_kind(),
            skin=has_skin(scene),
            width=fidelity.spline.width,
            # a part that the grid does not resolve would feel no water
            transfer=APIC if scene.water else _TRANSFERS[fidelity.transfer],
            medium_transfer=_TRANSFERS[medium_transfer(scene, fidelity)],
            # not where all worlds are simulated at once: the particles awake are visited in an order
            sleep=fidelity.sleep > 0.0 and law is not None and not law.is_liquid and not parallel,
            two_fields=scene.medium is not None and scene.medium.friction is not None,
            fbar=has_fbar(scene, fidelity),
            objects=len(scene.field_objects),
            anchors=_anchors(scene),
            clamped=tuple(k for k, each in enumerate(scene.field_objects, 1) if _is_clamped(each.body)),
            driven=scene.robot.drive is not None,
            water=type(water) if (water := scene.water or scene.surface_water) else None,
        )
        work = [str(effect) for effect in sorted(scene.effects)] + ["decomposition"] * self.variant.decomposed
        self._work = {way: [f"{way} {each}" for each in work] for way in ("forward", "reverse")}
        self.constants = self._list_constants()
        if parallel and scene.water:
            raise UsageError("Water on a grid is simulated on one thread. Use the CPU, or water of particles.")
        self._layers = self.variant.layers
        self.terrain = self._sample_terrain()
        self.fields = 1 + max(self._fields())
        self._driver = (
            ParallelDriver(self.shape, self.fields, worlds, self.variant, self.constants) if parallel else None
        )
        self._grid = self._new_grid()
        self._grid_adjoint: Tensor | None = None
        self._kept = 0
        # Taichi's own optimisation gains a twentieth on a robot alone; with a medium it only triples compiling
        self._advance, self._reverse, self._survey = (
            Launch(kernel, optimised=law is None) for kernel in (serial.advance, serial.reverse, survey.survey)
        )
        self._find_sleepers = Launch(sleep_survey.find_sleepers)
        self._scatter_first = Launch(half_step.scatter_first)
        self._cells = lazy_zeros((2, math.prod(self.shape) * self.variant.sleep), torch.int32, device)
        self._asleep = torch.zeros((worlds, scene.particle_count), dtype=torch.int32, device=device)
        if scene.water:
            self._immerse()

    def _immerse(self) -> None:
        """Prepare for water on a grid, which has kernels of its own."""
        cells = self._scene.cells(self._fidelity.grid_spacing)
        if min(cells) < LEAST_CELLS:
            raise SceneError(
                f"The water has {cells} cells along x, y and z; at least {LEAST_CELLS} are needed each way. Use a "
                "larger arena or a finer fidelity."
            )
        self._modes = torch.tensor(solver_modes(cells), dtype=self._real, device=self._device)
        self._advance, self._reverse = (
            Launch(kernel) for kernel in (immersed.advance_immersed, immersed.reverse_immersed)
        )

    @property
    def _own_nodes(self) -> int:
        """Nodes of the grid without those that are kept: a slab of the arena for every world that is simulated at the
        same time, and one for matter asleep."""
        return self._driver.nodes if self._driver else (1 + self.variant.sleep) * self.nodes_of_a_world

    @property
    def nodes_of_a_world(self) -> int:
        """Nodes of the grid for one world, in two fields those of both."""
        return self._layers * math.prod(self.shape)

    def check_room(self, windows: Tensor) -> None:
        """Raise a `SceneError` if there is no room for a world's nodes in its window `[worlds, 8]`."""
        if self._driver:
            self._driver.check_room(windows)

    @property
    def robot_nodes(self) -> int:
        """Nodes that the robot carries with it; none where it moves through the grid."""
        return 0

    def place_nodes(self, matter: Matter, origin: Array) -> None:
        """Write the robot's nodes of the scene at time zero into a state, measured from `origin` [m]."""

    def add_deformation(self, adjoint: Matter, by_deformation: Tensor) -> None:
        """Add to the adjoint of the robot's deformation gradients `[worlds, robot, 3, 3]` at slot 0."""
        adjoint.F[0] += by_deformation

    def keep(self, nodes: int) -> None:
        """Have room for so many nodes of every world, whose momenta `advance` keeps for `reverse`; 0 for none."""
        room = (LARGEST_ARRAY // (4 * self.fields) - self._own_nodes) // self._worlds
        nodes = 0 if self._driver or self._scene.water else max(min(nodes, room), 0)
        if nodes != self._kept:
            self._kept = nodes
            self._grid.data = self._grid.new_empty(0)  # see `Tape.__del__`
            self._grid = self._new_grid(self._worlds * nodes)

    def first_kept(self) -> Tensor:
        """The first node that is kept of every world `[worlds]`, for the window of a tape's first slot."""
        return self.nodes_of_a_world + self._kept * torch.arange(self._worlds, dtype=torch.int32, device=self._device)

    def advance(self, matter: Matter, parameters: Parameters, plan: LaunchPlan, stride: int) -> None:
        """The planned substeps of every world, every result `stride` slots further (0: in place).

        Momenta are kept as far as there is room where every slot is (`stride` 1).
        """
        arrays = self._arrays(matter, parameters, plan)
        self._note("forward", plan)
        if self._scene.water:
            self._advance(*self._wet(matter, parameters, plan), stride, self.variant)
        elif self._driver:
            self._driver.advance(arrays, self._grid, plan, stride)
        else:
            self._advance(*arrays, self._grid, plan.order, stride, self._kept if stride else 0, self.variant)

    def reverse(
        self,
        matter: Matter,
        parameters: Parameters,
        plan: LaunchPlan,
        matter_adjoint: Matter,
        parameter_adjoint: Parameters,
    ) -> None:
        """The adjoint of the planned substeps, last to first; the adjoints are updated in place."""
        if self._grid_adjoint is None:
            others = (self._worlds - 1) * self.variant.sleep  # each has the slab of its own
            self._grid_adjoint = self._new_grid(others * self.nodes_of_a_world)
        arrays = self._arrays(matter, parameters, plan)
        adjoints = (self._grid_adjoint, matter_adjoint.state, parameter_adjoint.body)
        self._note("reverse", plan)
        if self._scene.water:
            self._reverse(
                *self._wet(matter, parameters, plan), self._grid_adjoint, matter_adjoint.state, matter_adjoint.flow,
                parameter_adjoint.body, self.variant,
            )  # fmt: skip
        elif self._driver:
            self._driver.reverse(arrays, self._grid, adjoints, plan)
        else:
            self._reverse(*arrays, self._grid, *adjoints, plan.order, self.variant)

    def _arrays(self, matter: Matter, parameters: Parameters, plan: LaunchPlan) -> tuple[Tensor, ...]:
        """The arrays that the kernels take before the grid."""
        return (*matter.particles, parameters.body, plan.slots, plan.dt, self.constants, self.terrain)

    def _wet(self, matter: Matter, parameters: Parameters, plan: LaunchPlan) -> tuple[Tensor, ...]:
        """The arrays that both kernels of water on a grid take first."""
        return (
            *matter.particles, matter.flow, parameters.body, plan.slots, plan.dt, self.constants, self._modes,
            self._grid,
        )  # fmt: skip

    def survey(
        self,
        matter: Matter,
        parameters: Parameters,
        alive: Tensor,
        report: Tensor,
        culprit: Tensor,
        count: int | None = None,
    ) -> None:
        """Report the condition of every world, by its first `count` particles, at slot 0 (see `survey.survey`)."""
        self.launches["survey"] += 1
        count = matter.state.shape[2] if count is None else count
        if self._driver:
            self._driver.survey(matter, parameters, alive, report, culprit, count)
        else:
            self._survey(
                matter.state, parameters.body, self.constants, alive, report, culprit, count, self.variant.surveyed
            )

    def find_sleepers(self, matter: Matter, parameters: Parameters, reach: int) -> Tensor:
        """Which particles may sleep from slot 0 on: 1 or 0 `[worlds, particles]`, until the next call."""
        self._find_sleepers(
            matter.state, parameters.body, self.constants, self._cells, self._asleep, self._fidelity.sleep, reach
        )
        return self._asleep

    def momenta(self, matter: Matter, parameters: Parameters, dt: float) -> Tensor:
        """Momentum [kg m/s] and mass [kg] of the first world's nodes after the internal forces of a substep of `dt` [s]
        from slot 0, before gravity and contact: `[layers, nx, ny, nz, 4]`, a copy of the window; the layers are one, or
        robot and medium."""
        self._scatter_first(*matter.particles, parameters.body, self.constants, self._grid, dt, self.variant)
        return self._field(MOMENTUM, matter.window[0, 0])

    def nodes(self, window: Tensor) -> Tensor:
        """Velocity [m/s] and mass [kg] of the nodes of the first world in a window `[8]`, after a substep."""
        return self._field(VELOCITY, window)

    def _field(self, field: int, window: Tensor) -> Tensor:
        x0, y0, z0, x1, y1, z1 = window[:6].tolist()
        shape = (self._layers, x1 - x0, y1 - y0, z1 - z0)
        return self._grid[field, : math.prod(shape)].reshape(*shape, 4).clone()

    def _note(self, direction: str, plan: LaunchPlan) -> None:
        self.launches[f"{direction} launches"] += 1
        for work in self._work[direction]:
            self.launches[work] += plan.world_substeps

    def _list_constants(self) -> Tensor:
        """The scalars that the kernels share, see `layout.CONSTANTS`."""
        scene = self._scene
        mu, lam = lame_parameters(scene.robot.material.youngs_modulus, scene.robot.material.poissons_ratio)
        bed = scene.water or scene.surface_water or (scene.medium.material if scene.medium else None)
        friction = scene.ground.friction if scene.ground else 0.0
        skin = scene.ground.skin if scene.ground else GroundSkin()
        full = self._fidelity.grid_spacing**3
        slip = (scene.medium.friction if scene.medium else None) or 0.0
        density = scene.medium.material.density if scene.medium else 0.0
        values = {
            "spacing": self._fidelity.grid_spacing, "mu": mu, "lam": lam, "eta": scene.robot.material.viscosity,
            **dict(zip(("g_x", "g_y", "g_z"), scene.gravity, strict=True)), "friction": friction,
            **dict(zip(("nodes_x", "nodes_y", "nodes_z"), self.shape, strict=True)),
            "robot": scene.elastic.particle_count, "skin_thickness": skin.thickness, "skin_rate": skin.rate,
            "edge": scene.robot_edge(self._fidelity), "interface_friction": slip,
            "robot_full": scene.robot.material.density * full, "medium_full": density * full,
        }  # fmt: skip
        listed = [values[name] for name in CONSTANTS] + ([getattr(bed, name) for name in bed.constants] if bed else [])
        listed += self._list_object_constants(full) + self._list_anchors()
        return torch.tensor(listed, dtype=self._real, device=self._device)

    def _list_object_constants(self, full: float) -> list[float]:
        """Those of the fields of objects, see `layout.object_constants`; `full` is the volume of a node in the midst of
        matter."""
        scene, listed = self._scene, list[float]()
        for each in scene.field_objects:
            material = each.body.material
            listed += [scene.slice_of(each.name).start, *material.lame, material.viscosity]
            listed += [material.density * full, each.ground_friction, each.body.edge or self._fidelity.particle_edge]
        # the robot takes that of whom it meets
        frictions = [math.inf, *(each.friction for each in scene.field_objects)]
        if scene.medium is not None and scene.objects:
            frictions.append(math.inf)
        for a, b in self.variant.pairs if scene.objects else ():
            found = min(frictions[a], frictions[b])
            own = scene.medium.friction if scene.medium else None
            listed.append(float(own or 0.0) if found == math.inf else found)
        return listed

    def _list_anchors(self) -> list[float]:
        """First and last node along x, y and z that each anchor holds, see `layout.object_constants`."""
        corners = [box for body in self._scene.elastic_bodies for box in body.anchor]
        h = self._fidelity.grid_spacing
        nodes = (np.array(corners).reshape(-1, 2, 3) - self._scene.lower) / h + WALL_NODES
        nodes[:, 0] -= _ROUNDING
        nodes[:, 1] += _ROUNDING
        listed: list[float] = nodes.ravel().tolist()
        return listed

    def _fields(self) -> set[int]:
        """The fields of the grid that the kernels use, see `layout`."""
        if self._scene.water:
            return set(range(water_layout.FIELDS))
        found = {MOMENTUM, VELOCITY}
        if self.variant.uses(AFLIP):
            found.add(BEFORE)
        if self.variant.skin:
            found.add(PUSH)
        if self.variant.rolling_aslant:
            found.add(SURFACE)
        if self.variant.ratio:
            found.add(RATIO)
        return found

    def _ground_kind(self) -> int:
        """The kernels' ground; a plane without friction and skin is one of the arena's walls."""
        if self._scene.ground is not None and self._scene.ground.terrain is not None:
            return TERRAIN
        return PLANE if Effect.FRICTION in self._scene.effects or has_skin(self._scene) else NONE

    def _sample_terrain(self) -> Tensor:
        """Height [cells] above the grid's first node and normal of the ground in every node column; empty without."""
        ground, h = self._scene.ground, self._fidelity.grid_spacing
        if ground is None or ground.terrain is None:
            return torch.zeros((0, 0, 4), dtype=self._real, device=self._device)
        # the wall planes, and with them the arena's lower corner, run through node WALL_NODES
        x, z = (np.arange(self.shape[d], dtype=np.float64) * h - WALL_NODES * h for d in (0, 2))
        height = ground.terrain.heights_at(x, z) / h + WALL_NODES
        columns = np.concatenate([height[..., None], ground.terrain.normals_at(x, z)], axis=-1)
        # a copy, since kernels load whole rows, for which NumPy's memory is not aligned
        return torch.tensor(columns, dtype=self._real, device=self._device)

    def _new_grid(self, kept: int = 0) -> Tensor:
        """A zeroed grid `[fields, nodes, 4]` with `kept` more nodes; a wide arena takes memory only where the robot has
        been."""
        return lazy_zeros((self.fields, self._own_nodes + kept, 4), self._real, self._device)


def _anchors(scene: Scene) -> tuple[int, ...]:
    """In how many boxes the robot, and each field of objects, is held; empty where none is."""
    anchors = tuple(len(body.anchor) for body in (scene.robot, *(each.body for each in scene.field_objects)))
    return anchors if any(anchors) else ()


def _is_clamped(body: ElasticBody) -> bool:
    """Whether a body is held in part."""
    return bool(body.anchor) and not within(body.anchor, body.positions).all()


def law_of(material: Medium) -> Law:
    """The law of a medium for kernels."""
    found = importlib.import_module(material.kernels).LAW
    assert isinstance(found, Law)
    return found


def kept_fields(scene: Scene, fidelity: Fidelity) -> int:
    """Fields of the grid that are kept for the reverse; none of water on a grid, which computes them again."""
    if scene.water:
        return 0
    ratio = (scene.medium is not None and scene.medium.material.is_liquid) or has_fbar(scene, fidelity)
    before = fidelity.transfer == "aflip" or (scene.medium is not None and medium_transfer(scene, fidelity) == "aflip")
    layers = 1 + len(scene.field_objects) + (scene.medium is not None and scene.medium.friction is not None)
    aslant = scene.ground is not None and scene.ground.terrain is not None
    surface = has_skin(scene) and aslant and bool(scene.objects)
    return layers * (1 + before + has_skin(scene) + surface + ratio)


def _grid_shape(scene: Scene, grid_spacing: float) -> tuple[int, int, int]:
    x, y, z = (count + 2 * WALL_NODES + 1 for count in scene.cells(grid_spacing))
    check_grid((x, y, z), "nodes")
    return x, y, z
