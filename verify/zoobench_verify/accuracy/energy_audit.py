"""Energy balance of a simulation: work of the muscles, energy stored and dissipated, and the numerical loss.

    muscle work = growth of kinetic, elastic and potential energy + viscous + plastic + contact loss + unexplained

Every term but the last is physics of the model, integrated over the substeps from the particles' state. The last one is
lost to the numerics: the transfer between particles and grid, the time steps, the corrections of water.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.driving import random_actuation
from zoobench.cell.firm_muscles import firm_body
from zoobench.envs.base import Environment
from zoobench.errors import DivergenceError, UsageError
from zoobench.registry import Kind, short
from zoobench.sim.equilibrium import equilibrated
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.mud import MudMaterial
from zoobench.sim.model.laws.water import WaterMaterial
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.scene import Effect
from zoobench.sim.solver import BodyState, Solver
from zoobench.spec import FRAME_SECONDS, RunSpec
from zoobench_verify.accuracy.grid_rates import grid_rates
from zoobench_verify.accuracy.records import Balance
from zoobench_verify.energies import energy_balance, to_array, unpacked

FRAMES = 25
"""Length of an audited episode in control frames, 0.2 s."""


@dataclass
class Losses:
    """Energy that a world has lost so far, by cause [J]."""

    viscous: float = 0.0
    plastic: float = 0.0
    contact: float = 0.0


def balances(specs: Iterable[RunSpec], *, on_case: Callable[[str], None] = lambda _: None) -> Iterator[Balance]:
    """Energy balances of a short episode for every environment and fidelity of the study's runs.

    Episodes that diverge or have no balance are reported to `on_case` and left out.
    """
    cases = {(spec.env, spec.fidelity): spec for spec in specs if not spec.fidelity.kwargs["shift"]}
    for spec in cases.values():
        name = f"{spec.env.name} {short(Kind.FIDELITY, spec.fidelity)}"
        on_case(name)
        try:
            yield balance(spec)
        except (DivergenceError, UsageError) as error:
            on_case(f"{name}, which fails: {error}")


def balance(spec: RunSpec) -> Balance:
    """The energy balance of the first frames, with random parameters of the controller.

    Raises:
        DivergenceError: the simulation diverged.
        UsageError: the scene's water is on a grid.
    """
    env: Environment = registry.create(Kind.ENV, spec.env)
    grid = env.simulated(registry.create(Kind.FIDELITY, spec.fidelity))
    # matter that an arena leaves behind would take its energy along
    body = firm_body(registry.create(Kind.DESIGN, spec.design).body(grid), env.robot)
    scene = replace(env.scene(body, grid), follows=False)
    if scene.water is not None or scene.surface_water is not None:
        raise UsageError("energy is followed in particles, and water on a grid or by forces has none.")
    start = equilibrated(scene, grid, env.equilibration_frames, frame_seconds=FRAME_SECONDS)
    solver = Solver(scene, grid, frame_seconds=FRAME_SECONDS, start=start)
    controller, frames = registry.create(Kind.CONTROLLER, spec.controller), min(FRAMES, spec.frames)
    rollout = solver.run(random_actuation(controller, solver.muscle_count, frames, 1, spec.seed))
    losses, stored = follow(solver, rollout)
    work = rollout.muscle_work
    return Balance(
        env=spec.env,
        fidelity=spec.fidelity,
        put_in=float(np.maximum(work, 0.0).sum()),
        muscles=float(work.sum()),
        stored=stored,
        **asdict(losses),
    )


def follow(solver: Solver, rollout: Rollout) -> tuple[Losses, float]:
    """Repeat the only world of a rollout substep by substep, and integrate its losses of energy.

    Returns:
        the losses, and the growth of the energy stored in all matter [J].

    Raises:
        DivergenceError: the rollout diverged.
    """
    if rollout.divergences:
        raise DivergenceError(next(iter(rollout.divergences.values())))
    losses = Losses()
    solver.reset(BodyState(**rollout.body))
    before = energy_balance(solver)
    for frame, count in enumerate(rollout.counts[:, 0].tolist()):
        solver.simulation.set_tension(rollout, frame)
        for _ in range(count):
            _substep(solver, solver.frame_seconds / count, losses)
    after = energy_balance(solver)
    # energy that the ground's skin took and holds is stored, not lost
    losses.contact -= after.skin - before.skin
    return losses, after.total - before.total


def _substep(solver: Solver, dt: float, losses: Losses) -> None:
    """Simulate a substep of `dt` [s] and add its losses."""
    matter = solver.matter
    window = matter.window[0, 0].clone()
    # copies, since the substep overwrites them
    place, rate, strain, history = (
        to_array(tensor[0, 0]).copy() for tensor in (matter.x, matter.C, matter.b, matter.history)
    )
    unforced, forced = (to_array(solver.launcher.momenta(matter, solver.parameters, step)) for step in (0.0, dt))
    solver.substeps(1, dt)
    nodes = to_array(solver.launcher.nodes(window))
    push = dt * np.array(solver.scene.gravity)
    losses.contact += _contact_loss(unforced, forced, nodes, push)
    free = unforced / np.maximum(unforced[..., 3:], np.finfo(float).tiny)
    before, after = (_rates(solver, velocities, to_array(window)[:3], place) for velocities in (free, nodes))
    losses.viscous += dt * _viscous_power(solver, rate, 0.5 * (before + after))
    losses.plastic += _plastic_loss(solver, strain, history, after, dt)


def _rates(solver: Solver, nodes: Array, first: Array, places: Array) -> Array:
    """Velocity gradients `[particle_count, 3, 3]` [1/s] of all particles, each in its own field of the grid."""
    count = solver.robot_count
    fields = [(nodes[0], places[:count]), (nodes[-1], places[count:])]
    return np.concatenate([grid_rates(field, first, own, solver.fidelity) for field, own in fields if len(own)])


def _contact_loss(unforced: Array, forced: Array, after: Array, push: Array) -> float:
    """Energy taken from the nodes at ground and walls [J]: lost by friction and inelastic impact, or held by a skin.

    The work of their impulse on the mean of the velocities before and after the substep: matter that presses on a wall
    without moving loses nothing. `unforced` and `forced` hold momenta, `after` velocities, `[nx, ny, nz, 4]` with mass;
    `push` is the velocity gained from gravity `[3]` [m/s].
    """
    mass = forced[..., 3]
    there = mass > 0.0
    m = mass[there][:, None]
    old, new = unforced[there][:, :3] / m, after[there][:, :3]
    impulse = m * (new - push) - forced[there][:, :3]
    return -0.5 * float((impulse * (old + new)).sum())


def _viscous_power(solver: Solver, rate: Array, mean_rate: Array) -> float:
    """Power [W] of the viscous stresses at the velocity gradients `rate`, on the velocity gradients `mean_rate`."""
    count, volume = solver.robot_count, to_array(solver.parameters.volume[0])
    power = 0.0
    if Effect.DAMPING in solver.scene.effects:
        stress = 2.0 * solver.scene.robot.material.viscosity * _symmetric(rate[:count])
        power += float(volume[:count] @ (stress * mean_rate[:count]).sum((1, 2)))
    medium = solver.scene.medium
    if medium is not None and isinstance(medium.material, MudMaterial | WaterMaterial):
        shear = _symmetric(rate[count:])
        shear -= np.trace(shear, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
        power += float(volume[count:] @ (2.0 * medium.material.viscosity * shear * mean_rate[count:]).sum((1, 2)))
    return power


def _plastic_loss(solver: Solver, strain: Array, history: Array, rate: Array, dt: float) -> float:
    """Energy that solid media lose in a substep by yielding [J]."""
    medium = solver.scene.medium
    if medium is None or medium.material.is_liquid:
        return 0.0
    material, count = medium.material, solver.robot_count
    step = np.eye(3) + dt * rate[count:]
    trial = step @ unpacked(strain) @ np.swapaxes(step, 1, 2)
    principal = 0.5 * np.log(np.maximum(np.linalg.eigvalsh(trial), np.finfo(float).tiny))
    return float(to_array(solver.parameters.volume[0])[count:] @ yield_loss(material, principal, history))


def yield_loss(material: Medium, strain: Array, history: Array) -> Array:
    """Energy density [J/m^3] `[n]` lost in the return from trial Hencky strains `[n, 3]` with a history `[n]`.

    The work of the stress at the yield surface on the plastic strain, less the energy stored by hardening. It is not
    the difference of elastic energies, since a step may go far beyond the surface along which matter moves.
    """
    elastic, after = material.returned(strain, history)
    work: Array = (material.stress(elastic, after) * (strain - elastic)).sum(-1)
    return work + material.energy(elastic, history) - material.energy(elastic, after)


def _symmetric(rate: Array) -> Array:
    return 0.5 * (rate + np.swapaxes(rate, 1, 2))
