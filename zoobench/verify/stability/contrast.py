"""Matter that differs by orders of magnitude within one scene, and matter that hardly changes its volume."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.matter import ElasticMaterial
from zoobench.sim.model.scene import ElasticBody
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import GROWTH, episode, healthy
from zoobench.verify.stability.strains import strained_solver


@case("soft-on-stiff")
def soft_on_stiff(probe: Probe) -> None:
    """A block of 1 kPa falls on one of 10 MPa, both one body to the solver: the stiff one sets the step."""
    from zoobench.sim.solver import Solver

    stiff = scenes.lattice((0.25, 0.0, 0.25), (5, 2, 5))
    soft = scenes.lattice((0.28125, 0.0703125, 0.28125), (3, 3, 3))
    material = ElasticMaterial(youngs_modulus=1e7, poissons_ratio=0.3, density=1000.0)
    body = scenes.passive(np.concatenate([stiff, soft]), material)
    stiffness, velocities = body.stiffness.copy(), body.velocities.copy()
    stiffness[len(stiff) :], velocities[len(stiff) :, 1] = 1e-4, -1.0
    scene = scenes.drop(replace(body, stiffness=stiffness, velocities=velocities))
    solver = Solver(scene, scenes.fidelity())
    soft_alone = Solver(scenes.drop(scenes.passive(soft, replace(material, youngs_modulus=1e3))), scenes.fidelity())
    rollout, ledger = episode(probe, solver, 60)
    healthy(probe, rollout)
    probe.below("dt_iso / that of the soft block", solver.limit.dt_iso / soft_alone.limit.dt_iso, 0.01 * 1.001)
    probe.above("smallest J", float(rollout.smallest_j.min()), 0.05)
    probe.below("energy / initial", ledger.growth, GROWTH)
    below = rollout.positions[-1, 0, len(stiff) :, 1].min() - rollout.positions[-1, 0, : len(stiff), 1].max()
    probe.above("soft above stiff [cells]", float(below) / scenes.SPACING, -1.0)
    probe.below(
        "escape of the stiff block downwards [cells]", -ledger.smallest(lambda e: e.lowest[1]) / scenes.SPACING, 1.0
    )


@case("light-on-heavy")
def light_on_heavy(probe: Probe) -> None:
    """A block whose upper half is a thousand times lighter, pressed by 2 % and let go: the light one sets the step."""
    body = scenes.passive(scenes.lattice((0.3125, 0.3125, 0.3125), (4, 4, 4)))
    ratio = np.where(body.positions[:, 1] > 0.375, 1e-3, 1.0)
    scene = scenes.flight(replace(body, density_ratio=ratio))
    plain = strained_solver(scenes.flight(body), scenes.fidelity(64), np.eye(3))
    solver = strained_solver(scene, scenes.fidelity(64), 0.98 * np.eye(3))
    rollout, ledger = episode(probe, solver, 20)
    healthy(probe, rollout)
    bound = 1e-3**0.5 * 1.001
    probe.below("dt_iso / that of the heavy half", solver.limit.dt_iso / plain.limit.dt_iso, bound)
    probe.below("energy / initial", ledger.growth, GROWTH)
    probe.above("smallest J", float(rollout.smallest_j.min()), 0.8)
    mass = float(solver.parameters.mass.sum())
    speed = ledger.largest(lambda entry: float(np.linalg.norm(entry.momentum))) / mass
    probe.below("speed of the centre / largest speed", speed / ledger.largest(lambda e: e.speed), 1e-9)


def _column(poissons_ratio: float) -> ElasticBody:
    material = ElasticMaterial(youngs_modulus=8e4, poissons_ratio=poissons_ratio, density=1000.0)
    return scenes.passive(scenes.lattice((0.3125, 0.0, 0.3125), (3, 8, 3)), material)


@case("nearly-incompressible")
def nearly_incompressible(probe: Probe) -> None:
    """A free-standing column under its weight at nu = 0.49 and 0.499: locking would make it stiffer than it is.

    On a frictionless floor the stress is uniaxial whatever Poisson's ratio is, so the top sinks by rho g H^2 / (2 E)
    for small strains; the wall costs up to 0.4 cells of the height.
    """
    from zoobench.sim.solver import Solver

    for ratio, seconds in ((0.3, 0.6), (0.49, 0.6), (0.499, 0.6)):
        body = _column(ratio)
        height = 8 * scenes.SPACING
        solver = Solver(scenes.drop(body, friction=0.0), scenes.fidelity(64))
        state = solver.equilibrate(round(seconds / solver.frame_seconds))
        probe.note_step(solver, solver.dt)
        place = state.x[0, 0].cpu().numpy() + solver.origin
        top = body.positions[:, 1] > height - 0.5 * scenes.SPACING
        depth = float((body.positions[top, 1] - place[top, 1]).mean())
        fibre = body.positions[top, 1].mean()  # the layer's own height, H - a quarter of a cell
        exact = 1000.0 * 9.81 * (height * fibre - 0.5 * fibre**2) / 8e4
        probe.below(f"nu = {ratio:g}: settlement / exact", depth / exact, 1.2)
        probe.above(f"nu = {ratio:g}: settlement / exact", depth / exact, 0.8)
