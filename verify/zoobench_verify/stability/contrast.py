"""Contrasts of stiffness and density by orders of magnitude, and nearly incompressible matter."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.laws.elastic import ElasticMaterial
from zoobench.sim.model.standing import standing
from zoobench.sim.solver import Solver
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case


@case("soft-on-stiff")
def soft_on_stiff(record: EpisodeRecorder) -> None:
    """A block of 1 kPa falls on one of 10 MPa, as one body: the stiff block sets the step."""
    stiff = scenes.lattice((0.25, 0.0, 0.25), (5, 2, 5))
    soft = scenes.lattice((0.28125, 0.0703125, 0.28125), (3, 3, 3))
    material = ElasticMaterial(youngs_modulus=1e7, poissons_ratio=0.3, density=1000.0)
    body = scenes.passive(np.concatenate([stiff, soft]), material)
    stiffness, velocities = body.stiffness.copy(), body.velocities.copy()
    stiffness[len(stiff) :], velocities[len(stiff) :, 1] = 1e-4, -1.0
    scene = standing(scenes.drop(replace(body, stiffness=stiffness, velocities=velocities)), scenes.EDGE)
    solver = Solver(scene, scenes.fidelity())
    # in flight, since the ground has a limit of its own
    soft_alone = Solver(scenes.flight(scenes.passive(soft, replace(material, youngs_modulus=1e3))), scenes.fidelity())
    rollout, energies = record.episode(solver, 60)
    record.at_most("dt_iso / that of the soft block", solver.limit.dt_iso / soft_alone.limit.dt_iso, 0.01 * 1.001)
    record.robot_volume(rollout, 0.05)
    record.energy_bounded(energies)
    below = rollout.positions[-1, 0, len(stiff) :, 1].min() - rollout.positions[-1, 0, : len(stiff), 1].max()
    record.at_least("soft above stiff [cells]", float(below) / scenes.SPACING, -1.0)
    record.at_most("escape of the stiff block downwards [cells]", -energies.lowest / scenes.SPACING, 1.0)


@case("light-on-heavy")
def light_on_heavy(record: EpisodeRecorder) -> None:
    """A block with an upper half of a thousandth of the density is released at 2 % strain: that half sets the step."""
    body = scenes.passive(scenes.cube())
    ratio = np.where(body.positions[:, 1] > 0.375, 1e-3, 1.0)
    scene = scenes.flight(replace(body, density_ratio=ratio))
    plain = scenes.strained_solver(scenes.flight(body), scenes.fidelity(64), np.eye(3))
    solver = scenes.strained_solver(scene, scenes.fidelity(64), 0.98 * np.eye(3))
    rollout, energies = record.episode(solver, 20)
    bound = 1e-3**0.5 * 1.001
    record.at_most("dt_iso / that of the heavy half", solver.limit.dt_iso / plain.limit.dt_iso, bound)
    record.energy_bounded(energies)
    record.robot_volume(rollout, 0.8)
    record.no_drift(solver, energies)


@case("nearly-incompressible")
def nearly_incompressible(record: EpisodeRecorder) -> None:
    """A free-standing column under its weight at nu = 0.49 and 0.499: locking would make it too stiff.

    On a frictionless floor the stress is uniaxial for any Poisson's ratio, so the top sinks by rho g H^2 / (2 E)
    for small strains; the error of the wall is up to 0.4 cells of the height.
    """
    height = 8 * scenes.SPACING
    for ratio in (0.3, 0.49, 0.499):
        material = ElasticMaterial(youngs_modulus=8e4, poissons_ratio=ratio, density=1000.0)
        body = scenes.passive(scenes.lattice((0.3125, 0.0, 0.3125), (3, 8, 3)), material)
        scene = standing(scenes.drop(body, friction=0.0), scenes.EDGE)  # the skin is as compressed before as after
        solver, risen = Solver(scene, scenes.fidelity(64)), scene.robot.positions[0, 1] - body.positions[0, 1]
        state = solver.equilibrate(round(0.6 / solver.frame_seconds))
        record.add_step(solver, solver.dt)
        positions = state.x[0, 0].cpu().numpy() + solver.origin
        top = body.positions[:, 1] > height - 0.5 * scenes.SPACING
        depth = float((body.positions[top, 1] - positions[top, 1]).mean() + risen)
        fibre = body.positions[top, 1].mean()  # initial height of the layer, H - a quarter of a cell
        exact = 1000.0 * 9.81 * (height * fibre - 0.5 * fibre**2) / 8e4
        record.at_most(f"nu = {ratio:g}: settlement / exact", depth / exact, 1.2)
        record.at_least(f"nu = {ratio:g}: settlement / exact", depth / exact, 0.8)
