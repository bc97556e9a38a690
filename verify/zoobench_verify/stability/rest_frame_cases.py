"""Animals in their rest frame on firm ground, with their muscles at their limits."""

import numpy as np

from zoobench import registry
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.registry import Kind
from zoobench.sim.solver import Solver
from zoobench.spec import Ref
from zoobench_verify.stability.episode_recorder import EpisodeRecorder, case
from zoobench_verify.stability.swimmer_cases import check_thrown_about, square_waves

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
            record.at_most(f"{name}, {level}: frames repeated with half the step", float(rollout.retries.sum()), 0)
            check_thrown_about(record, solver, rollout, f"{name}, {level}: ")
