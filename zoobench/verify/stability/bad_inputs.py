"""Input that makes no sense, or hardly any: each has a clear error or a defined behaviour."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.matter import SandMaterial
from zoobench.sim.model.scene import Ground, MediumBed, Scene
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import GROWTH, episode, healthy
from zoobench.verify.stability.muscles import cube


@case("bad-matter")
def bad_matter(probe: Probe) -> None:
    """Scenes without matter, without mass, or with values that are not finite are refused before they run."""
    body = scenes.passive(scenes.lattice((0.3125, 0.3125, 0.3125), (2, 2, 2)))
    count = body.particle_count
    nothing = np.zeros((0, 3))
    bad = {
        "no particles": (lambda: scenes.flight(scenes.passive(nothing)), "empty"),
        "no occupancy": (lambda: scenes.flight(replace(body, occupancy=np.zeros(count))), "empty"),
        "zero density ratio": (lambda: scenes.flight(replace(body, density_ratio=np.zeros(count))), "positive"),
        "zero volume": (lambda: scenes.flight(replace(body, volumes=np.zeros(count))), "positive"),
        "zero stiffness": (lambda: scenes.flight(replace(body, stiffness=np.zeros(count))), "positive"),
        "zero density": (
            lambda: scenes.flight(replace(body, material=replace(body.material, density=0.0))),
            "Give a positive number",
        ),
        "nu = 0.5": (
            lambda: scenes.flight(replace(body, material=replace(body.material, poissons_ratio=0.5))),
            "not between -1 and 0.5",
        ),
        "NaN position": (lambda: scenes.flight(replace(body, positions=body.positions * np.nan)), "not finite"),
        "NaN velocity": (lambda: scenes.flight(replace(body, velocities=body.velocities + np.inf)), "not finite"),
        "empty medium": (lambda: _with_medium(nothing), "Leave it out"),
        "fluid sand": (lambda: _with_sand_of(90.0), "not between 0 and 90"),
        "NaN gravity": (lambda: replace(scenes.flight(body), gravity=(0.0, np.nan, 0.0)), "not finite"),
        "negative friction": (lambda: replace(scenes.drop(body), ground=Ground(-0.1)), "negative"),
    }
    for name, (build, words) in bad.items():
        probe.refuses(name, words, build)


def _with_medium(positions: np.ndarray) -> Scene:
    bed = scenes.bed_of(scenes.medium_material("clay"), positions)
    return replace(scenes.flight(scenes.bystander((0.3, 0.3, 0.3))), medium=bed)


def _with_sand_of(angle: float) -> Scene:
    sand = SandMaterial(youngs_modulus=1e5, poissons_ratio=0.2, density=1600.0, friction_angle=angle)
    bed = MediumBed.at_rest(sand, np.array([[0.3, 0.3, 0.3]]), np.array([1e-6]))
    return replace(scenes.flight(scenes.bystander((0.5, 0.5, 0.5))), medium=bed)


@case("bad-actuation")
def bad_actuation(probe: Probe) -> None:
    """Actuation that is not finite, beyond its limit or of the wrong shape is refused, and so is a bad body."""
    from zoobench.sim.model.state import BodyState
    from zoobench.sim.solver import Solver

    solver = Solver(scenes.flight(cube(3e3), 3.0), scenes.fidelity())
    still = np.zeros((4, 1, 1))
    words = "outside [-1, 1] or not finite"
    probe.refuses("NaN", words, lambda: solver.run(still + np.nan))
    probe.refuses("infinity", words, lambda: solver.run(still + np.inf))
    probe.refuses("activation of 1.001", words, lambda: solver.run(still + 1.001))
    probe.refuses("two muscles for one", "was expected", lambda: solver.run(np.zeros((4, 1, 2))))
    probe.refuses("no frame", "was expected", lambda: solver.run(np.zeros((0, 1, 1))))
    stiff = BodyState(stiffness=np.full((1, solver.robot_count), 2.0))
    probe.refuses(
        "stiffness beyond what was declared", "declared when the solver was made", lambda: solver.run(still, stiff)
    )
    ghost = BodyState(occupancy=np.zeros((1, solver.robot_count)))
    probe.refuses("a body without occupancy", "empty", lambda: solver.run(still, ghost))


@case("one-particle")
def one_particle(probe: Probe) -> None:
    """A robot of one particle falls on the ground and stays there; with ghosts around it, the ghosts change nothing."""
    from zoobench.sim.solver import Solver

    place = np.array([[0.35, 0.05, 0.37]])
    paths = []
    for ghosts in (0, 50):
        around = np.random.default_rng(11).uniform(0.3, 0.45, (ghosts, 3)) * [1.0, 0.3, 1.0]
        body = scenes.passive(np.concatenate([place, around]))
        body = replace(body, occupancy=np.r_[1.0, np.zeros(ghosts)])
        rollout, ledger = episode(probe, Solver(scenes.drop(body), scenes.fidelity(64)), 40)
        healthy(probe, rollout)
        probe.below(f"{ghosts} ghosts: energy / initial", ledger.growth, GROWTH)
        probe.above(
            f"{ghosts} ghosts: lowest [cells]", float(rollout.positions[:, 0, 0, 1].min()) / scenes.SPACING, -1.0
        )
        paths.append(rollout.positions[:, 0, 0])
    probe.below("difference that ghosts make [m]", float(np.abs(paths[1] - paths[0]).max()), 1e-12)


@case("ice-and-glue")
def ice_and_glue(probe: Probe) -> None:
    """A working caterpillar gets no thrust from frictionless ground, nor more than friction times load from any."""
    from zoobench import registry
    from zoobench.registry import Kind
    from zoobench.sim.solver import Solver
    from zoobench.spec import Ref

    grid = scenes.fidelity(64)
    body = registry.create(Kind.DESIGN, Ref("caterpillar")).body(grid)
    for friction in (0.0, 0.05, 10.0):
        scene = registry.create(Kind.ENV, Ref("ground")).scene(body, grid)
        scene = replace(scene, ground=Ground(friction))
        solver = Solver(scene, grid)
        times = 0.008 * np.arange(75)[:, None, None]
        phases = np.linspace(0.0, 2.0 * np.pi, solver.muscle_count, endpoint=False)
        rollout, ledger = episode(probe, solver, 0.8 * np.sin(2.0 * np.pi * 1.5 * times + phases))
        healthy(probe, rollout)
        mass = float(solver.parameters.mass.sum())
        sideways = ledger.largest(lambda entry: float(np.hypot(entry.momentum[0], entry.momentum[2]))) / mass
        if friction == 0.0:
            probe.below("frictionless: speed along the ground [m/s]", sideways, 1e-9)
            continue
        weight = mass * 9.81
        momenta = np.array([entry.momentum for entry in ledger.entries])
        push = np.linalg.norm(np.diff(momenta[:, [0, 2]], axis=0), axis=1).sum() / solver.frame_seconds
        carried = np.abs(np.diff(momenta[:, 1]) / solver.frame_seconds + weight).sum()
        probe.below(f"friction {friction:g}: push along the ground / friction x load", push / (friction * carried), 1.0)
        probe.remark(f"friction {friction:g}: speed along the ground up to {sideways:.3g} m/s")
