"""What a step of a Gymnasium environment costs beyond the simulation: `python benchmarks/environment_step.py`.

Episodes of the environment and of the bare solver take turns: the same robot, frames and muscle activity. Bare is
`Solver.run`, which is given the activity of all frames and returns the robot's trajectory: substeps, checks, choice of
the step, records. A step of the environment is an action in, an observation, a reward and at the end the score out;
`reset` is counted, too. CPU seconds of the process are compared by their medians, and by the least of each, which other
processes disturb less. Prints a row for each cell, fidelity and number of worlds.
"""

import argparse
import time
from collections.abc import Callable
from statistics import median

import numpy as np

from zoobench.gym.channels import Action
from zoobench.gym.vector import ZooVectorEnv
from zoobench.gym.worlds import problem_of

FRAMES = 200
CELLS = (
    ("ground", "movement-speed"), ("ground", "turning"), ("ground", "velocity-tracking"),
    ("ground", "waypoint-following"), ("desert", "turning"), ("ocean[water=grid]", "turning"),
)  # fmt: skip


def main() -> None:
    """Measure all cells."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fidelity", default="draft,standard")
    parser.add_argument("--worlds", default="1")
    parser.add_argument("--action", default="waves")
    parser.add_argument("--repetitions", type=int, default=5)
    given = parser.parse_args()
    print(f"{'cell':40} {'worlds':>6} {'bare [ms/frame]':>16} {'step [ms/frame]':>16} {'overhead':>9} {'by least':>9}")
    for fidelity in given.fidelity.split(","):
        for worlds in map(int, given.worlds.split(",")):
            for env, task in CELLS:
                pairs = _measured(env, task, worlds, fidelity, given.action, given.repetitions)
                (bare, stepped), (least, least_stepped) = (
                    [choice(side) / FRAMES for side in zip(*pairs, strict=True)] for choice in (median, min)
                )
                shares = f"{stepped / bare - 1:9.1%} {least_stepped / least - 1:9.1%}"
                print(
                    f"{f'{env} {task} {fidelity}':40} {worlds:6} {1e3 * bare:16.2f} {1e3 * stepped:16.2f} {shares}",
                    flush=True,
                )


def _measured(
    env: str, task: str, worlds: int, fidelity: str, action: Action, repetitions: int
) -> list[tuple[float, float]]:
    """CPU seconds of episodes: of the bare solver, and of the environment."""
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

    return [(_seconds(bare), _seconds(stepped)) for _ in range(repetitions + 1)][1:]


def _seconds(work: Callable[[], None]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin


if __name__ == "__main__":
    main()
