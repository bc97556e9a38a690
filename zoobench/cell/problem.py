"""A cell of the benchmark as a problem for a method: every simulated substep is metered here."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.closed_loop import FeedbackLoops
from zoobench.cell.episode import Episode, Evaluation
from zoobench.cell.meter import BudgetMeter
from zoobench.cell.motion import MotionAdjoint, motion_of
from zoobench.cell.robot import Built, Robot
from zoobench.cell.solvers import Solvers
from zoobench.cell.targets import target_fault
from zoobench.cell.warm_start import overlay
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.errors import BudgetExhaustedError, Divergence, Unbuildable, UsageError
from zoobench.inputs import Start
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.step_limits import choose_step
from zoobench.spec import FRAME_SECONDS, RunSpec
from zoobench.tasks.base import Metric, Motion, Task

if TYPE_CHECKING:
    from zoobench.sim.solver import BodyState, Rollout, Solver


_GRADIENT_PASSES = 3
"""A gradient simulates every substep forward, forward again from a checkpoint, and backward."""

_COST_MARGIN = 1.25
"""Allowance for an episode that costs more than all before it: robots that move more take shorter steps."""

Watch = Callable[[Array], None]
"""A function called with the positions of all particles of the first world `[particle_count, 3]` [m]."""


class Problem:
    """A cell of the benchmark as a function of the robot's parameters, with a budget meter.

    A parameter vector holds the controller's parameters and then, in a design space, the body's. A body that cannot be
    built has no score and costs as much as its simulation was expected to, so that testing feasibility is not free.

    A method that decides on every frame uses a `zoobench.cell.session.Session`.

    Args:
        spec: the cell with its budget.
        worlds: the largest number of evaluations side by side; results do not depend on it.
        start: the stored solution named by the spec, which replaces draws as far as it fits.

    Raises:
        UnknownNameError, UsageError, SceneError: the spec names or describes something that cannot be built, or no
            part of the start fits.
    """

    def __init__(self, spec: RunSpec, *, worlds: int = 8, start: Start | None = None) -> None:
        if worlds < 1:
            raise UsageError(f"A problem with {worlds} worlds evaluates nothing. Give at least 1.")
        self.spec = spec
        self.worlds = worlds
        self.meter = BudgetMeter()
        env: Environment = registry.create(Kind.ENV, spec.env)
        self.task: Task = registry.create(Kind.TASK, spec.task)
        self.fidelity: Fidelity = registry.create(Kind.FIDELITY, spec.fidelity)
        self.robot = Robot.of(spec.design, spec.controller, self.fidelity)
        if fault := target_fault(spec):
            raise UsageError(fault)
        self.overlay = None if start is None else overlay(start, spec, self.robot)
        self.scene = env.scene(self.body, self.fidelity)
        self.density = env.robot.density
        self._substeps_per_frame = choose_step(self.scene, self.fidelity, FRAME_SECONDS).substeps_per_frame
        self.solvers = Solvers(self.scene, self.fidelity, env.equilibration_frames)

    @property
    def body(self) -> Body:
        """The robot at rest; of a design space, the workspace."""
        return self.robot.body

    @property
    def parameter_count(self) -> int:
        """Length of a parameter vector."""
        return self.robot.parameter_count

    @property
    def substeps_per_episode(self) -> int:
        """Substeps of one forward episode at the declared step.

        Most episodes take fewer, in snow less than half; fast motion and repeated frames take more. The meter counts
        the substeps that were simulated.
        """
        return self._substeps_per_frame * self.spec.frames

    @property
    def expected_substeps(self) -> int:
        """Expected substeps of the next forward episode: as declared, corrected by the costliest episode so far."""
        declared, costliest = self.substeps_per_episode, self.meter.costliest
        return max(costliest, min(declared, math.ceil(_COST_MARGIN * costliest))) if costliest else declared

    def initial(self, rng: np.random.Generator) -> Array:
        """A draw from the prior with the parts of the warm start in it `[parameter_count]`; all methods begin there."""
        draw = self.robot.initial(rng)
        return draw if self.overlay is None else self.overlay.over(draw, self.robot.control_count)

    def affords(self, count: int = 1, *, gradient: bool = False) -> bool:
        """Whether the budget is expected to suffice for `count` more evaluations, with or without gradients.

        Substeps are estimated from the costliest evaluation so far; a costlier one may exceed the budget.
        """
        held = self._holds(count, gradient)
        self.meter.refused |= not held
        return held

    def _holds(self, count: int, gradient: bool) -> bool:
        budget, meter = self.spec.budget, self.meter
        if budget.kind == "substeps":
            return meter.substeps + self._cost(count, gradient) <= budget.amount
        if budget.kind == "episodes":
            return meter.episodes + count <= budget.amount
        return meter.is_left(budget)

    def _cost(self, count: int, gradient: bool) -> int:
        """Expected substeps of so many evaluations."""
        return count * self.expected_substeps * (_GRADIENT_PASSES if gradient else 1)

    def evaluate(self, parameters: Array) -> Evaluation:
        """The evaluation of one parameter vector; see `evaluate_batch`."""
        return self.evaluate_batch([parameters])[0]

    def evaluate_batch(self, batch: Sequence[Array]) -> list[Evaluation]:
        """Simulate an episode for each parameter vector `[parameter_count]`; one that fails has an evaluation as well.

        Raises:
            BudgetExhaustedError: the budget is not expected to suffice for all; none is simulated.
            UsageError: parameters of another shape, or not finite.
        """
        return [episode.evaluation for episode in self._evaluate(batch, gradient=False)]

    def loss_and_grad(self, parameters: Array) -> tuple[Evaluation, Array]:
        """Evaluation and gradient of one parameter vector; see `loss_and_grad_batch`."""
        return self.loss_and_grad_batch([parameters])[0]

    def loss_and_grad_batch(self, batch: Sequence[Array]) -> list[tuple[Evaluation, Array]]:
        """Evaluations with the gradient `[parameter_count]` of the loss, which is minus the task's objective.

        The gradient of an episode that failed is all NaN. Raises as `evaluate_batch`.
        """
        return [(episode.evaluation, episode.gradient) for episode in self._evaluate(batch, gradient=True)]

    def prepare(self, *, gradient: bool = False) -> None:
        """Equilibrate the scene and build the solver of one world, so that the next `episode` only simulates."""
        self.solvers.get(1, gradient)

    def episode(self, parameters: Array, *, gradient: bool = False, watch: Watch | None = None) -> Episode:
        """Simulate one episode and return its full record. Raises as `evaluate_batch`.

        `watch` is called at the start and after every frame with the positions of all particles, the robot's first.
        """
        return next(iter(self._evaluate([parameters], gradient=gradient, watch=watch)))

    def _evaluate(self, batch: Sequence[Array], *, gradient: bool, watch: Watch | None = None) -> Iterator[Episode]:
        parameters = self._check(batch)
        if not self.affords(len(batch), gradient=gradient):
            raise BudgetExhaustedError(self._exhausted(len(batch), gradient))
        self.meter.start_clock()
        most = self.solvers.most_worlds(self.substeps_per_episode) if gradient else self.worlds
        width, expected = min(self.worlds, most), self.expected_substeps
        for begin in range(0, len(batch), width):
            yield from self._simulate(parameters[begin : begin + width], gradient, watch, expected)

    def _simulate(self, parameters: Array, gradient: bool, watch: Watch | None, expected: int) -> Iterator[Episode]:
        """Episodes of one solver, for parameters `[worlds, parameter_count]`; an unbuildable one costs `expected`.

        Controller, design and task are computed one world at a time: the rounding of a batched sum depends on the
        width of the batch, and no result may depend on the other worlds.
        """
        import torch

        times = torch.arange(self.spec.frames, dtype=torch.float64) * FRAME_SECONDS
        built = [self.robot.build(torch.tensor(row[None], requires_grad=gradient), times) for row in parameters]
        able = [one for one in built if not one.fault]
        episodes = iter(self._run(able, gradient, watch) if able else ())
        for one in built:
            if one.fault:
                self.meter.episodes += 1
                self.meter.charge(expected, gradient=gradient)
                failure = Evaluation(-math.inf, {}, np.zeros(0), Unbuildable(one.fault))
                yield Episode(failure, np.full(self.parameter_count, math.nan), None)
            else:
                yield next(episodes)

    def _run(self, built: Sequence[Built], gradient: bool, watch: Watch | None) -> Iterator[Episode]:
        """Simulate robots side by side."""
        from zoobench.sim.solver import BodyState

        solver = self.solvers.get(len(built), gradient)
        before = (solver.meter.forward, solver.meter.recomputed, solver.meter.backward)
        matter = {
            name: np.concatenate([one.matter[name].detach().numpy() for one in built]) for name in built[0].matter
        }
        activity = np.concatenate([one.activity.detach().numpy() for one in built], axis=1)
        loops = FeedbackLoops.of(self.robot, built)
        body = BodyState(**matter)
        show = _on_frame(solver, body, watch)
        rollout = solver.run(activity, body, progress=show, feedback=loops.act if loops else None)
        # a torn robot has no score: otherwise it could win by throwing off a piece
        broken = {**rollout.tears, **rollout.divergences}
        motions = [
            motion_of(rollout, self.body, self.density, slice(world, world + 1), gradient=gradient)
            for world in range(len(built))
        ]
        gradients = np.full((len(built), self.parameter_count), math.nan)
        if gradient:
            adjoints = self._adjoints(solver, rollout, motions, loops)
            for world, one in enumerate(built):
                if world not in broken:
                    gradients[world] = one.gradient({name: adjoint[world] for name, adjoint in adjoints.items()})
                    gradients[world] += loops.gradients[world] if loops else 0.0
        self.meter.episodes += len(built)
        self.meter.forward += solver.meter.forward - before[0]
        self.meter.recomputed += solver.meter.recomputed - before[1]
        self.meter.backward += solver.meter.backward - before[2]
        self.meter.retries += int(rollout.retries.sum())
        taken = enumerate(rollout.counts.sum(axis=0).tolist())
        whole = [substeps for world, substeps in taken if world not in rollout.divergences]
        self.meter.costliest = max(self.meter.costliest, *whole, 0)
        for world, motion in enumerate(motions):
            yield Episode(
                self._read(motion, built[world], broken.get(world)),
                gradients[world],
                motion,
                rollout.actuation[:, world].astype(np.float64),
                {name: array[world] for name, array in rollout.body.items()},
            )

    def _adjoints(
        self, solver: "Solver", rollout: "Rollout", motions: Sequence[Motion], loops: FeedbackLoops | None
    ) -> dict[str, Array]:
        """Adjoints of the activity and of the body's arrays by name, `[worlds, ...]` each."""
        direct = MotionAdjoint.joined(
            [MotionAdjoint.of(-self.task.objective(motion).sum(), motion) for motion in motions]
        )
        feedback = loops.adjoint(rollout) if loops else None
        gradient = solver.backward(rollout, direct.positions, direct.velocities, feedback)
        by_body = direct.by_arrays(gradient, rollout, self.body, self.density)
        return {"activity": gradient.actuation.swapaxes(0, 1), **by_body}

    def _read(self, motion: Motion, built: Built, divergence: Divergence | None) -> Evaluation:
        """Score, reward and metrics of a motion."""
        import torch

        if divergence is not None:
            return Evaluation(-math.inf, {}, np.zeros(0), divergence)
        with torch.no_grad():
            score = float(self.task.score(motion))
            reward = self.task.reward(motion)[:, 0].numpy().copy()
            readings = self.task.metrics(motion)
        metrics = {name: Metric(float(value), unit) for name, (value, unit) in readings.items()}
        return Evaluation(score, {**metrics, **built.metrics(), "score": Metric(score, self.task.unit)}, reward)

    def _check(self, batch: Sequence[Array]) -> Array:
        parameters = np.array(batch, dtype=np.float64)
        if parameters.shape != (len(batch), self.parameter_count) or not len(batch):
            raise UsageError(
                f"Parameters of shape {parameters.shape} were given; (at least 1, {self.parameter_count}) was expected."
            )
        if not np.isfinite(parameters).all():
            raise UsageError("The parameters contain values that are not finite. Check the method's step size.")
        return parameters

    def _exhausted(self, count: int, gradient: bool) -> str:
        budget = self.spec.budget
        cost = self._cost(count, gradient) if budget.kind == "substeps" else count
        return (
            f"{count} evaluations {'with' if gradient else 'without'} gradient would cost {cost:,} "
            f"{budget.kind}, but {self.meter.spent(budget.kind):,.6g} of {budget.amount:,.6g} are spent. "
            "Give a larger budget or fewer frames."
        )


def _on_frame(solver: "Solver", body: "BodyState", watch: Watch | None) -> Callable[[int], None] | None:
    """A callback for the solver that calls `watch` after every frame; `watch` is called for the start at once."""
    if watch is None:
        return None

    def show(_: int) -> None:
        watch(solver.matter.x[0, 0].double().cpu().numpy() + solver.origin)

    solver.reset(body)
    show(0)
    return show
