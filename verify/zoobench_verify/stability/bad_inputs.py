"""Invalid and extreme input: a clear error or a defined behaviour."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from zoobench.arrays import Array
from zoobench.sim.model.laws.medium import Medium
from zoobench.sim.model.laws.sand import SandMaterial
from zoobench.sim.model.scene import Ground, Scene
from zoobench.sim.model.state import BodyState
from zoobench.sim.solver import Solver
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case
from zoobench_verify.stability.muscles import muscle_cube


@case("bad-matter")
def bad_matter(record: EpisodeRecorder) -> None:
    """Scenes without matter, without mass, or with values that are not finite are refused before they run."""
    body = scenes.passive(scenes.lattice(scenes.MIDDLE, (2, 2, 2)))
    nothing, zeros = np.zeros((0, 3)), np.zeros(body.particle_count)

    def _flight(**changes: Any) -> Scene:
        return scenes.flight(replace(body, **changes))

    bad = {
        "no particles": (lambda: scenes.flight(scenes.passive(nothing)), "empty"),
        "no occupancy": (lambda: _flight(occupancy=zeros), "empty"),
        "zero density ratio": (lambda: _flight(density_ratio=zeros), "positive"),
        "zero volume": (lambda: _flight(volumes=zeros), "positive"),
        "zero stiffness": (lambda: _flight(stiffness=zeros), "positive"),
        "zero density": (lambda: _flight(material=replace(body.material, density=0.0)), "Give a positive number"),
        "nu = 0.5": (lambda: _flight(material=replace(body.material, poissons_ratio=0.5)), "not between -1 and 0.5"),
        "NaN position": (lambda: _flight(positions=body.positions * np.nan), "not finite"),
        "NaN velocity": (lambda: _flight(velocities=body.velocities + np.inf), "not finite"),
        "empty medium": (lambda: _with_medium(scenes.medium_material("clay"), nothing), "Leave it out"),
        "fluid sand": (
            lambda: _with_medium(SandMaterial(1e5, 0.2, 1600.0, 90.0), np.array([[0.3] * 3])),
            "a number below 90",
        ),
        "NaN gravity": (lambda: replace(scenes.flight(body), gravity=(0.0, np.nan, 0.0)), "not finite"),
        "negative friction": (lambda: replace(scenes.drop(body), ground=Ground(-0.1)), "negative"),
    }
    for name, (build, words) in bad.items():
        record.refuses(name, words, build)


def _with_medium(material: Medium, positions: Array) -> Scene:
    return scenes.lone_bed(scenes.bed_of(material, positions))


@case("bad-actuation")
def bad_actuation(record: EpisodeRecorder) -> None:
    """Actuation that is not finite, beyond its limit or of the wrong shape is refused, and so is a bad body."""
    solver = Solver(scenes.flight(muscle_cube(3e3), 3.0), scenes.fidelity())
    still = np.zeros((4, 1, 1))
    for name, value in (("NaN", np.nan), ("infinity", np.inf), ("activation of 1.001", 1.001)):
        record.refuses(name, "outside [-1, 1] or not finite", partial(solver.run, still + value))
    record.refuses("two muscles for one", "was expected", lambda: solver.run(np.zeros((4, 1, 2))))
    record.refuses("no frame", "was expected", lambda: solver.run(np.zeros((0, 1, 1))))
    stiff = BodyState(stiffness=np.full((1, solver.robot_count), 2.0))
    words = "declared when the solver was made"
    record.refuses("stiffness above the declared bound", words, lambda: solver.run(still, stiff))
    ghost = BodyState(occupancy=np.zeros((1, solver.robot_count)))
    record.refuses("a body without occupancy", "empty", lambda: solver.run(still, ghost))


@case("one-particle")
def one_particle(record: EpisodeRecorder) -> None:
    """A robot of one particle falls on the ground and stays there; particles without occupancy have no effect on it."""
    position = np.array([[0.35, 0.05, 0.37]])
    paths = []
    for ghosts in (0, 50):
        around = np.random.default_rng(11).uniform(0.3, 0.45, (ghosts, 3)) * [1.0, 0.3, 1.0]
        body = scenes.passive(np.concatenate([position, around]))
        body = replace(body, occupancy=np.r_[1.0, np.zeros(ghosts)])
        rollout, energies = record.episode(Solver(scenes.drop(body), scenes.fidelity(64)), 40)
        record.energy_bounded(energies, f"{ghosts} ghosts: ")
        paths.append(rollout.positions[:, 0, 0])
        record.at_least(f"{ghosts} ghosts: lowest [cells]", float(paths[-1][:, 1].min()) / scenes.SPACING, -1.0)
    record.at_most("difference that ghosts make [m]", np.abs(paths[1] - paths[0]).max(), 1e-12)


@case("ice-and-glue")
def ice_and_glue(record: EpisodeRecorder) -> None:
    """A working caterpillar gets no thrust from frictionless ground, nor more than friction times load from any."""
    grid = scenes.fidelity(64)
    for friction in (0.0, 0.05, 10.0):
        solver = Solver(replace(scenes.caterpillar_scene(grid), ground=Ground(friction)), grid)
        _, energies = record.episode(solver, scenes.muscle_wave(solver, 75))
        mass = float(solver.parameters.mass.sum())
        sideways = energies.largest(lambda balance: float(np.hypot(balance.momentum[0], balance.momentum[2]))) / mass
        if friction == 0.0:
            record.at_most("frictionless: speed along the ground [m/s]", sideways, 1e-9)
            continue
        weight = mass * 9.81
        momenta = np.array([balance.momentum for balance in energies.balances])
        push = np.linalg.norm(np.diff(momenta[:, [0, 2]], axis=0), axis=1).sum() / solver.frame_seconds
        carried = np.abs(np.diff(momenta[:, 1]) / solver.frame_seconds + weight).sum()
        share = push / (friction * carried)
        record.at_most(f"friction {friction:g}: push along the ground / friction x load", share, 1.0)
        record.at_least(f"friction {friction:g}: largest speed along the ground [m/s]", sideways, 1e-3)
