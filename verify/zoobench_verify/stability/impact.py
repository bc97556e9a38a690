"""Impacts: on the ground, between bodies, and faster than the declared step allows."""

from dataclasses import replace

import numpy as np

from zoobench.sim.model.scene import Scene
from zoobench.sim.model.step_limits import choose_step
from zoobench.sim.solver import Solver
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case

_FRAME = 0.002
"""Control frame of the impacts [s]: short compared with an impact."""


def wave_speed() -> float:
    """Speed of a pressure wave in rubber, sqrt((lambda + 2 mu) / rho) [m/s]."""
    mu, lam = scenes.RUBBER.lame
    return float(np.sqrt((lam + 2.0 * mu) / scenes.RUBBER.density))


def _falling(cells_per_step: float) -> tuple[Scene, float]:
    """A cube just above the ground that falls so many cells in a declared step, and that step [s]."""
    body = scenes.passive(scenes.cube((0.3125, 0.0625, 0.3125)))
    step = choose_step(scenes.drop(body), scenes.fidelity(), _FRAME).dt
    body = replace(body, velocities=body.velocities - [0.0, cells_per_step * scenes.SPACING / step, 0.0])
    return scenes.drop(body, (0.75, 2.5, 0.75)), step


@case("fast-landing")
def fast_landing(record: EpisodeRecorder) -> None:
    """A cube hits the ground at 0.45 cells per declared step, above its wave speed, and bounces."""
    scene, _ = _falling(0.45)
    record.remark(f"speed / wave speed {float(-scene.robot.velocities[0, 1]) / wave_speed():.2f}")
    rollout, energies = record.episode(Solver(scene, scenes.fidelity(), frame_seconds=_FRAME), 40)
    record.stays_above(energies, scenes.SPACING)
    record.energy_bounded(energies)
    record.robot_volume(rollout, 0.05)
    record.at_least("speed at the end, upwards [m/s]", rollout.velocities[-1, 0, :, 1].mean(), 0.0)


@case("landing-beyond-speed-limit")
def landing_beyond_the_speed_limit(record: EpisodeRecorder) -> None:
    """A cube that covers 0.9 or 3 cells in a declared step: shorter steps are taken, or the episode diverges."""
    for cells in (0.9, 3.0):
        scene, step = _falling(cells)
        solver = Solver(scene, scenes.fidelity(), frame_seconds=_FRAME)
        rollout, energies = record.episode(solver, 20, may_diverge=True)
        taken = _FRAME / float(rollout.counts.max())
        record.at_most(f"{cells:g}: step taken / declared", taken / step, 0.8 * 0.5 / cells * 1.01)
        record.path_finite(rollout, f"{cells:g}: ")
        record.at_least(f"{cells:g}: lowest [cells]", float(rollout.positions[..., 1].min()) / scenes.SPACING, -1.0)
        if rollout.divergences:
            record.remark(f"{cells:g}: ends with {rollout.divergences[0].quantity}")
        else:
            record.energy_bounded(energies, f"{cells:g}: ")
            record.robot_volume(rollout, 0.0, f"{cells:g}: ")


@case("control-too-fast")
def too_fast(record: EpisodeRecorder) -> None:
    """Negative control: a cube that covers 0.55 cells or more in a fixed step is flagged as too fast for it."""
    for cells in (0.55, 0.9, 3.0):
        scene, step = _falling(cells)
        solver = Solver(scene, scenes.fidelity(step=step), frame_seconds=step)
        rollout, _ = record.episode(solver, 1, may_diverge=True)
        quantities = [divergence.quantity for divergence in rollout.divergences.values()]
        record.holds(f"{cells:g} cells a step flagged ({', '.join(quantities)})", quantities == ["Courant number"])
        record.path_finite(rollout, f"{cells:g}: ")


@case("repeated-frames")
def repeated_frames(record: EpisodeRecorder) -> None:
    """Impacts on a wall in frames of 32 ms at the longest step allowed: frames are repeated, and the replay is exact.

    The step is chosen before the cube meets the wall, so the first attempt of some frames ends inverted or too fast.
    """
    retries = 0
    soft = replace(scenes.RUBBER, youngs_modulus=1e4)
    for speed in (6.5, 7.0, 7.5, 8.5):
        body = scenes.passive(scenes.cube((0.3125, 0.0625, 0.3125)), soft, np.array([0.0, -speed, 0.0]))
        scene = replace(scenes.drop(body, (0.75, 2.5, 0.75)), ground=None)
        solver = Solver(scene, scenes.fidelity(64, courant=0.9), frame_seconds=0.032)
        rollout, energies = record.episode(solver, 12)
        retries += int(rollout.retries.sum())
        record.energy_bounded(energies, f"{speed:g} m/s: ")
        record.robot_volume(rollout, 0.05, f"{speed:g} m/s: ")
        again = solver.run(rollout.actuation, replay=rollout)
        difference = float(np.abs(again.positions - rollout.positions).max())
        record.at_most(f"{speed:g} m/s: difference of the replay [m]", difference, 0.0)
    record.at_least("repeated frames", retries, 1)


@case("head-on-collision")
def head_on_collision(record: EpisodeRecorder) -> None:
    """Two cubes collide head-on with half the wave speed between them and separate again."""
    left = scenes.cube((0.25, 0.3125, 0.3125))
    right = scenes.cube((0.4375, 0.3125, 0.3125))
    speed = np.zeros((len(left) + len(right), 3))
    speed[: len(left), 0], speed[len(left) :, 0] = 0.25 * wave_speed(), -0.25 * wave_speed()
    body = scenes.passive(np.concatenate([left, right]), velocity=speed)
    scene = replace(scenes.flight(body), lower=(-0.5, 0.0, 0.0), upper=(1.25, 0.75, 0.75))
    solver = Solver(scene, scenes.fidelity(64), frame_seconds=_FRAME)
    rollout, energies = record.episode(solver, 60)
    scale = float(solver.parameters.mass.sum()) * 0.25 * wave_speed()
    record.at_most("momentum / that of one cube", energies.momentum / scale, 1e-6)
    record.robot_volume(rollout, 0.1)
    record.energy_bounded(energies)
    parting = rollout.velocities[-1, 0, len(left) :, 0].mean() - rollout.velocities[-1, 0, : len(left), 0].mean()
    record.at_least("speed of parting / of meeting", float(parting) / (0.5 * wave_speed()), 0.1)
