"""What a step of a Gymnasium environment costs beyond the simulation: `python benchmarks/environment_step.py`.

Episodes of the environment and of the bare solver take turns, with the same muscle activity; CPU seconds of the process
are compared by their medians. Prints a row for each cell and number of worlds.
"""

import argparse
import time
from collections.abc import Callable
from statistics import median

import numpy as np

from zoobench.gym.channels import Action
from zoobench.gym.vector import ZooVectorEnv
from zoobench.gym.worlds import problem_of

FRAMES = 50
CELLS = (("ground", "turning"), ("ground", "waypoint-following"), ("desert", "movement-speed"))


def main() -> None:
    """Measure all cells."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fidelity", default="draft")
    parser.add_argument("--action", default="waves")
    parser.add_argument("--repetitions", type=int, default=9)
    given = parser.parse_args()
    print(f"{'cell':30} {'worlds':>6} {'bare [ms/frame]':>16} {'step [ms/frame]':>16} {'overhead':>9}")
    for env, task in CELLS:
        for worlds in (1, 8):
            bare, stepped = _measured(env, task, worlds, given.fidelity, given.action, given.repetitions)
            numbers = f"{1e3 * bare / FRAMES:16.2f} {1e3 * stepped / FRAMES:16.2f} {stepped / bare - 1:9.1%}"
            print(f"{env + ' ' + task:30} {worlds:6} {numbers}", flush=True)


def _measured(env: str, task: str, worlds: int, fidelity: str, action: Action, repetitions: int) -> tuple[float, float]:
    """Median CPU seconds of an episode: of the bare solver, and of the environment."""
    envs = ZooVectorEnv(env, "caterpillar", task, num_envs=worlds, action=action, fidelity=fidelity, frames=FRAMES)
    solver = problem_of(env, "caterpillar", task, fidelity, FRAMES, worlds).solvers.get(worlds, gradient=False)
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, envs.action_space.shape).astype(np.float32)
    envs.reset()
    activity = []
    for _ in range(FRAMES):
        activity.append(envs.worlds.channels.activity(actions, envs.worlds.session.times))
        envs.step(actions)
    played = np.array(activity)

    def bare() -> None:
        solver.run(played)

    def stepped() -> None:
        envs.reset()
        for _ in range(FRAMES):
            envs.step(actions)

    pairs = [(_seconds(bare), _seconds(stepped)) for _ in range(repetitions + 1)][1:]
    return median(pair[0] for pair in pairs), median(pair[1] for pair in pairs)


def _seconds(work: Callable[[], None]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin


if __name__ == "__main__":
    main()
