"""A stored body: that of a run's solution in a design space, which stays as it is while the gait changes."""

from dataclasses import dataclass

import numpy as np

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.run_fidelity import fidelity_of_run
from zoobench.designs.solid import body_for
from zoobench.designs.space import DesignSpace
from zoobench.errors import UsageError
from zoobench.inputs import StoredRun, solution_in
from zoobench.registry import Kind, register
from zoobench.sim.model.fidelity import Fidelity


@register(Kind.DESIGN, "stored")
@dataclass(frozen=True, kw_only=True)
class StoredBody:
    """The solid body of a stored run's solution in a design space, without parameters.

    At another fidelity it is made again from the same parameters, where the space takes as many there.

    * `run`: a run that is done, in the same database.
    """

    run: StoredRun

    def __post_init__(self) -> None:
        self._space()

    def body(self, fidelity: Fidelity) -> Body:
        """The body at this resolution.

        Raises:
            UsageError: the space takes another number of parameters than at the run's fidelity.
            SceneError: it cannot be built at this fidelity.
        """
        start, space = solution_in(self.run), self._space()
        home = space.parameter_count(space.body(fidelity_of_run(start.spec)))
        workspace = space.body(fidelity)
        if (count := space.parameter_count(workspace)) != home:
            raise UsageError(
                f"The stored body of {self.run} has {home} parameters at {start.spec.fidelity.name}; at this fidelity "
                f"{start.spec.design.name} takes {count}. Give the run's own: --fidelity '{start.spec.fidelity}'."
            )
        return body_for(space, np.array(start.params[len(start.params) - home :]), workspace)

    def _space(self) -> DesignSpace:
        design = solution_in(self.run).spec.design
        made = registry.create(Kind.DESIGN, design)
        if not isinstance(made, DesignSpace):
            raise UsageError(
                f"The body of {self.run} was given to it. Give the same: --design '{design}', or name a run in a "
                "design space."
            )
        return made
