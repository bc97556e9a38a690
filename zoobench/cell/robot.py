"""The robot as a function of a parameter vector: muscle activity and, in a design space, the body."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.controllers.base import Controller, OpenLoop
from zoobench.designs.base import Body, Design, check_ends
from zoobench.designs.feasibility import SOLID, Feasibility, feasible
from zoobench.designs.space import DesignSpace, Form, SiteSpace
from zoobench.errors import SceneError, Unbuildable, UsageError
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import Ref
from zoobench.tasks.base import Metric

if TYPE_CHECKING:
    from torch import Tensor


_LASTING = ("positions", "volumes", "density_ratio", "head", "tail")
"""Arrays of a body that are the same for all forms in a workspace."""


@dataclass(frozen=True)
class Built:
    """One robot: the inputs of the simulator, connected to the parameters by autograd.

    Attributes:
        row: the parameters `[1, parameter_count]`, the leaf of the gradient.
        activity: `[frames, 1, muscle_count]`; zero in a closed loop, where it follows from the motion.
        matter: the body's arrays by the simulator's names; empty for a fixed body.
        feasibility: of a body from a design space; None for a fixed body.
        body: the fixed body, or the workspace.
    """

    row: "Tensor"
    activity: "Tensor"
    matter: "dict[str, Tensor]"
    feasibility: Feasibility | None
    body: Body

    @property
    def fault(self) -> str:
        """The reason why it cannot be built; empty if it can."""
        return "" if self.feasibility is None else self.feasibility.fault

    def metrics(self) -> dict[str, Metric]:
        """Metrics of a body from a design space; empty for a fixed body.

        * `body_volume`, `elongation`: of the whole body, weighted by occupancy.
        * `components`: connected pieces of solid matter, before all but the largest are removed.
        * `mass_kept`: the largest piece's share of their mass.
        """
        if self.feasibility is None:
            return {}
        volumes = self.matter["occupancy"].detach()[0].numpy() * self.body.volumes
        return {
            "body_volume": Metric(float(volumes.sum()), "m^3"),
            "elongation": Metric(elongation(self.body.positions, volumes), "1"),
            "components": Metric(float(self.feasibility.components), "1"),
            "mass_kept": Metric(self.feasibility.mass_kept, "1"),
        }

    def gradient(self, adjoints: dict[str, Array]) -> Array:
        """The gradient `[parameter_count]` from adjoints of the activity and of the body's arrays, by their names.

        Adjoints that are zero may be left out.
        """
        import torch

        outputs = {"activity": self.activity[:, 0], **{name: value[0] for name, value in self.matter.items()}}
        graded = {name: value for name, value in outputs.items() if name in adjoints and value.requires_grad}
        if not graded:
            return np.zeros(self.row.shape[1])
        weights = [torch.as_tensor(adjoints[name]) for name in graded]
        (gradient,) = torch.autograd.grad(list(graded.values()), self.row, weights)
        return gradient[0].numpy()


@dataclass(frozen=True)
class Robot:
    """A controller and a body with one parameter vector: the controller's part, then the design space's.

    Attributes:
        controller: drives the muscles.
        body: at rest; of a design space, the workspace.
        space: the design space, or None for a fixed body.
    """

    controller: Controller
    body: Body
    space: DesignSpace | None

    @classmethod
    def of(cls, design: Ref, controller: Ref, fidelity: Fidelity) -> "Robot":
        """The robot of a design and a controller at this fidelity.

        Raises:
            UnknownNameError, UsageError: an unknown name or an invalid parameter.
            SceneError: the fidelity is too coarse for a single particle of the body, or for its head or tail.
        """
        made: Design = registry.create(Kind.DESIGN, design)
        moved_by: Controller = registry.create(Kind.CONTROLLER, controller)
        body = made.body(fidelity)
        check_ends(body, design.name)
        return cls(moved_by, body, made if isinstance(made, DesignSpace) else None)

    @property
    def control_count(self) -> int:
        """Number of the controller's parameters."""
        return self.controller.parameter_count(self.body.muscle_count)

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
        """A draw from the priors of both parts `[parameter_count]`."""
        control = self.controller.initial(rng, self.body.muscle_count)
        return np.concatenate([control, self.space.initial(rng, self.body)]) if self.space else control

    def build(self, row: "Tensor", times: "Tensor") -> Built:
        """The robot for the parameters `row` `[1, parameter_count]` and control frames at `times` `[frames]` [s].

        A robot with a fault cannot be simulated.
        """
        activity = row.new_zeros((len(times), 1, self.body.muscle_count))
        if isinstance(self.controller, OpenLoop):
            activity = self.controller.actuation(row[:, : self.control_count], times, self.body.muscle_count)
        if self.space is None:
            return Built(row, activity, {}, None, self.body)
        form, feasibility = self._form(self.space, row)
        return Built(row, activity, form.matter(self.body), feasibility, self.body)

    def formed(self, parameters: Array) -> Body:
        """The body at rest for `parameters` `[parameter_count]`, reduced to its solid particles.

        Raises:
            SceneError: it cannot be built.
        """
        import torch

        if self.space is None:
            return self.body
        form, feasibility = self._form(self.space, torch.as_tensor(parameters[None]))
        if feasibility.fault:
            raise SceneError(str(Unbuildable(feasibility.fault)))
        solid = form.occupancy[0].numpy() > SOLID
        named = {name: value[0].numpy() for name, value in vars(form).items()}
        kept = {name: getattr(self.body, name) for name in _LASTING}
        named["stiffness"] = named["stiffness"] * self.body.stiffness
        return replace(self.body, **{name: value[solid] for name, value in (named | kept).items()}, malleable=False)

    def _form(self, space: DesignSpace, row: "Tensor") -> tuple[Form, Feasibility]:
        """The buildable form for the parameters `row` `[1, parameter_count]`, and its feasibility."""
        form, (feasibility,) = feasible(space.form(row[:, self.control_count :], self.body), self.body, space.connected)
        return form, feasibility


def elongation(places: Array, volumes: Array) -> float:
    """Elongation of matter of these volumes `[n]` [m^3] at `places` `[n, 3]` [m], in [0, 1].

    1 - (second longest / longest standard deviation along the principal axes): 0 for a ball or a disc, 1 for a needle.
    """
    centre = np.average(places, axis=0, weights=volumes)
    # einsum adds in the same order for any number of threads
    moments = np.einsum("ni,nj,n->ij", places - centre, places - centre, volumes)
    spreads = np.linalg.eigvalsh(moments)
    return float(1.0 - np.sqrt(max(spreads[1], 0.0) / spreads[2]))
