"""Granular and plastic media under impacts, separation and load cycles."""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.matter import LARGEST_PLASTIC, SMALLEST_PLASTIC, Law
from zoobench.sim.model.scene import Ground, Scene
from zoobench.verify.energies import medium_strain, to_array
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Case, Probe, add_case, case
from zoobench.verify.stability.ledger import GROWTH, episode, healthy, march

if TYPE_CHECKING:
    from zoobench.sim.solver import Solver


def _heavy_drop(name: str, probe: Probe) -> None:
    from zoobench.sim.solver import Solver

    h = scenes.SPACING
    medium = scenes.bed_of(scenes.medium_material(name), scenes.lattice(scenes.ORIGIN, (12, 3, 12)))
    positions = scenes.lattice((4.5 * h, 3 * h, 4.5 * h), (3, 3, 3))
    body = scenes.passive(positions, velocity=np.array([0.0, -10.0, 0.0]))
    scene = Scene(body, scenes.ORIGIN, (12 * h, 0.75, 12 * h), medium=medium, ground=Ground(0.5))
    solver = Solver(scene, scenes.fidelity(), frame_seconds=0.002)
    rollout, ledger = episode(probe, solver, 50)
    healthy(probe, rollout)
    probe.below("energy / initial", ledger.growth, GROWTH)
    probe.above("lowest [cells]", ledger.smallest(lambda entry: entry.lowest[1]) / h, -1.0)
    probe.above("smallest J of the robot", float(rollout.smallest_j.min()), 0.05)
    taken = solver.frame_seconds / float(rollout.counts.max())
    probe.below("step / dt_iso when hardest", taken / solver.limit.dt_iso, 0.9)
    strain, history = medium_strain(solver)
    if name == "snow":
        probe.above("smallest plastic volume ratio", float(history.min()), SMALLEST_PLASTIC * (1.0 - 1e-6))
        probe.remark(f"at the hardening cap {float((history <= SMALLEST_PLASTIC * 1.000001).mean()):.2%} of the snow")
    if name == "water":
        probe.above("smallest J of the water", float(history.min()), 0.5)
    else:
        probe.above("smallest elastic J of the medium", float(np.exp(strain.sum(1)).min()), 0.5)


for _name in scenes.medium_names():
    add_case(
        Case(
            f"drop-on-{_name}",
            f"A block of rubber hits a bed of {_name} at 10 m/s.",
            partial(_heavy_drop, _name),
            is_fast=_name == "snow",
        )
    )


@case("sand-lift-off", fast=False)
def sand_lift_off(probe: Probe) -> None:
    """An equilibrated box of sand is thrown up, its top faster than its foot; it parts, falls back and fills its room.

    The sand swings on between smooth walls, where nothing shears it: its room at the end is a mean over time. How much
    a particle has to give back is known as long as its neighbours are within a cell, up to twice the length with two
    particles per cell and axis; what a harder throw costs is reported.
    """
    from zoobench.sim.solver import Solver

    h = scenes.SPACING
    medium = scenes.bed_of(scenes.medium_material("sand"), scenes.lattice(scenes.ORIGIN, (4, 8, 4)))
    tracer = scenes.bystander((2 * h, 4 * h, 2 * h))
    scene = Scene(tracer, scenes.ORIGIN, (4 * h, 0.75, 4 * h), medium=medium, ground=Ground(0.5))
    start = Solver(scene, scenes.fidelity(64)).equilibrate(100)
    rest = _medium_heights(Solver(scene, scenes.fidelity(64), start=start))
    for throw in (1.0, 1.5):
        solver = Solver(scene, scenes.fidelity(64), start=start)
        solver.reset()
        solver.matter.v[0, 0, 1:, 1] = solver.simulation.tensor(throw * rest / (8 * h))
        centre, tension = [], []
        for _ in range(250):
            march(probe, solver, 6, solver.dt, every=6)
            centre.append(float(_medium_heights(solver).mean() / rest.mean()))
            tension.append(float(to_array(solver.matter.tau[0, 0])[:, :3].sum(1).max()) / 3.0)
        gain = float(np.mean(centre[-80:])) - 1.0
        probe.below(f"{throw:g} m/s: largest mean tension [Pa]", max(tension), 1e-6)
        if throw == 1.0:
            probe.above("rise of the centre / its height", max(centre), 1.1)
            probe.below("|change of volume|", abs(gain), 0.02)
        else:
            probe.remark(f"at {throw:g} m/s the centre rises to {max(centre):.2f} and the volume changes by {gain:.1%}")


def _medium_heights(solver: "Solver") -> Array:
    """Heights of the medium's particles above the ground [m]."""
    heights: Array = to_array(solver.matter.x[0, 0, solver.robot_count :, 1]) + solver.origin[1]
    return heights


@case("snow-load-cycles", fast=False)
def snow_load_cycles(probe: Probe) -> None:
    """Snow is driven through volume cycles far beyond its clamps: it never gives back more work than it got.

    The velocity gradient is prescribed: the particle is made so heavy that its stress cannot change it. Per cycle the
    work of the stress is the energy that snow turns into heat, which cannot be negative once the state repeats.
    """
    from zoobench.sim.solver import Solver

    material = replace(scenes.medium_material("snow"), density=1e12)
    assert material.law is Law.SNOW
    bed = scenes.bed_of(material, np.array([[0.5, 0.5, 0.5]]))
    scene = Scene(scenes.bystander((0.1, 0.1, 0.1)), scenes.ORIGIN, (1.0, 1.0, 1.0), medium=bed, gravity=scenes.STILL)
    solver = Solver(scene, scenes.fidelity(64))
    solver.reset()
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
    probe.note_step(solver, dt)
    probe.holds("stress finite", bool(np.isfinite(to_array(solver.matter.tau)).all()))
    for number, work in enumerate(works, start=1):
        probe.above(f"work of cycle {number} [J/m^3]", work, -1e-6)
    probe.below("hardest plastic volume ratio reached", extremes[0], SMALLEST_PLASTIC)
    probe.above("hardest plastic volume ratio", extremes[0], SMALLEST_PLASTIC)
    probe.above("loosest plastic volume ratio reached", extremes[1], 0.999 * LARGEST_PLASTIC)
    probe.below("loosest plastic volume ratio", extremes[1], LARGEST_PLASTIC)
