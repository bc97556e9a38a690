"""The only door from a method to physics: every simulated substep passes through here and is counted."""

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
from zoobench.cell.warm_start import overlay
from zoobench.designs.base import Body
from zoobench.envs.base import Environment
from zoobench.errors import BudgetExhaustedError, Divergence, Unbuildable, UsageError
from zoobench.inputs import Start
from zoobench.registry import Kind
from zoobench.sim.model.fidelity import Fidelity
from zoobench.spec import FRAME_SECONDS, RunSpec
from zoobench.tasks.base import Metric, Motion, Task

if TYPE_CHECKING:
    from zoobench.sim.model.state import Matter
    from zoobench.sim.solver import BodyState, Rollout, Solver


_GRADIENT_PASSES = 3
"""A gradient simulates every substep forward, forward again from a checkpoint, and backward."""

_SURPRISE = 1.25
"""How much costlier than all before it an episode may well be: robots that move more take shorter steps."""

_GRADIENT_MEMORY = 2**30
"""Bytes that the stored states of all worlds of one solver may take."""

_PARTICLE_BYTES = 200
"""Generous size of a particle's state in double precision: x, v, C, F."""


Watch = Callable[[Array], None]
"""What is handed the positions of all particles of the first world, frame by frame."""


class Problem:
    """A cell of the benchmark as a function of the robot's parameters, with a meter on it.

    A parameter vector is the controller's, followed in a design space by the body's. A body that cannot be built gives
    no score, and costs what its simulation was expected to: to know which bodies hold together is not free.

    A method that decides on every frame as it comes steps through them in a `zoobench.cell.session.Session`.

    Args:
        spec: what to simulate and how much may be spent.
        worlds: how many evaluations run side by side at most; results do not depend on it.
        start: what draws begin with instead, as far as it fits; the spec names it.

    Raises:
        UnknownNameError, UsageError, SceneError: the spec names or describes something that cannot be built, or
            nothing of the start fits.
    """

    def __init__(self, spec: RunSpec, *, worlds: int = 8, start: Start | None = None) -> None:
        if worlds < 1:
            raise UsageError(f"{worlds} worlds side by side evaluate nothing. Give at least 1.")
        self.spec = spec
        self.worlds = worlds
        self.meter = BudgetMeter()
        env: Environment = registry.create(Kind.ENV, spec.env)
        self.task: Task = registry.create(Kind.TASK, spec.task)
        self.fidelity: Fidelity = registry.create(Kind.FIDELITY, spec.fidelity)
        self.robot = Robot.of(spec.design, spec.controller, self.fidelity)
        self.overlay = None if start is None else overlay(start, spec, self.robot)
        self.scene = env.scene(self.body, self.fidelity)
        self.density = env.robot.density
        self._substeps_per_frame = self._choose_substeps()
        self._equilibration_frames = env.equilibration_frames
        self._start: Matter | None = None
        self._solvers: dict[tuple[int, bool], Solver] = {}

    @property
    def body(self) -> Body:
        """The robot at rest; in a design space the workspace."""
        return self.robot.body

    @property
    def parameter_count(self) -> int:
        """Length of a parameter vector."""
        return self.robot.parameter_count

    @property
    def substeps_per_episode(self) -> int:
        """Substeps of one forward episode at the declared step.

        Most cost less, in snow less than half. Where much moves at once, and where frames had to be repeated, they cost
        more. What is metered is what was done.
        """
        return self._substeps_per_frame * self.spec.frames

    @property
    def expected_substeps(self) -> int:
        """Substeps that the next forward episode is expected to take: the declared ones, or fewer or more if those so
        far say so.
        """
        declared, costliest = self.substeps_per_episode, self.meter.costliest
        return max(costliest, min(declared, math.ceil(_SURPRISE * costliest))) if costliest else declared

    def initial(self, rng: np.random.Generator) -> Array:
        """A draw from the prior over parameters `[parameter_count]`, over it the start; every method begins with it."""
        draw = self.robot.initial(rng)
        return draw if self.overlay is None else self.overlay.over(draw, self.robot.control_count)

    def affords(self, count: int = 1, *, gradient: bool = False) -> bool:
        """Whether the budget is expected to hold `count` more evaluations, with gradients or without.

        Of substeps, what the costliest so far took is the best guess: the last evaluations may exceed the budget by as
        much as they are costlier.
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
        """Substeps that so many evaluations are expected to take."""
        return count * self.expected_substeps * (_GRADIENT_PASSES if gradient else 1)

    def evaluate(self, parameters: Array) -> Evaluation:
        """Simulate one episode; see `evaluate_batch`."""
        return self.evaluate_batch([parameters])[0]

    def evaluate_batch(self, batch: Sequence[Array]) -> list[Evaluation]:
        """Simulate an episode for each parameter vector `[parameter_count]`; a divergence is an Evaluation
        too.

        Raises:
            BudgetExhaustedError: the budget is not expected to hold all of them; none is simulated then.
            UsageError: parameters of another shape or not finite.
        """
        return [episode.evaluation for episode in self._evaluate(batch, gradient=False)]

    def loss_and_grad(self, parameters: Array) -> tuple[Evaluation, Array]:
        """Simulate one episode and its gradient; see `loss_and_grad_batch`."""
        return self.loss_and_grad_batch([parameters])[0]

    def loss_and_grad_batch(self, batch: Sequence[Array]) -> list[tuple[Evaluation, Array]]:
        """Episodes with the gradient `[parameter_count]` of the loss, which is minus the task's objective.

        The gradient of an episode that diverged is all NaN. Raises as `evaluate_batch`.
        """
        return [(episode.evaluation, episode.gradient) for episode in self._evaluate(batch, gradient=True)]

    def prepare(self, *, gradient: bool = False) -> None:
        """Settle the scene and build the solver of one world: an `observe` after it does nothing but simulate."""
        self._solver(1, gradient)

    def observe(self, parameters: Array, *, gradient: bool = False, watch: Watch | None = None) -> Episode:
        """Simulate one episode and keep all of it. Raises as `evaluate_batch`.

        `watch` is handed where all particles are `[particle_count, 3]` [m], the robot's first and then the medium's, at
        the start and after every frame.
        """
        return next(iter(self._evaluate([parameters], gradient=gradient, watch=watch)))

    def _evaluate(self, batch: Sequence[Array], *, gradient: bool, watch: Watch | None = None) -> Iterator[Episode]:
        parameters = self._check(batch)
        if not self.affords(len(batch), gradient=gradient):
            raise BudgetExhaustedError(self._exhausted(len(batch), gradient))
        self.meter.start_clock()
        width, expected = self._width(gradient), self.expected_substeps
        for begin in range(0, len(batch), width):
            yield from self._simulate(parameters[begin : begin + width], gradient, watch, expected)

    def _simulate(self, parameters: Array, gradient: bool, watch: Watch | None, expected: int) -> Iterator[Episode]:
        """One solver's worth of worlds, `[worlds, parameter_count]`; what cannot be built costs what was expected.

        Controller, design and task see one world at a time: the rounding of a batched sum depends on the batch's width,
        and a result must not depend on what ran beside it.
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

        solver = self._solver(len(built), gradient)
        before = (solver.meter.forward, solver.meter.recomputed, solver.meter.backward)
        matter = {
            name: np.concatenate([one.matter[name].detach().numpy() for one in built]) for name in built[0].matter
        }
        activity = np.concatenate([one.activity.detach().numpy() for one in built], axis=1)
        loops = FeedbackLoops.of(self.robot, built)
        body = BodyState(**matter)
        show = _on_frame(solver, body, watch)
        rollout = solver.run(activity, body, progress=show, feedback=loops.act if loops else None)
        # a robot in pieces has no score: throwing one off would be a way to win
        broken = {**rollout.tears, **rollout.divergences}
        motions = [self._motion(rollout, world, gradient) for world in range(len(built))]
        gradients = np.full((len(built), self.parameter_count), math.nan)
        if gradient:
            pulls = self._pulls(solver, rollout, motions, loops)
            for world, one in enumerate(built):
                if world not in broken:
                    gradients[world] = one.gradient({name: pull[world] for name, pull in pulls.items()})
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

    def _motion(self, rollout: "Rollout", world: int, gradient: bool) -> Motion:
        worlds = slice(world, world + 1)
        return motion_of(rollout, self.body, self.density, worlds, gradient=gradient)

    def _pulls(
        self, solver: "Solver", rollout: "Rollout", motions: Sequence[Motion], loops: FeedbackLoops | None
    ) -> dict[str, Array]:
        """Derivatives of the loss by the activity and by the arrays of the body, `[worlds, ...]` each."""
        direct = MotionAdjoint.joined(
            [MotionAdjoint.of(-self.task.objective(motion).sum(), motion) for motion in motions]
        )
        feedback = loops.adjoint(rollout) if loops else None
        gradient = solver.backward(rollout, direct.positions, direct.velocities, feedback)
        by_body = direct.by_arrays(gradient, rollout, self.body, self.density)
        return {"activity": gradient.actuation.swapaxes(0, 1), **by_body}

    def _read(self, motion: Motion, built: Built, divergence: Divergence | None) -> Evaluation:
        import torch

        if divergence is not None:
            return Evaluation(-math.inf, {}, np.zeros(0), divergence)
        with torch.no_grad():
            score = float(self.task.score(motion))
            reward = self.task.reward(motion)[:, 0].numpy().copy()
            readings = self.task.metrics(motion)
        metrics = {name: Metric(float(value), unit) for name, (value, unit) in readings.items()}
        return Evaluation(score, {**metrics, **built.metrics(), "score": Metric(score, self.task.unit)}, reward)

    def _solver(self, worlds: int, gradient: bool) -> "Solver":
        """A solver of this width, kept: the last batch of a method may be narrower than the others."""
        key = (worlds, gradient)
        if key not in self._solvers:
            self._solvers[key] = self.new_solver(worlds, gradient=gradient)
        return self._solvers[key]

    def new_solver(self, worlds: int, *, gradient: bool = False) -> "Solver":
        """A solver of the cell's scene at rest, for one user alone.

        Raises:
            UsageError: there are no worlds.
        """
        from zoobench.sim.solver import Solver

        return Solver(
            self.scene,
            self.fidelity,
            worlds=worlds,
            frame_seconds=FRAME_SECONDS,
            gradients=gradient,
            start=self._equilibrated(),
        )

    def _equilibrated(self) -> "Matter | None":
        """The scene come to rest, computed or read once; None where it starts as it stands."""
        from zoobench.sim.equilibrium import equilibrated

        if self._start is None:
            self._start = equilibrated(
                self.scene, self.fidelity, self._equilibration_frames, frame_seconds=FRAME_SECONDS
            )
        return self._start

    def _choose_substeps(self) -> int:
        from zoobench.sim.model.step_limits import choose_step

        return choose_step(self.scene, self.fidelity, FRAME_SECONDS).substeps_per_frame

    def _width(self, gradient: bool) -> int:
        """Worlds side by side, fewer where a gradient's stored states would fill the memory."""
        if not gradient:
            return self.worlds
        states = 2 * math.isqrt(self.substeps_per_episode) + 2
        bytes_per_world = states * self.scene.particle_count * _PARTICLE_BYTES
        return max(1, min(self.worlds, _GRADIENT_MEMORY // bytes_per_world))

    def _check(self, batch: Sequence[Array]) -> Array:
        parameters = np.array(batch, dtype=np.float64)
        if parameters.shape != (len(batch), self.parameter_count) or not len(batch):
            raise UsageError(
                f"Parameters of shape {parameters.shape} were given; (at least 1, {self.parameter_count}) was expected."
            )
        if not np.isfinite(parameters).all():
            raise UsageError("The parameters hold values that are not finite. Check the method's step.")
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
    """What the solver calls after every frame, so that `watch` sees it; the start is shown at once."""
    if watch is None:
        return None

    def show(_: int) -> None:
        watch(solver.matter.x[0, 0].double().cpu().numpy() + solver.origin)

    solver.reset(body)
    show(0)
    return show
