"""Isolated particles: they bear the least, so the step limit is theirs; and what happens beyond it."""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from zoobench.sim.model.laws_numpy import principal_stress
from zoobench.sim.model.matter import SMALLEST_PLASTIC, Law
from zoobench.sim.model.scene import Scene
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Case, Probe, add_case, case
from zoobench.verify.stability.ledger import flagged, march

if TYPE_CHECKING:
    from zoobench.sim.solver import Solver

NEAR = 0.98
BEYOND = 1.05
_LONG = 10_000
_PLACE = (0.513, 0.497, 0.521)  # no special place in its cell
_PRESSED = np.array([[-1.2e-5, -1.0e-5, -1.1e-5]])  # within every yield surface


def energy_bound(fraction: float) -> float:
    """How far above its initial value symplectic Euler lets the energy of an oscillator rise.

    From rest, p^2 + x^2 - 2 c x p is kept (in units of the frequency) with c the fraction of the largest stable step,
    and |2 c x p| <= c (p^2 + x^2): the energy stays below 1 / (1 - c) of the initial one.
    """
    return 1.0 / (1.0 - fraction)


def lone_elastic() -> Scene:
    """One elastic particle in free flight."""
    return scenes.flight(scenes.passive(np.array([_PLACE])), 1.0)


def lone_medium(name: str) -> Scene:
    """One particle of a medium, slightly pressed; water as much as its step limit allows, snow as hard as it gets."""
    material = scenes.medium_material(name)
    strains = np.full((1, 3), np.log(0.9) / 3.0) if material.law is Law.WATER else _PRESSED
    bed = scenes.bed_of(material, np.array([_PLACE]), strains)
    if material.law is Law.SNOW:
        hard = np.full(1, SMALLEST_PLASTIC)
        stress = np.hstack([principal_stress(material, strains, hard), np.zeros((1, 3))])
        bed = replace(bed, history=hard, stress=stress)
    return Scene(scenes.bystander((0.1, 0.1, 0.1)), scenes.ORIGIN, (1.0, 1.0, 1.0), medium=bed, gravity=scenes.STILL)


@case("lone-elastic")
def lone_elastic_particle(probe: Probe) -> None:
    """One elastic particle, hardly strained, for 10,000 steps of 0.98 dt_iso."""
    from zoobench.sim.solver import Solver

    solver = Solver(lone_elastic(), scenes.fidelity(64))
    solver.reset()
    solver.matter.load_slot(0, scenes.strained(solver, np.diag([1.0 + 1e-5, 1.0, 1.0 + 0.5e-5])))
    _stays_bounded(probe, solver, NEAR, _LONG)


@case("lone-elastic-stretched")
def stretched_particle(probe: Probe) -> None:
    """One elastic particle, strained by 10 %, for 10,000 steps of 0.7 dt_iso.

    dt_iso is the limit of small strains. At sqrt(3)/2 of it a particle swings once in three steps, and the part of the
    stress that is quadratic in strain drives it at that resonance: with 10 % strain it inverts within some hundred
    steps. At half of dt_iso, which is what the solver takes by default, no such low resonance is near.
    """
    from zoobench.sim.solver import Solver

    for share, steps in ((0.5, 2000), (0.7, _LONG)):
        solver = Solver(lone_elastic(), scenes.fidelity(64))
        solver.reset()
        solver.matter.load_slot(0, scenes.strained(solver, np.diag([1.1, 1.0, 1.05])))
        _stays_bounded(probe, solver, share, steps)


def _lone_medium(name: str, probe: Probe) -> None:
    from zoobench.sim.solver import Solver

    solver = Solver(lone_medium(name), scenes.fidelity(64))
    solver.reset()
    _stays_bounded(probe, solver, NEAR, _LONG)


def _stays_bounded(probe: Probe, solver: "Solver", fraction: float, steps: int) -> None:
    """March at this fraction of the limit of the present state, which energy must not outgrow."""
    dt = fraction * solver.current_limit()[0].dt_iso
    ledger = march(probe, solver, steps, dt, every=13)
    probe.below(f"energy / initial at {fraction:g} dt_iso", ledger.growth, energy_bound(fraction))
    probe.above("smallest J", ledger.smallest(lambda entry: entry.smallest_j), 0.5)
    mass = float(solver.parameters.mass.max())
    speed = ledger.largest(lambda entry: float(np.linalg.norm(entry.momentum))) / mass
    probe.below("speed of the centre [m/s]", speed, 1e-10)
    probe.holds("healthy", not flagged(solver, dt))


for _name in scenes.medium_names():
    add_case(
        Case(
            f"lone-{_name}",
            f"One particle of {_name}, compressed, for 10,000 steps of 0.98 dt_iso.",
            partial(_lone_medium, _name),
            is_fast=_name in ("sand", "water"),
        )
    )


def spray_scene() -> Scene:
    """500 particles: 250 alone, 125 pairs at random distances up to 1.4 cells, the groups out of each other's reach."""
    rng = np.random.default_rng(5)
    sites = 5.0 * np.indices((8, 8, 6)).reshape(3, -1).T[:375] + 3.0 + rng.uniform(-0.5, 0.5, (375, 3))
    apart = rng.normal(size=(125, 3))
    apart *= rng.uniform(0.2, 1.4, (125, 1)) / np.linalg.norm(apart, axis=1, keepdims=True)
    positions = scenes.SPACING * np.concatenate([sites, sites[250:] + apart])
    return scenes.flight(scenes.passive(positions), 1.35)


@case("spray")
def spray(probe: Probe) -> None:
    """500 single and paired particles for 2000 steps: small strains at 0.9 dt_iso, some per cent at a half."""
    from zoobench.sim.solver import Solver

    for fraction, strain in ((0.9, 1e-4), (0.5, 0.03)):
        solver = Solver(spray_scene(), scenes.fidelity(64))
        solver.reset()
        disorder = np.random.default_rng(6).normal(size=(solver.robot_count, 3, 3))
        solver.matter.load_slot(0, scenes.strained(solver, np.eye(3) + strain * disorder))
        dt = fraction * solver.current_limit()[0].dt_iso
        ledger = march(probe, solver, 2000, dt, every=5)
        probe.below(
            f"strains of {strain:g} at {fraction:g} dt_iso: energy / initial", ledger.growth, energy_bound(fraction)
        )
        probe.above("smallest J", ledger.smallest(lambda entry: entry.smallest_j), 0.5)
        probe.holds("healthy", not flagged(solver, dt))


@case("control-beyond-limit")
def beyond_the_limit(probe: Probe) -> None:
    """Negative control: at 1.05 dt_iso lone particles of rubber and clay blow up, and the health check says so."""
    from zoobench.sim.solver import Solver

    for name in ("elastic", "clay"):
        scene = lone_elastic() if name == "elastic" else lone_medium(name)
        solver = Solver(scene, scenes.fidelity(64))
        solver.reset()
        if name == "elastic":
            solver.matter.load_slot(0, scenes.strained(solver, np.diag([1.001, 1.0, 1.0])))
        dt = BEYOND * solver.current_limit()[0].dt_iso
        found, steps = "", 0
        while not found and steps < 400:
            march(probe, solver, 1, dt, every=1)
            found, steps = flagged(solver, dt), steps + 1
        probe.holds(f"{name} flagged ({found or 'nothing'}) after {steps} steps", bool(found))


@case("control-unsafe-step")
def unsafe_step(probe: Probe) -> None:
    """Negative control: a fixed step above 0.9 dt_iso is refused with the limit and the matter that sets it."""
    from zoobench.sim.solver import Solver

    for name in (None, *scenes.medium_names()):
        scene = lone_elastic() if name is None else lone_medium(name)
        limit = Solver(scene, scenes.fidelity(), frame_seconds=1.0).limit.dt_iso
        for share in (0.92, BEYOND):
            step = share * limit

            def build(scene: Scene = scene, step: float = step) -> None:
                Solver(scene, scenes.fidelity(step=step), frame_seconds=step)

            words = f"The {name or 'robot'} sets the limit: dt_iso = {limit:.3g} s"
            probe.refuses(f"{name or 'elastic'} at {share:.2f} dt_iso", words, build)
        safe = Solver(scene, scenes.fidelity(step=0.88 * limit), frame_seconds=0.88 * limit)
        probe.below(f"{name or 'elastic'} at 0.88 dt_iso taken: step / dt_iso", safe.limit.fraction, 0.9)
