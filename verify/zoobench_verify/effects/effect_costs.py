"""Costs of effects: processor time and bytes per particle, with the effect and without it in turn.

Processor time is disturbed less by other work on the machine than wall time. Times with an effect and without it are
compared round by round, as `Ratio` says.
"""

import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from zoobench.cell.driving import travelling_wave
from zoobench.errors import DivergenceError
from zoobench.sim.model.rollout import Rollout
from zoobench.sim.model.state import Matter, Parameters
from zoobench.sim.solver import Solver
from zoobench.sim.tape import bytes_per_slot
from zoobench_verify.effects.coverage import StudiedScene
from zoobench_verify.effects.effect_scenes import pairs

if TYPE_CHECKING:
    from torch import Tensor

WARM_FRAMES = 5
"""Control frames under full actuation before the measurement: a law's time depends on the strain."""

_LAUNCH_SECONDS = 0.05  # duration of a measured launch, far above the overhead of starting one


@dataclass(frozen=True)
class EffectCost:
    """The cost of one effect in one environment.

    Attributes:
        without_it: how it was switched off.
        particles: of the scene.
        launches: kernel launches of the measured repeats, each of which contains the effect.
        launch_ms: processor time of one launch [ms].
        substeps: that contained the effect, as the launcher counts them.
        ns, ns_without: processor time per particle and substep, with the effect and without, geometric means [ns].
        ratio: of the former to the latter [-].
        low, high: its 95 % interval, see `Ratio`; None with a single repeat.
        bytes, bytes_without: of state per particle in the allocated tensors.
    """

    env: str
    effect: str
    without_it: str
    particles: int
    launches: int
    launch_ms: float
    substeps: int
    ns: float
    ns_without: float
    ratio: float
    low: float | None
    high: float | None
    bytes: float
    bytes_without: float


@dataclass(frozen=True)
class Ratio:
    """How much longer one timer takes than another, both read once a round.

    Attributes:
        first, second: geometric means of their readings, in their unit.
        value: of the former to the latter [-], which is the geometric mean of the rounds' ratios.
        low, high: the 95 % Student-t interval of that mean, from the logarithms of the rounds' ratios; None for a
            single round. An influence that slows a whole round down is in neither.
    """

    first: float
    second: float
    value: float
    low: float | None
    high: float | None

    @classmethod
    def of(cls, first: Sequence[float], second: Sequence[float]) -> "Ratio":
        """The ratio of two timers' readings, one for each round."""
        one, other = statistics.geometric_mean(first), statistics.geometric_mean(second)
        rounds = [math.log(a / b) for a, b in zip(first, second, strict=True)]
        if len(rounds) < 2:
            return cls(one, other, one / other, None, None)
        from scipy.special import stdtrit

        spread = statistics.stdev(rounds) * float(stdtrit(len(rounds) - 1, 0.975)) / math.sqrt(len(rounds))
        return cls(one, other, one / other, one / other * math.exp(-spread), one / other * math.exp(spread))


def costs(studied: StudiedScene, repeats: int = 7) -> Iterator[EffectCost]:
    """Costs of every effect of the scene that can be switched off, and of gradients.

    Raises:
        DivergenceError: the simulation diverged before it could be measured.
    """
    for pair in pairs(studied.scene):
        solvers = [Solver(scene, studied.fidelity) for scene in (pair.on, pair.off)]
        dt = min(solver.dt for solver in solvers)
        first = Trial(solvers[0], dt)
        trials = [first, Trial(solvers[1], dt, like=first)]
        record = solvers[0].launcher.launches
        before = record["forward launches"], record[f"forward {pair.effect}"]
        with_it, without = readings_in_turn([trial.seconds for trial in trials], repeats)
        ratio = Ratio.of([*map(trials[0].per_particle, with_it)], [*map(trials[1].per_particle, without)])
        launches = record["forward launches"] - before[0]
        yield EffectCost(
            env=studied.env,
            effect=str(pair.effect),
            without_it=pair.without_it,
            particles=solvers[0].particle_count,
            launches=launches,
            launch_ms=1e3 * statistics.geometric_mean(with_it),
            substeps=record[f"forward {pair.effect}"] - before[1],
            ns=ratio.first,
            ns_without=ratio.second,
            ratio=ratio.value,
            low=ratio.low,
            high=ratio.high,
            bytes=state_bytes(solvers[0]) / solvers[0].particle_count,
            bytes_without=state_bytes(solvers[1]) / solvers[1].particle_count,
        )
    yield from _gradient_costs(studied, repeats)


def _gradient_costs(studied: StudiedScene, repeats: int) -> Iterator[EffectCost]:
    """Costs of keeping the states alone, then of the whole gradient, against a forward run of the same frames."""
    keeper, plain = (Solver(studied.scene, studied.fidelity, gradients=gradients) for gradients in (True, False))
    rollout = run(keeper, WARM_FRAMES)
    adjoint = np.ones_like(rollout.positions)
    record = keeper.launcher.launches
    stored = state_bytes(keeper) + kept_bytes(keeper, rollout)
    work = rollout.substeps * keeper.particle_count * 1e-9

    forward: Callable[[], float] = partial(cpu_seconds, lambda: run(plain, WARM_FRAMES))
    keep: Callable[[], float] = partial(cpu_seconds, lambda: run(keeper, WARM_FRAMES))

    def differentiate() -> float:
        return cpu_seconds(lambda: keeper.backward(run(keeper, WARM_FRAMES), adjoint, adjoint))

    for effect, without_it, measured, direction, memory in (
        ("checkpoints", "gradients off", keep, "forward", stored),
        ("gradient", "forward only", differentiate, "reverse", stored + adjoint_bytes(keeper, rollout)),
    ):
        measured()
        forward()
        before = dict(record)
        ratio = Ratio.of(*readings_in_turn([measured, forward], repeats))
        done = {name: count - before[name] for name, count in record.items()}
        launches = done["forward launches"] + done.get("reverse launches", 0)
        yield EffectCost(
            env=studied.env,
            effect=effect,
            without_it=without_it,
            particles=keeper.particle_count,
            launches=launches,
            launch_ms=1e3 * ratio.first * repeats / launches,
            substeps=done[f"{direction} elasticity"],
            ns=ratio.first / work,
            ns_without=ratio.second / work,
            ratio=ratio.value,
            low=ratio.low,
            high=ratio.high,
            bytes=memory / keeper.particle_count,
            bytes_without=state_bytes(plain) / plain.particle_count,
        )


class Trial:
    """A warmed-up state from which the same substeps are launched repeatedly.

    Args:
        like: start from the state of this trial if it has the same tensors, so that only the effect differs.
    """

    def __init__(self, solver: Solver, dt: float, like: "Trial | None" = None) -> None:
        run(solver, WARM_FRAMES)
        self._solver, self._dt = solver, dt
        self._state = solver.matter.copy_slot(0)
        if like is not None and _shapes(like._state) == _shapes(self._state):
            self._state = like._state
        self.count = 1
        self.seconds()
        self.count = 10
        self.count = max(10, round(10 * _LAUNCH_SECONDS / self.seconds()))

    def seconds(self) -> float:
        """Processor time of `count` substeps [s]."""
        self._solver.matter.load_slot(0, self._state)
        return cpu_seconds(lambda: self._solver.substeps(self.count, self._dt))

    def per_particle(self, seconds: float) -> float:
        """Processor time per particle and substep [ns]."""
        return 1e9 * seconds / (self.count * self._solver.particle_count)


def _shapes(matter: Matter) -> list[tuple[int, ...]]:
    return [tuple(tensor.shape) for tensor in matter.tensors()]


def run(solver: Solver, frames: int) -> Rollout:
    """An episode under full actuation in a travelling wave.

    Raises:
        DivergenceError: the simulation diverged.
    """
    rollout = solver.run(travelling_wave(frames, solver.muscle_count))
    if rollout.divergences:
        raise DivergenceError(rollout.divergences[0])
    return rollout


def readings_in_turn(timers: Sequence[Callable[[], float]], repeats: int) -> list[tuple[float, ...]]:
    """The readings [s] of several timers, each read once per round."""
    return list(zip(*[[timer() for timer in timers] for _ in range(repeats)], strict=True))


def in_turn(timers: Sequence[Callable[[], float]], repeats: int) -> list[float]:
    """Medians of the readings [s] of several timers, each read once per round."""
    return [statistics.median(column) for column in readings_in_turn(timers, repeats)]


def cpu_seconds(work: Callable[[], object]) -> float:
    """Processor time of a call [s]."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def state_bytes(solver: Solver) -> int:
    """Bytes of one world's state and parameters."""
    return tensor_bytes([*solver.matter.tensors(), *solver.parameters.tensors()]) // solver.worlds


def kept_bytes(solver: Solver, rollout: Rollout) -> int:
    """Bytes of one world's states that a rollout leaves for its gradient, or that the backward pass computes again."""
    slots = int((rollout.counts + rollout.stops).sum(axis=0).max()) + 1
    tape = bytes_per_slot(solver.scene, solver.fidelity, solver.matter) * min(
        slots, rollout.segmentation.slots if rollout.segmentation else 0
    )
    return (tape + sum(segment.start.bytes_per_slot() for segment in rollout.segments)) // solver.worlds


def adjoint_bytes(solver: Solver, rollout: Rollout) -> int:
    """Bytes of one world's adjoints."""
    fields = vars(solver.adjoint(rollout)).values()
    return (
        sum(tensor_bytes(item.tensors()) for item in fields if isinstance(item, Matter | Parameters)) // solver.worlds
    )


def tensor_bytes(tensors: "Sequence[Tensor]") -> int:
    """Memory of some tensors [bytes]."""
    return sum(tensor.numel() * tensor.element_size() for tensor in tensors)
