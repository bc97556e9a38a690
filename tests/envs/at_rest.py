"""Environments at rest, with the default robot."""

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.designs.caterpillar import Caterpillar
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.solver import Solver
from zoobench.spec import Ref

ENVS = registry.names(Kind.ENV)


def made(name: str) -> Environment:
    """A registered environment."""
    env: Environment = registry.create(Kind.ENV, Ref.parse(name))
    return env


def solver_of(name: str, fidelity: Fidelity, body: Body | None = None) -> Solver:
    """A solver that starts from the equilibrated state, of the caterpillar if no body is given."""
    env = made(name)
    fidelity = env.simulated(fidelity)
    scene = env.scene(body or Caterpillar().body(fidelity), fidelity)
    return Solver(scene, fidelity, start=equilibrated(scene, fidelity, env.equilibration_frames))
