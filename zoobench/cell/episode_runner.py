"""Episodes of robots in one scene: simulated side by side, metered, and read by the task."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from zoobench.arrays import Array
from zoobench.cell.closed_loop import FeedbackLoops
from zoobench.cell.episode import Episode, Evaluation, Record, evaluation_of
from zoobench.cell.meter import BudgetMeter
from zoobench.cell.motion import MotionAdjoint, motion_of
from zoobench.cell.object_rest import object_fault
from zoobench.cell.robot import Built, Robot
from zoobench.cell.scene_fault import thrown_fault
from zoobench.cell.solvers import Solvers
from zoobench.cell.wall_gap import gaps_of, reading, told
from zoobench.designs.base import Body
from zoobench.envs.base import Environment, Stance
from zoobench.errors import Displaced, Divergence, Failure, UsageError
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import FRAME_SECONDS
from zoobench.tasks.base import Metric, Motion, Task

if TYPE_CHECKING:
    from zoobench.sim.model.state import IntArray
    from zoobench.sim.solver import Rollout, Solver, SubstepMeter

Watch = Callable[[Array, Array | None], None]
"""A function called with the state of the first world: positions of all particles, the robot's first
`[particle_count, 3]` [m], and the velocity of water on a grid, see `Solver.flow`."""


class EpisodeRunner:
    """The scene of a body in its environment, and the episodes that are simulated in it.

    Args:
        env, task, robot, fidelity, meter: of the problem.
        body: at rest.
        frames: length of an episode.
        is_fixed: whether all robots have this body; the scene is then equilibrated once, and its state is kept. Else
            each episode begins with its own equilibration, which the meter counts apart.

    Raises:
        SceneError: the body does not fit into the arena.
        UsageError: an object begins with a velocity, and the body is not fixed.
    """

    def __init__(
        self,
        env: Environment,
        task: Task,
        robot: Robot,
        fidelity: Fidelity,
        meter: BudgetMeter,
        *,
        body: Body,
        frames: int,
        is_fixed: bool,
    ) -> None:
        if fault := thrown_fault(env, is_fixed=is_fixed):
            raise UsageError(fault)
        self.body, self.density = body, env.robot.density
        self.scene = env.scene(body, fidelity, frames * FRAME_SECONDS)
        self._grid_spacing = fidelity.grid_spacing
        self._rest_frames = 0 if is_fixed else env.equilibration_frames
        self.solvers = Solvers(self.scene, fidelity, env.equilibration_frames if is_fixed else 0)
        self._swims = env.stance is Stance.SWIMMING
        self._task, self._robot, self._meter, self._frames = task, robot, meter, frames

    def run(self, built: Sequence[Built], *, gradient: bool = False, watch: Watch | None = None) -> Iterator[Episode]:
        """Simulate an episode of each of these robots side by side.

        `watch` is called at the start and after every frame.
        """
        from zoobench.sim.rest import come_to_rest
        from zoobench.sim.solver import BodyState

        solver = self.solvers.get(len(built), gradient)
        before = replace(solver.meter)
        relaxed = bool(built[0].matter)
        if self._rest_frames and not relaxed:
            come_to_rest(solver, self._rest_frames)
        matter = {
            name: np.concatenate([one.matter[name].detach().numpy() for one in built]) for name in built[0].matter
        }
        activity = np.concatenate([one.activity.detach().numpy() for one in built], axis=1)
        loops = FeedbackLoops.of(self._robot, built, self._task, self._frames, self.scene.objects)
        whole = solver.run(
            activity,
            BodyState(**matter),
            progress=watch and _on_frame(solver, watch),
            feedback=loops.act if loops else None,
            equilibration=self._rest_frames if relaxed else 0,
        )
        rollout, broken = whole.episode, self._failures(whole)
        motions = [
            motion_of(rollout, self.body, self.scene, slice(world, world + 1), gradient=gradient, swims=self._swims)
            for world in range(len(built))
        ]
        gradients = np.full((len(built), self._robot.parameter_count), math.nan)
        if gradient:
            adjoints = self._adjoints(solver, whole, motions, loops, relaxed)
            for world, one in enumerate(built):
                if world not in broken:
                    gradients[world] = one.gradient({name: adjoint[world] for name, adjoint in adjoints.items()})
                    gradients[world] += loops.gradients[world] if loops else 0.0
        self._charge(solver.meter, before, whole)
        for world, motion in enumerate(motions):
            activity, offsets = rollout.actuation[:, world].astype(np.float64), rollout.offsets[:, world]
            gaps = gaps_of(motion, self.scene, offsets, self._grid_spacing)
            record = Record(motion, activity, self.body, self.scene, offsets, gaps)
            evaluation = self._read(motion, gaps, built[world].metrics, broken.get(world))
            yield Episode(evaluation, gradients[world], record)

    def _charge(self, now: "SubstepMeter", before: "SubstepMeter", whole: "Rollout") -> None:
        for item in fields(now):
            spent = getattr(now, item.name) - getattr(before, item.name)
            setattr(self._meter, item.name, getattr(self._meter, item.name) + spent)
        self._meter.retries += int(whole.retries.sum())
        taken = enumerate(whole.episode.counts.sum(axis=0).tolist())
        complete = [substeps for world, substeps in taken if world not in whole.divergences]
        self._meter.costliest = max(self._meter.costliest, *complete, 0)

    def _adjoints(
        self, solver: "Solver", whole: "Rollout", motions: Sequence[Motion], loops: FeedbackLoops | None, relaxed: bool
    ) -> dict[str, Array]:
        """Adjoints of the activity and, if it is relaxed, of the body's arrays by name, `[worlds, ...]` each."""
        direct = MotionAdjoint.joined(
            [MotionAdjoint.of(-self._task.objective(motion).sum(), motion) for motion in motions]
        )
        feedback = loops.adjoint(whole.episode) if loops else None
        gradient = solver.backward(whole, direct.positions, direct.velocities, feedback, direct.muscle_work)
        by_body = direct.by_arrays(gradient, whole, self.body, self.density) if relaxed else {}
        return {"activity": gradient.actuation.swapaxes(0, 1), **by_body}

    def _failures(self, whole: "Rollout") -> dict[int, Failure]:
        """Failures by world: where an object fell before the episode, nothing that follows counts."""
        found: dict[int, Failure] = {**_divergences(whole)}
        for world in range(whole.positions.shape[1]) if self.scene.objects and self._rest_frames else ():
            if fault := object_fault(self.scene, whole.episode.positions[0, world]):
                found[world] = Displaced(fault)
        return found

    def _read(self, motion: Motion, gaps: Array, metrics: Mapping[str, Metric], failure: Failure | None) -> Evaluation:
        """Score, reward and metrics of a motion with these gaps from the sides of the arena, and also `metrics`.

        A robot that failed near a side of the arena has met that side, and is not called torn.
        """
        if failure is None:
            return evaluation_of(self._task, motion, {**metrics, **reading(gaps)})
        if isinstance(failure, Divergence):
            failure = told(failure, float(gaps[: failure.frame + 2].min()), self.scene)
        return Evaluation(-math.inf, {}, np.zeros(0), failure)


def _divergences(whole: "Rollout") -> dict[int, Divergence]:
    """Divergences and tears by world, counted from the start of the episode.

    A torn robot has no score: otherwise it could win by throwing off a piece.
    """
    found, rest = {**whole.tears, **whole.divergences}, whole.equilibration
    before: IntArray = whole.counts[:rest].sum(axis=0)
    for world, failure in found.items() if rest else ():
        advice = failure.advice if failure.frame >= rest else f"It came apart before it was at rest. {failure.advice}"
        frame, step = max(failure.frame - rest, 0), max(failure.step - int(before[world]), 0)
        found[world] = replace(failure, frame=frame, step=step, advice=advice)
    return found


def _on_frame(solver: "Solver", watch: Watch) -> Callable[[int], None]:
    """A callback for the solver that calls `watch`."""

    def show(_: int) -> None:
        watch(solver.positions(0), solver.flow(0))

    return show
