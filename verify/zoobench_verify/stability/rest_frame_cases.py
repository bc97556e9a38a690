"""Robots in their rest frame: animals on firm ground with their muscles at their limits, and limbs that meet."""

from dataclasses import replace

import numpy as np

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.solver import Solver
from zoobench.spec import Ref
from zoobench_verify.stability import stability_scenes as scenes
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case
from zoobench_verify.stability.swimmer_cases import check_thrown_about, square_waves

_PATTERNS = 4
"""Worlds, each with signs of its own."""
_FRAMES = 100
_EDGE = 6
"""Of the cubes that meet [particles]."""
_LONG = 3
"""Cubes of a spike with which they pass by each other at 2 m/s."""


@case("square-waves-in-rest-frame", is_fast=False)
def square_waves_in_rest_frame(record: EpisodeRecorder) -> None:
    """Four animals on the ground, all of whose muscles pull and push at random with full strength, on two grids."""
    env: Environment = registry.create(Kind.ENV, Ref("ground"))
    for name in ("caterpillar", "baby-seal", "panda", "fish"):
        for level in ("smoke", "draft"):
            fidelity = registry.create(Kind.FIDELITY, Ref.parse(f"{level}[robot=lagrangian]"))
            body: Body = registry.create(Kind.DESIGN, Ref(name)).body(fidelity)
            scene = env.scene(body, fidelity)
            solver = Solver(scene, fidelity, worlds=_PATTERNS, gradients=level == "draft")
            waves = [square_waves(body, pattern, -(-_FRAMES // 8))[:_FRAMES] for pattern in range(_PATTERNS)]
            rollout = solver.run(np.concatenate(waves, axis=1))
            record.at_most(f"{name}, {level}: frames repeated with half the step", float(rollout.retries.sum()), 0)
            check_thrown_about(record, solver, rollout, f"{name}, {level}: ")


@case("limbs-that-meet", is_fast=False)
def limbs_that_meet(record: EpisodeRecorder) -> None:
    """Two cubes of one body without damping fly against each other, flat or with spikes, and come apart again.

    Particles of one face the gaps of the other, as both pass by. Contact alone can give back what the approach had.
    """
    fidelity = replace(scenes.fidelity(32), robot="lagrangian")
    edge = fidelity.particle_edge
    for spike in (0, 1, _LONG):
        cube = np.stack(np.meshgrid(*[np.arange(_EDGE)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        cube = np.concatenate([cube, [[_EDGE + k, 2, 2] for k in range(spike)]] if spike else [cube])
        mirrored = cube * [-1, 1, 1] + [2 * (_EDGE + spike) + 3, 0, 0]
        places = (np.concatenate([cube, mirrored]) + 0.5) * edge + 1.0
        right = np.arange(len(places)) >= len(cube)
        for approach in (0.5, 1.0, 2.0) if spike < _LONG else (0.5, 1.0):
            body = scenes.passive(places, scenes.MUSCLE)
            speeds = np.zeros(places.shape)
            speeds[:, 0], speeds[right, 1] = np.where(right, -approach / 2, approach / 2), 0.3 * approach
            solver = Solver(scenes.flight(replace(body, velocities=speeds), 3.0), fidelity)
            rollout = solver.run(np.zeros((round(40 * edge / approach / solver.frame_seconds), 1, 0)))
            x, v = (each[:, 0, :, 0] for each in (rollout.positions, rollout.velocities))
            apart = (x[:, right].mean(axis=1) - x[:, ~right].mean(axis=1)) / (_EDGE * edge)
            parting = v[-1, right].mean() - v[-1, ~right].mean()
            which = f"spikes of {spike} cubes, {approach:g} m/s: "
            record.add_rollout(solver, rollout)
            record.robot_volume(rollout, 0.05, which)
            record.at_least(f"{which}least distance of the middles / edge", float(apart.min()), 0.5)
            record.within(f"{which}speed of parting / approach", float(parting) / approach, 0.1, 1.05)
