"""A cell of the benchmark as a problem for a method: every simulated substep is metered here."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from zoobench import registry
from zoobench.arrays import Array
from zoobench.cell.episode import Episode, Evaluation
from zoobench.cell.episode_runner import EpisodeRunner, Watch
from zoobench.cell.meter import BudgetMeter
from zoobench.cell.robot import Built, Draft, Robot
from zoobench.cell.solvers import Solvers
from zoobench.cell.task_fault import task_fault
from zoobench.cell.warm_start import overlay
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.errors import BudgetExhaustedError, DivergenceError, Failure, Unbuildable, UsageError
from zoobench.inputs import Start
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.sim.model.scene import Scene
from zoobench.sim.model.step_limits import choose_step
from zoobench.spec import FRAME_SECONDS, RunSpec, on_gpu
from zoobench.tasks.base import Task

_GRADIENT_PASSES = 2
"""A gradient simulates every substep forward and backward; repetitions for lack of memory are not charged."""

_RELAXED_PASSES = 3
"""The same for a relaxed body, and the solid one forward."""

_GPU_WORLDS = 64
"""A GPU simulates so many robots of a few thousand particles in hardly more time than one."""

_COST_MARGIN = 1.25
"""Allowance for an episode that costs more than all before it: robots that move more take shorter steps."""


class Problem:
    """A cell of the benchmark as a function of the robot's parameters, with a budget meter.

    A parameter vector holds the controller's parameters and then, in a design space, the body's. A body that cannot be
    built has no score and costs as much as its simulation was expected to, so that testing feasibility is not free.
    The score is that of the solid body, which comes to rest before its episode; that is metered apart. The gradient is
    that of the relaxed body, see `Draft`.

    A method that decides on every frame uses a `zoobench.cell.session.Session`.

    Args:
        spec: the cell with its budget.
        worlds: the largest number of evaluations side by side, on a GPU `_GPU_WORLDS`; results do not depend on it.
        start: the stored solution named by the spec, which replaces draws as far as it fits.

    Raises:
        UnknownNameError, UsageError, SceneError: the spec names or describes something that cannot be built, or no
            part of the start fits.
    """

    def __init__(self, spec: RunSpec, *, worlds: int = 8, start: Start | None = None) -> None:
        if worlds < 1:
            raise UsageError(f"A problem with {worlds} worlds evaluates nothing. Give at least 1.")
        self.spec = spec
        self.worlds = max(worlds, _GPU_WORLDS) if on_gpu(spec) and worlds > 1 else worlds
        self.meter = BudgetMeter()
        self._env: Environment = registry.create(Kind.ENV, spec.env)
        self.task: Task = registry.create(Kind.TASK, spec.task)
        self.fidelity: Fidelity = self._env.simulated(registry.create(Kind.FIDELITY, spec.fidelity))
        self.robot = Robot.of(spec.design, spec.controller, self.fidelity, spec.task, self._env)
        if fault := task_fault(spec):
            raise UsageError(fault)
        self.overlay = None if start is None else overlay(start, spec, self.robot)
        self._runner = self._runner_of(self.body, is_fixed=self.robot.space is None)
        self._substeps_per_frame = choose_step(self.scene, self.fidelity, FRAME_SECONDS).substeps_per_frame

    @property
    def body(self) -> Body:
        """The robot at rest; of a design space, the workspace."""
        return self.robot.body

    @property
    def scene(self) -> Scene:
        """The body in its environment."""
        return self._runner.scene

    @property
    def density(self) -> float:
        """Density of muscle [kg/m^3]."""
        return self._env.robot.density

    @property
    def solvers(self) -> Solvers:
        """The solvers of the scene."""
        return self._runner.solvers

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
        affordable = self._holds(count, gradient)
        self.meter.refused |= not affordable
        return affordable

    def _holds(self, count: int, gradient: bool) -> bool:
        budget, meter = self.spec.budget, self.meter
        if budget.kind == "substeps":
            return meter.substeps + self.cost(count, gradient) <= budget.amount
        if budget.kind == "episodes":
            return meter.episodes + count <= budget.amount
        return meter.is_left(budget)

    def cost(self, count: int, gradient: bool) -> int:
        """Expected substeps of so many evaluations."""
        passes = _GRADIENT_PASSES if self.robot.space is None else _RELAXED_PASSES
        return count * self.expected_substeps * (passes if gradient else 1)

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

        The gradient of an episode that failed is all NaN. In a design space the loss is that of the relaxed body, and
        an evaluation fails if either body does. Raises as `evaluate_batch`.
        """
        return [(episode.evaluation, episode.gradient) for episode in self._evaluate(batch, gradient=True)]

    def relaxed(self, parameters: Array) -> Episode:
        """The episode of the relaxed body, whose gradient `loss_and_grad` gives; for tests of derivatives.

        Raises:
            UsageError: parameters of another shape, not finite, or of a body that cannot be built.
        """
        if self.robot.space is None:
            return self.episode(parameters)
        (draft,) = self._drafts(self._check([parameters]), gradient=False)
        if draft.fault:
            raise UsageError(str(Unbuildable(draft.fault)))
        return self._simulate_one(draft.relaxed())

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
        most = self.solvers.most_worlds(self.spec.frames, self.substeps_per_episode) if gradient else self.worlds
        # as many rounds as it takes, of one width as far as possible: each width has a solver of its own
        width = math.ceil(len(batch) / math.ceil(len(batch) / min(self.worlds, most)))
        expected = self.expected_substeps
        for begin in range(0, len(batch), width):
            drafts = self._drafts(parameters[begin : begin + width], gradient)
            able = iter(self._simulate([draft for draft in drafts if not draft.fault], gradient, watch))
            for draft in drafts:
                self.meter.episodes += 1
                yield self._fail(draft, expected, gradient) if draft.fault else next(able)

    def _drafts(self, parameters: Array, gradient: bool) -> list[Draft]:
        """The robots for parameters `[worlds, parameter_count]`.

        Controller, design and task are computed one world at a time: the rounding of a batched sum depends on the
        width of the batch, and no result may depend on the other worlds.
        """
        import torch

        # as when the simulator starts, which is later: sums of more threads round otherwise
        torch.set_num_threads(1)
        times = torch.arange(self.spec.frames, dtype=torch.float64) * FRAME_SECONDS
        return [self.robot.draft(torch.tensor(row[None], requires_grad=gradient), times) for row in parameters]

    def _fail(self, draft: Draft, expected: int, gradient: bool) -> Episode:
        """The episode of a body that cannot be built, which costs the `expected` substeps."""
        self.meter.charge(expected, gradient=gradient)
        self.meter.forward += expected if gradient else 0  # the relaxed body, too
        return self._failed(Unbuildable(draft.fault))

    def _failed(self, failure: Failure) -> Episode:
        """The episode of a robot that was not simulated to the end of its equilibration."""
        evaluation = Evaluation(-math.inf, {}, np.zeros(0), failure)
        return Episode(evaluation, np.full(self.parameter_count, math.nan), None)

    def _simulate(self, drafts: Sequence[Draft], gradient: bool, watch: Watch | None) -> Iterator[Episode]:
        """Simulate robots: those of one body side by side, each of a design space in a scene of its own."""
        if self.robot.space is None:
            if drafts:
                yield from self._runner.run([draft.solid() for draft in drafts], gradient=gradient, watch=watch)
            return
        for draft in drafts:
            relaxed = self._simulate_one(draft.relaxed(), gradient=True) if gradient else None
            if relaxed is not None and relaxed.evaluation.failure is not None:
                yield relaxed
                continue
            episode = self._simulate_one(draft.solid(), watch=watch)
            if relaxed is not None and episode.evaluation.failure is None:
                episode = replace(episode, gradient=relaxed.gradient)
            yield episode

    def _simulate_one(self, built: Built, *, gradient: bool = False, watch: Watch | None = None) -> Episode:
        runner = self._runner_of(built.body, is_fixed=False)
        try:
            (episode,) = runner.run([built], gradient=gradient, watch=watch)
        except DivergenceError as error:  # before it was at rest
            return self._failed(error.failure)
        return episode

    def _runner_of(self, body: Body, *, is_fixed: bool) -> EpisodeRunner:
        return EpisodeRunner(
            self._env, self.task, self.robot, self.fidelity, self.meter,
            body=body, frames=self.spec.frames, is_fixed=is_fixed,
        )  # fmt: skip

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
        cost = self.cost(count, gradient) if budget.kind == "substeps" else count
        return (
            f"{count} evaluations {'with' if gradient else 'without'} gradient would cost {cost:,} "
            f"{budget.kind}, but {self.meter.spent(budget.kind):,.6g} of {budget.amount:,.6g} are spent. "
            "Give a larger budget or fewer frames."
        )
