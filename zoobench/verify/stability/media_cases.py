"""Granular and plastic media under impacts, separation and load cycles."""

from dataclasses import replace

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.matter import LARGEST_PLASTIC, SMALLEST_PLASTIC, Law
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.solver import Solver
from zoobench.verify.cases import Case
from zoobench.verify.energies import medium_strain, to_array
from zoobench.verify.stability import stability_scenes as scenes
from zoobench.verify.stability.episode_recorder import EpisodeRecorder, case

CASES: list[Case] = []


def heavy_drop(record: EpisodeRecorder, name: str) -> None:
    """A block of rubber hits a bed of a medium at 10 m/s."""
    h = scenes.SPACING
    medium = scenes.bed_of(scenes.medium_material(name), scenes.lattice(scenes.ORIGIN, (12, 3, 12)))
    positions = scenes.lattice((4.5 * h, 3 * h, 4.5 * h), (3, 3, 3))
    body = scenes.passive(positions, velocity=np.array([0.0, -10.0, 0.0]))
    scene = Scene(body, scenes.ORIGIN, (12 * h, 0.75, 12 * h), medium=medium, ground=Ground(0.5))
    solver = Solver(scene, scenes.fidelity(), frame_seconds=0.002)
    rollout, energies = record.episode(solver, 50)
    record.energy_bounded(energies)
    record.stays_above(energies, scenes.SPACING)
    record.at_least("smallest J of the robot", rollout.smallest_j.min(), 0.05)
    taken = solver.frame_seconds / float(rollout.counts.max())
    record.at_most("step / dt_iso when hardest", taken / solver.limit.dt_iso, 0.9)
    strain, history = medium_strain(solver)
    if name == "snow":
        record.at_least("smallest plastic volume ratio", history.min(), SMALLEST_PLASTIC * (1.0 - 1e-6))
        record.remark(f"at the hardening cap {float((history <= SMALLEST_PLASTIC * 1.000001).mean()):.2%} of the snow")
    if name == "water":
        record.at_least("smallest J of the water", history.min(), 0.5)
    else:
        record.at_least("smallest elastic J of the medium", np.exp(strain.sum(1)).min(), 0.5)


for _name in scenes.medium_names():
    _summary = f"A block of rubber hits a bed of {_name} at 10 m/s."
    case(CASES, f"drop-on-{_name}", args=(_name,), summary=_summary, is_fast=_name == "snow")(heavy_drop)


@case(CASES, "sand-lift-off", is_fast=False)
def sand_lift_off(record: EpisodeRecorder) -> None:
    """An equilibrated box of sand is thrown up, its top faster than its foot; it parts, falls and regains its volume.

    The sand oscillates between smooth walls, where nothing shears it: its final volume is a mean over time. The volume
    of a particle is resolved as long as its neighbours are within a cell, up to twice the length with two particles
    per cell and axis; the change of volume after a harder throw is reported.
    """
    h = scenes.SPACING
    medium = scenes.bed_of(scenes.medium_material("sand"), scenes.lattice(scenes.ORIGIN, (4, 8, 4)))
    tracer = scenes.bystander((2 * h, 4 * h, 2 * h))
    scene = Scene(tracer, scenes.ORIGIN, (4 * h, 0.75, 4 * h), medium=medium, ground=Ground(0.5))
    start = Solver(scene, scenes.fidelity(64)).equilibrate(100)
    rest = _medium_heights(Solver(scene, scenes.fidelity(64), start=start))
    for throw in (1.0, 1.5):
        solver = scenes.reset_solver(scene, start=start)
        solver.matter.v[0, 0, 1:, 1] = solver.simulation.tensor(throw * rest / (8 * h))
        centre, tension = [], []
        for _ in range(250):
            record.march(solver, 6, solver.dt, every=6)
            centre.append(float(_medium_heights(solver).mean() / rest.mean()))
            tension.append(float(to_array(solver.matter.tau[0, 0])[:, :3].sum(1).max()) / 3.0)
        gain = float(np.mean(centre[-80:])) - 1.0
        record.at_most(f"{throw:g} m/s: largest mean tension [Pa]", max(tension), 1e-6)
        if throw == 1.0:
            record.at_least("rise of the centre / its height", max(centre), 1.1)
            record.at_most("|change of volume|", abs(gain), 0.02)
        else:
            rise = f"the centre rises to {max(centre):.2f} and the volume changes by {gain:.1%}"
            record.remark(f"at {throw:g} m/s {rise}")


def _medium_heights(solver: Solver) -> Array:
    """Heights of the medium's particles above the ground [m]."""
    heights: Array = to_array(solver.matter.x[0, 0, solver.robot_count :, 1]) + solver.origin[1]
    return heights


@case(CASES, "snow-load-cycles", is_fast=False)
def snow_load_cycles(record: EpisodeRecorder) -> None:
    """Snow is driven through volume cycles far beyond its clamps: it never returns more work than was done on it.

    The velocity gradient is prescribed: the particle is so heavy that its stress cannot change it. The work of the
    stress in a cycle is dissipated, and cannot be negative once the state repeats.
    """
    material = replace(scenes.medium_material("snow"), density=1e12)
    assert material.law is Law.SNOW
    solver = scenes.reset_solver(scenes.lone_bed(scenes.bed_of(material, np.array([[0.5, 0.5, 0.5]]))))
    works, extremes, dt, steps = [], [1.0, 1.0], 1e-4, 2000
    for amplitude in (0.01, 0.5, 4.0, 0.5, 0.5):
        work = 0.0
        rates = amplitude / (0.5 * steps * dt) * np.where((np.arange(steps) // (steps // 4)) % 3 == 0, -1.0, 1.0)
        for rate in rates:
            C = np.diag([rate, 0.6 * rate, 0.4 * rate]) / 2.0
            solver.matter.C[0, 0, 1] = solver.simulation.tensor(C)
            before = to_array(solver.matter.tau[0, 0, 0])
            solver.substeps(1, dt)
            after = to_array(solver.matter.tau[0, 0, 0])
            work += 0.5 * dt * float((before + after)[:3] @ np.diag(C))
            plastic = float(solver.matter.history[0, 0, 0])
            extremes = [min(extremes[0], plastic), max(extremes[1], plastic)]
        works.append(work)
    record.add_step(solver, dt)
    record.holds("stress finite", bool(np.isfinite(to_array(solver.matter.tau)).all()))
    for number, work in enumerate(works, start=1):
        record.at_least(f"work of cycle {number} [J/m^3]", work, -1e-6)
    record.at_most("hardest plastic volume ratio reached", extremes[0], SMALLEST_PLASTIC)
    record.at_least("hardest plastic volume ratio", extremes[0], SMALLEST_PLASTIC)
    record.at_least("loosest plastic volume ratio reached", extremes[1], 0.999 * LARGEST_PLASTIC)
    record.at_most("loosest plastic volume ratio", extremes[1], LARGEST_PLASTIC)
