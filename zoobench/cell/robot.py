"""The robot as a function of a parameter vector: muscle activity and, in a design space, the body."""

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array, Mask
from zoobench.cell.firm_muscles import firm_body, firm_form
from zoobench.cell.muscle_places import placed_on
from zoobench.cell.observation import Layout, layout_of, seen_by
from zoobench.controllers.base import Controller, OpenLoop
from zoobench.controllers.stored_gait import Gait
from zoobench.designs.base import Body, Design, check_ends
from zoobench.designs.feasibility import Feasibility
from zoobench.designs.run_fidelity import fidelity_of_run
from zoobench.designs.solid import body_for, buildable, solid_body, subset
from zoobench.designs.space import DesignSpace, Form, SiteSpace
from zoobench.envs.base import Environment
from zoobench.errors import SceneError, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.spec import Ref, RunSpec
from zoobench.tasks.base import Metric
from zoobench.tasks.products import symmetric_eigen

if TYPE_CHECKING:
    from torch import Tensor


_DRAWS = 20
"""Most bodies that are drawn from a prior until one can be built."""


@dataclass(frozen=True)
class Built:
    """One robot for the simulator, connected to its parameters by autograd.

    Attributes:
        row: the parameters `[1, parameter_count]`, the leaf of the gradient.
        activity: `[frames, 1, muscle_count]`; zero in a closed loop, where it follows from the motion.
        body: at rest.
        matter: of a relaxed body, its arrays by the simulator's names; empty for a body as it is.
        metrics: of a body from a design space; empty for a fixed body.
    """

    row: "Tensor"
    activity: "Tensor"
    body: Body
    matter: "dict[str, Tensor]"
    metrics: dict[str, Metric]

    def gradient(self, adjoints: dict[str, Array]) -> Array:
        """The gradient `[parameter_count]` from adjoints of the activity and of the body's arrays, by their names.

        Adjoints that are zero may be left out.
        """
        import torch

        outputs = {"activity": self.activity[:, 0], **{name: value[0] for name, value in self.matter.items()}}
        graded = {name: value for name, value in outputs.items() if name in adjoints and value.requires_grad}
        if not graded:
            return np.zeros(self.row.shape[1])
        weighted = [(value * torch.as_tensor(adjoints[name])).sum() for name, value in graded.items()]
        # Of scalars, as torch loads its symbolic algebra to compare shapes of outputs and weights, half a second.
        # Solid and relaxed body share the graph of the activity, so it is retained.
        (gradient,) = torch.autograd.grad(weighted, self.row, retain_graph=True)
        return gradient[0].numpy()


@dataclass(frozen=True)
class Draft:
    """The robot of a parameter vector before it is built: solid to be scored, relaxed for gradients.

    Attributes:
        row, activity: as of `Built`.
        workspace: of a design space, or the fixed body.
        form, feasibility: in the workspace; None for a fixed body.
        least_occupancy: relaxed matter of less is left out.
    """

    row: "Tensor"
    activity: "Tensor"
    workspace: Body
    form: Form | None
    feasibility: Feasibility | None
    least_occupancy: float

    @property
    def fault(self) -> str:
        """The reason why it cannot be built; empty if it can."""
        return "" if self.feasibility is None else self.feasibility.fault

    def solid(self) -> Built:
        """The robot as it is scored: whole particles where the form is solid, and nothing else."""
        if self.form is None:
            return Built(self.row, self.activity, self.workspace, {}, {})
        body = solid_body(self.form, self.workspace)
        return Built(self.row, self.activity, body, {}, self._metrics(body))

    @property
    def existing(self) -> Mask:
        """The particles of the workspace that a relaxed body has `[particle_count]`."""
        if self.form is None:
            return np.ones(self.workspace.particle_count, bool)
        return np.asarray(self.form.occupancy[0].detach().numpy() > self.least_occupancy)

    def relaxed(self, kept: Mask | None = None) -> Built:
        """The robot with the form's own occupancy, by which its motion is differentiable.

        Args:
            kept: `[particle_count]` particles of the workspace to build it of; by default `existing`.
        """
        import torch

        if self.form is None:
            return self.solid()
        matter = self.form.matter(self.workspace)
        arrays = {name: value[0].detach().numpy() for name, value in matter.items()}
        kept = self.existing if kept is None else kept
        body = subset(self.workspace, arrays, kept)
        parts = {name: value[:, torch.as_tensor(kept)] for name, value in matter.items()}
        return Built(self.row, self.activity, body, parts, self._metrics(body))

    def _metrics(self, body: Body) -> dict[str, Metric]:
        """Metrics of the body.

        * `body_volume`, `elongation`: of all of its matter.
        * `components`: connected pieces of solid matter, before all but the largest are removed.
        * `mass_kept`: the largest piece's share of their mass.
        """
        assert self.feasibility is not None
        volumes = body.occupancy * body.volumes
        return {
            "body_volume": Metric(float(volumes.sum()), "m^3"),
            "elongation": Metric(elongation(body.positions, volumes), "1"),
            "components": Metric(float(self.feasibility.components), "1"),
            "mass_kept": Metric(self.feasibility.mass_kept, "1"),
        }


@dataclass(frozen=True)
class Robot:
    """A controller and a body with one parameter vector: the controller's part, then the design space's.

    Attributes:
        controller: drives the muscles.
        body: at rest; of a design space, the workspace.
        space: the design space, or None for a fixed body.
        least_occupancy: of the matter of relaxed bodies, see `Fidelity`.
        layout: of a closed loop's observations; empty in an open loop.
        onset: see `Environment` [s].
        material: that of stiffness 1; None for a robot that is not to be simulated.
    """

    controller: Controller
    body: Body
    space: DesignSpace | None
    least_occupancy: float
    layout: Layout = ()
    onset: float = 0.0
    material: ElasticMaterial | None = None

    @classmethod
    def of(
        cls, design: Ref, controller: Ref, fidelity: Fidelity, task: Ref, environment: Environment | None = None
    ) -> "Robot":
        """The robot of a design and a controller at this fidelity, for a task, which a closed loop observes.

        Without an environment it is not to be simulated: only its parameters and its shape are right.

        Raises:
            UnknownNameError, UsageError: an unknown name or an invalid parameter.
                A stored gait does not fit the body or the task.
            SceneError: the fidelity is too coarse for a single particle of the body, or for its head or tail.
        """
        made, body = sampled(design, fidelity)
        moved_by = placed_on(body, registry.create(Kind.CONTROLLER, controller), made)
        layout: Layout = ()
        if not isinstance(moved_by, OpenLoop):
            layout = layout_of(body.muscle_count, seen_by(moved_by, registry.create(Kind.TASK, task)))
        space = made if isinstance(made, DesignSpace) else None
        robot = cls(moved_by, body, space, fidelity.least_occupancy, layout)
        if environment is not None:
            firm = firm_body(body, environment.robot) if space is None else body
            robot = replace(robot, body=firm, onset=environment.onset, material=environment.robot)
        if isinstance(moved_by, Gait):
            robot._check_gait(moved_by.start.spec)
        return robot

    @classmethod
    def of_run(cls, spec: RunSpec) -> "Robot":
        """The robot of a run; errors as of `of`."""
        return cls.of(spec.design, spec.controller, fidelity_of_run(spec), spec.task)

    def _check_gait(self, spec: RunSpec) -> None:
        """Raise UsageError if the gait found in that run has other muscles to drive or other things to see here."""
        home = Robot.of_run(spec)
        if home.body.muscle_count != self.body.muscle_count:
            raise UsageError(
                f"The stored gait does not fit: it drives the {home.body.muscle_count} muscles of {spec.design}, and "
                f"this body has {self.body.muscle_count}. Choose a body with as many, or the gait of another run."
            )
        if home.layout != self.layout:
            raise UsageError(
                f"The stored gait does not fit: it observes {home.senses}, and is given {self.senses} here. "
                f"Choose the task {spec.task.name}, or the gait of another run."
            )

    @property
    def senses(self) -> str:
        """The layout in words, such as `body (8), muscles (60), time left (1)`."""
        return ", ".join(f"{name.replace('_', ' ')} ({count})" for name, count in self.layout)

    @property
    def control_count(self) -> int:
        """Number of the controller's parameters."""
        muscles = self.body.muscle_count
        if isinstance(self.controller, OpenLoop):
            return self.controller.parameter_count(muscles)
        return self.controller.parameter_count(muscles, self._observation_count)

    @property
    def _observation_count(self) -> int:
        return sum(count for _, count in self.layout)

    @property
    def parameter_count(self) -> int:
        """Number of all parameters."""
        return self.control_count + (self.space.parameter_count(self.body) if self.space else 0)

    @property
    def site_space(self) -> SiteSpace:
        """The design space, if it has a row of parameters for every site.

        Raises:
            UsageError: it has not, or the body is fixed.
        """
        if not isinstance(self.space, SiteSpace):
            raise UsageError(
                "Patterns need a design space with a row of parameters for every site. "
                "Choose one: --design particle or --design voxel."
            )
        return self.space

    def initial(self, rng: np.random.Generator) -> Array:
        """A draw from the priors of both parts `[parameter_count]`; the body is drawn until one can be built."""
        muscles = self.body.muscle_count
        if isinstance(self.controller, OpenLoop):
            control = self.controller.initial(rng, muscles)
        else:
            control = self.controller.initial(rng, muscles, self._observation_count)
        if self.space is None:
            return control
        for _ in range(_DRAWS):
            draw = np.concatenate([control, self.space.initial(rng, self.body)])
            with contextlib.suppress(SceneError):
                self.formed(draw)
                break
        return draw

    def draft(self, row: "Tensor", times: "Tensor") -> Draft:
        """The robot for the parameters `row` `[1, parameter_count]` and control frames at `times` `[frames]` [s]."""
        activity = row.new_zeros((len(times), 1, self.body.muscle_count))
        if isinstance(self.controller, OpenLoop):
            activity = self.controller.actuation(row[:, : self.control_count], times, self.body.muscle_count)
            activity = activity * self.strength(times)[:, None, None]
        form, feasibility = None, None
        if self.space is not None:
            form, feasibility = buildable(self.space, row[:, self.control_count :], self.body)
            if self.material is not None:
                form = firm_form(form, self.body, self.material)
        return Draft(row, activity, self.body, form, feasibility, self.least_occupancy)

    def strength(self, times: "Tensor") -> "Tensor":
        """Share of the activity asked for that muscles have at these times [s], of any shape: a raised cosine."""
        import torch

        if not self.onset:
            return torch.ones_like(times)
        return 0.5 - 0.5 * torch.cos(torch.clamp(math.pi / self.onset * times, max=math.pi))

    def formed(self, parameters: Array) -> Body:
        """The body at rest for `parameters` `[parameter_count]`, as it is shown and exported: that which is scored, but
        of a design space with all of the muscles that `firm_muscles` takes from soft matter.

        Raises:
            SceneError: it cannot be built.
        """
        if self.space is None:
            return self.body
        return body_for(self.space, parameters[self.control_count :], self.body)


def gait_of(robot: Robot) -> RunSpec | None:
    """The run in which a robot's stored gait was found; None if it has another controller."""
    return robot.controller.start.spec if isinstance(robot.controller, Gait) else None


def sampled(design: Ref, fidelity: Fidelity) -> tuple[Design, Body]:
    """A design and its body at this fidelity; errors as of `Robot.of`."""
    whole = registry.resolve(Kind.DESIGN, design)
    return _sampled(registry.get(Kind.DESIGN, whole.name, whole.version).factory, whole, fidelity)


@lru_cache(maxsize=16)
def _sampled(factory: Callable[..., Design], ref: Ref, fidelity: Fidelity) -> tuple[Design, Body]:
    """The design of a complete reference and its body; kept, since cells share them and sampling takes long.

    The factory is part of the key: two plug-ins may have one name, one after the other.
    """
    made: Design = registry.create(Kind.DESIGN, ref)
    body = made.body(fidelity)
    check_ends(body, ref.name)
    return made, body


def elongation(places: Array, volumes: Array) -> float:
    """Elongation of matter of these volumes `[n]` [m^3] at `places` `[n, 3]` [m], in [0, 1].

    1 - (second longest / longest standard deviation along the principal axes): 0 for a ball or a disc, 1 for a needle.
    """
    centre = np.average(places, axis=0, weights=volumes)
    apart = places - centre
    moments = (apart[:, :, None] * (volumes[:, None] * apart)[:, None, :]).sum(axis=0)
    spreads, _ = symmetric_eigen(moments)
    return float(1.0 - np.sqrt(max(spreads[1], 0.0) / spreads[2]))
