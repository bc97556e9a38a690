"""Isolated particles, which set the step limit, and steps beyond it."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.laws.snow import SMALLEST_PLASTIC, SnowMaterial
from zoobench.sim.model.scene import Scene
from zoobench.sim.solver import Solver
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case, flagged

NEAR = 0.98
BEYOND = 1.05
_LONG = 10_000
PLACE = (0.513, 0.497, 0.521)
"""A generic place in its cell [m]."""
_PRESSED = np.array([[-1.2e-5, -1.0e-5, -1.1e-5]])  # within every yield surface


def energy_bound(fraction: float) -> float:
    """Largest energy of an oscillator under symplectic Euler over its initial value.

    From rest, p^2 + x^2 - 2 c x p is constant (in units of the frequency) with c the fraction of the largest stable
    step, and |2 c x p| <= c (p^2 + x^2): the energy stays below 1 / (1 - c) of the initial one.
    """
    return 1.0 / (1.0 - fraction)


def lone_elastic() -> Scene:
    """One elastic particle in free flight."""
    return scenes.flight(scenes.passive(np.array([PLACE])), 1.0)


def lone_medium(name: str) -> Scene:
    """One particle of a medium, slightly compressed; water as much as its step limit allows, snow fully hardened."""
    material = scenes.medium_material(name)
    strains = np.full((1, 3), np.log(0.9) / 3.0) if material.is_liquid else _PRESSED
    bed = scenes.bed_of(material, np.array([PLACE]), strains)
    if isinstance(material, SnowMaterial):
        hard = np.full(1, SMALLEST_PLASTIC)
        stress = np.hstack([material.stress(strains, hard), np.zeros((1, 3))])
        bed = replace(bed, history=hard, stress=stress)
    return scenes.lone_bed(bed)


@case("lone-elastic")
def lone_elastic_particle(record: EpisodeRecorder) -> None:
    """One elastic particle, slightly strained, for 10,000 steps of 0.98 dt_iso."""
    solver = scenes.reset_solver(lone_elastic(), np.diag([1.0 + 1e-5, 1.0, 1.0 + 0.5e-5]))
    _stays_bounded(record, solver, NEAR, _LONG)


@case("lone-elastic-stretched")
def stretched_particle(record: EpisodeRecorder) -> None:
    """One elastic particle, strained by 10 %, for 10,000 steps of 0.7 dt_iso.

    dt_iso is the limit of small strains. At sqrt(3)/2 of it a particle oscillates in three steps, and the part of the
    stress that is quadratic in strain drives it at that resonance: with 10 % strain it inverts within some hundred
    steps. At half of dt_iso, the solver's default, no such low resonance is near.
    """
    for share, steps in ((0.5, 2000), (0.7, _LONG)):
        _stays_bounded(record, scenes.reset_solver(lone_elastic(), np.diag([1.1, 1.0, 1.05])), share, steps)


def _stays_bounded(record: EpisodeRecorder, solver: Solver, fraction: float, steps: int) -> None:
    """March at this fraction of the limit of the present state, and check that the energy stays within its bound."""
    dt = fraction * solver.current_limit()[0].dt_iso
    energies = record.march(solver, steps, dt, every=13)
    record.energy_bounded(energies, f"at {fraction:g} dt_iso: ", energy_bound(fraction))
    record.at_least("smallest J", energies.smallest_j, 0.5)
    record.at_most("speed of the centre [m/s]", energies.momentum / float(solver.parameters.mass.max()), 1e-10)
    record.holds("healthy", not flagged(solver, dt))


def lone_medium_particle(record: EpisodeRecorder, name: str) -> None:
    """One particle of a medium, compressed, for 10,000 steps of 0.98 dt_iso."""
    _stays_bounded(record, scenes.reset_solver(lone_medium(name)), NEAR, _LONG)


for _name in scenes.MEDIA:
    _summary = f"One particle of {_name}, compressed, for 10,000 steps of 0.98 dt_iso."
    case(f"lone-{_name}", args=(_name,), summary=_summary, is_fast=_name in ("sand", "water"))(lone_medium_particle)


def spray_scene() -> Scene:
    """500 particles: 250 alone, 125 pairs at random distances up to 1.4 cells, the groups out of each other's reach."""
    rng = np.random.default_rng(5)
    sites = 5.0 * np.indices((8, 8, 6)).reshape(3, -1).T[:375] + 3.0 + rng.uniform(-0.5, 0.5, (375, 3))
    apart = rng.normal(size=(125, 3))
    apart *= rng.uniform(0.2, 1.4, (125, 1)) / np.linalg.norm(apart, axis=1, keepdims=True)
    positions = scenes.SPACING * np.concatenate([sites, sites[250:] + apart])
    return scenes.flight(scenes.passive(positions), 1.35)


@case("spray")
def spray(record: EpisodeRecorder) -> None:
    """500 single and paired particles for 2000 steps: small strains at 0.9 dt_iso, some per cent at a half."""
    for fraction, strain in ((0.9, 1e-4), (0.5, 0.03)):
        solver = scenes.reset_solver(spray_scene())
        disorder = np.random.default_rng(6).normal(size=(solver.robot_count, 3, 3))
        solver.matter.load_slot(0, scenes.strained(solver, np.eye(3) + strain * disorder))
        dt = fraction * solver.current_limit()[0].dt_iso
        energies = record.march(solver, 2000, dt, every=5)
        record.energy_bounded(energies, f"strains of {strain:g} at {fraction:g} dt_iso: ", energy_bound(fraction))
        record.at_least("smallest J", energies.smallest_j, 0.5)
        record.holds("healthy", not flagged(solver, dt))


@case("control-beyond-limit")
def beyond_the_limit(record: EpisodeRecorder) -> None:
    """Negative control: at 1.05 dt_iso lone particles of rubber and clay blow up, and the health check flags them."""
    elastic = scenes.reset_solver(lone_elastic(), np.diag([1.001, 1.0, 1.0]))
    for name, solver in (("elastic", elastic), ("clay", scenes.reset_solver(lone_medium("clay")))):
        dt = BEYOND * solver.current_limit()[0].dt_iso
        found, steps = "", 0
        while not found and steps < 400:
            record.march(solver, 1, dt, every=1)
            found, steps = flagged(solver, dt), steps + 1
        record.holds(f"{name} flagged ({found or 'nothing'}) after {steps} steps", bool(found))


@case("control-unsafe-step")
def unsafe_step(record: EpisodeRecorder) -> None:
    """Negative control: a fixed step above 0.9 dt_iso is refused with the limit and the matter that sets it."""
    for name in (None, *scenes.MEDIA):
        scene = lone_elastic() if name is None else lone_medium(name)
        limit = Solver(scene, scenes.fidelity(), frame_seconds=1.0).limit.dt_iso
        for share in (0.92, BEYOND):
            step = share * limit

            def build(scene: Scene = scene, step: float = step) -> None:
                Solver(scene, scenes.fidelity(step=step), frame_seconds=step)

            words = f"The {name or 'robot'} sets the limit: dt_iso = {limit:.3g} s"
            record.refuses(f"{name or 'elastic'} at {share:.2f} dt_iso", words, build)
        safe = Solver(scene, scenes.fidelity(step=0.88 * limit), frame_seconds=0.88 * limit)
        record.at_most(f"{name or 'elastic'} at 0.88 dt_iso taken: step / dt_iso", safe.limit.fraction, 0.9)
