"""Impacts: on the floor, on each other, and faster than any step can follow."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.matter import lame_parameters
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.step_limits import choose_step
from zoobench.verify.stability import scenes
from zoobench.verify.stability.base import Probe, case
from zoobench.verify.stability.ledger import GROWTH, episode, healthy

_FRAME = 0.002
"""Control frame of the impacts [s]: short, so that what happens within one is seen."""


def wave_speed() -> float:
    """Speed of a pressure wave in rubber, sqrt((lambda + 2 mu) / rho) [m/s]."""
    mu, lam = lame_parameters(scenes.RUBBER.youngs_modulus, scenes.RUBBER.poissons_ratio)
    return float(np.sqrt((lam + 2.0 * mu) / scenes.RUBBER.density))


def _falling(cells_per_step: float) -> tuple[Scene, float]:
    """A cube just above the ground whose speed is so many cells per declared step, and that step [s]."""
    body = scenes.passive(scenes.lattice((0.3125, 0.0625, 0.3125), (4, 4, 4)))
    step = choose_step(scenes.drop(body), scenes.fidelity(), _FRAME).dt
    body = replace(body, velocities=body.velocities - [0.0, cells_per_step * scenes.SPACING / step, 0.0])
    return scenes.drop(body, (0.75, 2.5, 0.75)), step


@case("fast-landing")
def fast_landing(probe: Probe) -> None:
    """A cube hits the ground at 0.45 cells per declared step, faster than sound: it bounces and does not sink in."""
    from zoobench.sim.solver import Solver

    scene, _ = _falling(0.45)
    probe.remark(f"speed / wave speed {float(-scene.robot.velocities[0, 1]) / wave_speed():.2f}")
    rollout, ledger = episode(probe, Solver(scene, scenes.fidelity(), frame_seconds=_FRAME), 40)
    healthy(probe, rollout)
    probe.above("lowest [cells]", ledger.smallest(lambda entry: entry.lowest[1]) / scenes.SPACING, -1.0)
    probe.below("energy / initial", ledger.growth, GROWTH)
    probe.above("smallest J", float(rollout.smallest_j.min()), 0.05)
    probe.above("speed at the end, upwards [m/s]", float(rollout.velocities[-1, 0, :, 1].mean()), 0.0)


@case("landing-beyond-speed-limit")
def landing_beyond_the_speed_limit(probe: Probe) -> None:
    """A cube that covers 0.9 or 3 cells in a declared step: shorter steps carry it, or a clear error ends it."""
    from zoobench.sim.solver import Solver

    for cells in (0.9, 3.0):
        scene, step = _falling(cells)
        rollout, ledger = episode(probe, Solver(scene, scenes.fidelity(), frame_seconds=_FRAME), 20)
        taken = _FRAME / float(rollout.counts.max())
        probe.below(f"{cells:g}: step taken / declared", taken / step, 0.8 * 0.5 / cells * 1.01)
        probe.holds(f"{cells:g}: path finite", bool(np.isfinite(rollout.positions).all()))
        probe.above(f"{cells:g}: lowest [cells]", float(rollout.positions[..., 1].min()) / scenes.SPACING, -1.0)
        if rollout.divergences:
            probe.remark(f"{cells:g}: ends with {rollout.divergences[0].quantity}")
        else:
            probe.below(f"{cells:g}: energy / initial", ledger.growth, GROWTH)
            probe.above(f"{cells:g}: smallest J", float(rollout.smallest_j.min()), 0.0)


@case("control-too-fast")
def too_fast(probe: Probe) -> None:
    """Negative control: the same with the declared step held fixed is flagged as too fast for the step."""
    from zoobench.sim.solver import Solver

    for cells in (0.55, 0.9, 3.0):
        scene, step = _falling(cells)
        solver = Solver(scene, scenes.fidelity(step=step), frame_seconds=step)
        rollout, _ = episode(probe, solver, 1)
        quantities = [divergence.quantity for divergence in rollout.divergences.values()]
        probe.holds(f"{cells:g} cells a step flagged ({', '.join(quantities)})", quantities == ["Courant number"])
        probe.holds(f"{cells:g}: path finite", bool(np.isfinite(rollout.positions).all()))


@case("repeated-frames")
def repeated_frames(probe: Probe) -> None:
    """Impacts within frames of 8 ms at the longest step allowed: frames are put back, repeated, and replayed exactly.

    The step is chosen before the cube has met the ground, so some frames end inverted or too fast at first.
    """
    from zoobench.sim.solver import Solver

    retries = 0
    for speed in (12.0, 14.0, 16.0, 18.0):
        body = scenes.passive(
            scenes.lattice((0.3125, 0.0625, 0.3125), (4, 4, 4)), velocity=np.array([0.0, -speed, 0.0])
        )
        solver = Solver(scenes.drop(body, (0.75, 2.5, 0.75)), scenes.fidelity(64, courant=0.9))
        rollout, ledger = episode(probe, solver, 12)
        healthy(probe, rollout)
        retries += int(rollout.retries.sum())
        probe.below(f"{speed:g} m/s: energy / initial", ledger.growth, GROWTH)
        probe.above(f"{speed:g} m/s: smallest J", float(rollout.smallest_j.min()), 0.05)
        again = solver.run(rollout.actuation, schedule=rollout.counts)
        difference = float(np.abs(again.positions - rollout.positions).max())
        probe.below(f"{speed:g} m/s: difference of the replay [m]", difference, 0.0)
    probe.above("repeated frames", retries, 1)


@case("head-on-collision")
def head_on_collision(probe: Probe) -> None:
    """Two cubes meet head-on with half the wave speed between them and part again."""
    from zoobench.sim.solver import Solver

    left = scenes.lattice((0.25, 0.3125, 0.3125), (4, 4, 4))
    right = scenes.lattice((0.4375, 0.3125, 0.3125), (4, 4, 4))
    speed = np.zeros((len(left) + len(right), 3))
    speed[: len(left), 0], speed[len(left) :, 0] = 0.25 * wave_speed(), -0.25 * wave_speed()
    body = scenes.passive(np.concatenate([left, right]), velocity=speed)
    scene = replace(scenes.flight(body), lower=(-0.5, 0.0, 0.0), upper=(1.25, 0.75, 0.75))
    solver = Solver(scene, scenes.fidelity(64), frame_seconds=_FRAME)
    rollout, ledger = episode(probe, solver, 60)
    healthy(probe, rollout)
    scale = float(solver.parameters.mass.sum()) * 0.25 * wave_speed()
    drift = ledger.largest(lambda entry: float(np.linalg.norm(entry.momentum))) / scale
    probe.below("momentum / that of one cube", drift, 1e-6)
    probe.above("smallest J", float(rollout.smallest_j.min()), 0.1)
    probe.below("energy / initial", ledger.growth, GROWTH)
    parting = rollout.velocities[-1, 0, len(left) :, 0].mean() - rollout.velocities[-1, 0, : len(left), 0].mean()
    probe.above("speed of parting / of meeting", float(parting) / (0.5 * wave_speed()), 0.1)
