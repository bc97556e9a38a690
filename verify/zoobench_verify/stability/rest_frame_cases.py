"""Animals in their rest frame on firm ground, with their muscles at their limits."""

import numpy as np

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.solver import Solver
from zoobench.spec import Ref
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case
from zoobench_verify.stability.swimmer_cases import FASTEST, SLOWEST, square_waves

_PATTERNS = 4
"""Worlds, each with signs of its own."""
_FRAMES = 100


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
            record.add_rollout(solver, rollout)
            record.robot_volume(rollout, 0.1, f"{name}, {level}: ")
            record.at_most(f"{name}, {level}: frames repeated with half the step", float(rollout.retries.sum()), 0)
            fastest = float(np.abs(rollout.velocities).max())
            record.within(f"{name}, {level}: largest speed", fastest, SLOWEST, FASTEST, "m/s")
            if level == "draft":
                adjoint = np.ones(rollout.positions.shape)
                gradient = solver.backward(rollout, adjoint, np.zeros_like(adjoint))
                record.gradient_finite(gradient, [gradient.actuation], f"{name}: ")
