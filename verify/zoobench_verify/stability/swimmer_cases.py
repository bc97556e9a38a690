"""Swimmers in water by forces on their surface: muscles at their limits, bodies far lighter than water, and floods."""

from dataclasses import replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.muscle_places import muscle_places
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.model.potential_flow import added_volume, potentials
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.solver import Solver
from zoobench.spec import Ref
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case

_FASTEST = 30.0
"""Of any particle [m/s]: twenty times a swimmer's speed; a node that is flung is faster within a few frames."""
_SLOWEST = 0.1
"""Largest speed of a particle [m/s], at least: strong muscles throw a body about."""


def _swimmer(name: str, level: str) -> tuple[Solver, Body]:
    """An animal of this package in the ocean."""
    env: Environment = registry.create(Kind.ENV, Ref.parse("ocean"))
    fidelity = env.simulated(registry.create(Kind.FIDELITY, Ref(level)))
    body: Body = registry.create(Kind.DESIGN, Ref(name)).body(fidelity)
    return Solver(env.scene(body, fidelity), fidelity, gradients=level == "draft"), body


def square_waves(body: Body, pattern: int, times: int = 5) -> Array:
    """Either side of every segment pulls or pushes with full strength, anew at random every eight frames, so many times
    `[frames, 1, muscles]`."""
    places = muscle_places(body)
    _, group = np.unique([-np.round(places.back, 1), places.side > 0.0], axis=1, return_inverse=True)
    signs = np.sign(np.random.default_rng(pattern).normal(size=(times + 1, group.max() + 1)))[:times, group.ravel()]
    return signs.repeat(8, axis=0)[:, None]


def check_thrown_about(record: EpisodeRecorder, solver: Solver, rollout: Rollout, which: str) -> None:
    """Check that a body that strong muscles throw about keeps its volume, moves, and flings no node; and its gradient,
    if the solver has any."""
    record.add_rollout(solver, rollout)
    record.robot_volume(rollout, 0.1, which)
    record.within(f"{which}largest speed", float(np.abs(rollout.velocities).max()), _SLOWEST, _FASTEST, "m/s")
    if solver.gradients:
        adjoint = np.ones(rollout.positions.shape)
        gradient = solver.backward(rollout, adjoint, np.zeros_like(adjoint))
        record.gradient_finite(gradient, [gradient.actuation], which)


@case("square-waves-in-water", is_fast=False)
def square_waves_in_water(record: EpisodeRecorder) -> None:
    """Five animals, all of whose muscles pull and push at random with full strength, on two grids.

    Cells at a surface hold a particle or two: their nodes have hardly any mass, and water pushes on them.
    """
    for name in ("fish", "tuna", "shark", "clownfish", "orca"):
        for level in ("draft", "standard"):
            solver, body = _swimmer(name, level)
            rollout = solver.run(square_waves(body, 0))
            check_thrown_about(record, solver, rollout, f"{name}, {level}: ")


@case("light-swimmer")
def light_swimmer(record: EpisodeRecorder) -> None:
    """A fish a fiftieth as dense as water rises, and one five times as dense sinks, no faster than without drag.

    The added mass of the light one is fifty times its own: where it follows the body a step later, errors grow every
    step (added mass instability; Causin, Gerbeau and Nobile 2005).
    """
    for density in (20.0, 5000.0):
        fish, _ = _swimmer("fish", "draft")
        robot, water = fish.scene.robot, fish.scene.surface_water
        assert water is not None
        assert water.hull is not None
        hull = water.hull
        light = replace(robot, material=replace(robot.material, density=density))
        solver = Solver(replace(fish.scene, robot=light), fish.fidelity)
        rollout = solver.run(np.zeros((60, 1, solver.muscle_count)))
        record.add_rollout(solver, rollout)
        which = f"{density:g} kg/m^3: "
        record.robot_volume(rollout, 0.5, which)
        up = np.sign(1000.0 - density)
        speed = up * float(rollout.velocities[-1, 0, :, 1].mean())
        way = up * float((rollout.positions[-1, 0] - rollout.positions[0, 0])[:, 1].mean())
        volume = float(robot.volumes.sum())
        inertia = density * volume + 1000.0 * float(added_volume(hull.triangles, potentials(hull.triangles))[1, 1])
        fastest = np.sqrt(2.0 * abs(density - 1000.0) * volume * 9.81 * way / inertia)
        record.within(f"{which}speed by that without drag", speed / fastest, 0.2, 1.0)


@case("flood")
def flood(record: EpisodeRecorder) -> None:
    """A fish is let go in a current of 5 m/s: water takes the energy of its motion relative to the current.

    From one frame to the next this may rise a little, as bent matter and water that moves along give some back. The
    fish may go faster than the current: from one upwards it glides ahead, and turns up as it goes.
    """
    for axis, name in enumerate(("ahead", "up", "right")):
        fish, _ = _swimmer("fish", "draft")
        assert fish.scene.surface_water is not None
        current = 5.0 * np.eye(3)[axis]
        water = replace(fish.scene.surface_water, current=tuple(current.tolist()))
        solver = Solver(replace(fish.scene, surface_water=water), fish.fidelity)
        rollout = solver.run(np.zeros((60, 1, solver.muscle_count)))
        record.add_rollout(solver, rollout)
        record.robot_volume(rollout, 0.1, f"{name}: ")
        through = ((rollout.velocities[:, 0] - current) ** 2).sum(axis=2) @ fish.scene.robot.masses
        through /= through[0]
        record.within(f"{name}: energy of its motion through the water at the end, by that at first",
                      float(through[-1]), 1e-4, 0.1)  # fmt: skip
        record.at_most(f"{name}: largest gain of it in a frame", float(np.diff(through).max()), 0.01)
