"""What a hard case is: a name, a function that carries it out, and the probe that notes what was measured."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from zoobench.errors import ZoobenchError

if TYPE_CHECKING:
    from zoobench.sim.model.rollout import Rollout
    from zoobench.sim.solver import Solver


@dataclass(frozen=True)
class Check:
    """One measured quantity and whether it is within its bound; `text` says both."""

    text: str
    holds: bool


class Probe:
    """Takes down what a case measures. The solver's own figures are summed over all its runs.

    Attributes:
        checks: what was measured against which bound, in order.
        remarks: measured figures that are reported and not judged.
        smallest_j: smallest volume ratio met.
        step: smallest step taken [s]; infinite before the first.
        fraction: that step by the largest stable one that the solver declared.
        retries: frames put back and repeated with half the step.
        frames: world-frames simulated.
        guarded, particle_frames: robot particles with a held log J at the end of a frame, and all of them.
    """

    def __init__(self) -> None:
        self.checks: list[Check] = []
        self.remarks: list[str] = []
        self.smallest_j = math.inf
        self.step = math.inf
        self.fraction = math.nan
        self.retries = 0
        self.frames = 0
        self.guarded = 0
        self.particle_frames = 0

    def below(self, what: str, value: float, bound: float) -> None:
        """The value must not exceed the bound; a NaN does."""
        self.checks.append(Check(f"{what} {value:.3g} <= {bound:.3g}", bool(value <= bound)))

    def above(self, what: str, value: float, bound: float) -> None:
        """The value must reach the bound; a NaN does not."""
        self.checks.append(Check(f"{what} {value:.3g} >= {bound:.3g}", bool(value >= bound)))

    def holds(self, what: str, truth: bool) -> None:
        """Something that is no number must be so."""
        self.checks.append(Check(f"{what}: {'yes' if truth else 'no'}", truth))

    def refuses(self, what: str, words: str, action: Callable[[], object]) -> None:
        """The action must end in an error of ours whose message contains `words`."""
        try:
            action()
        except ZoobenchError as error:
            named = words in str(error)
            self.checks.append(Check(f"{what} refused{'' if named else f', but with {error!s:.80}'}", named))
        else:
            self.checks.append(Check(f"{what} accepted", False))

    def remark(self, text: str) -> None:
        """Report a figure without judging it."""
        self.remarks.append(text)

    def note_step(self, solver: "Solver", dt: float) -> None:
        """Report a step [s] that was taken."""
        if dt < self.step:
            self.step, self.fraction = dt, dt / solver.limit.dt_iso

    def note_rollout(self, solver: "Solver", rollout: "Rollout") -> None:
        """Add the figures that the solver keeps of an episode."""
        self.note_step(solver, solver.frame_seconds / max(int(rollout.counts.max()), 1))
        self.smallest_j = min(self.smallest_j, float(rollout.smallest_j.min()))
        self.retries += int(rollout.retries.sum())
        self.guarded += int(rollout.guarded.sum())
        frames = int((rollout.counts > 0).sum())
        self.frames += frames
        self.particle_frames += frames * solver.robot_count


@dataclass(frozen=True)
class Result:
    """One line of the table.

    Attributes:
        measured: every figure with its bound, those that fall short first.
        smallest_j: smallest volume ratio met; None where there is none.
        step: smallest step taken [s]; None where nothing was simulated.
        step_fraction: of the largest stable step that the solver declared.
        retries: frames that were put back and repeated with half the step.
        guarded_share: of the robot's particle-frames, those with a held log J.
        repeated_share: of all frames simulated, those that were put back.
        seconds: wall time [s].
    """

    case: str
    verdict: str
    measured: str
    smallest_j: float | None
    step: float | None
    step_fraction: float | None
    retries: int
    guarded_share: float
    repeated_share: float
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether every check holds."""
        return self.verdict == "pass"


@dataclass(frozen=True)
class Case:
    """One hard case; fast ones take seconds and run in continuous integration."""

    name: str
    about: str
    carry_out: Callable[[Probe], None] = field(compare=False)
    is_fast: bool

    def run(self) -> Result:
        """Carry it out; an exception is a failure of the case, not the end of the suite."""
        probe = Probe()
        start = time.perf_counter()
        try:
            self.carry_out(probe)
        except Exception as error:
            probe.checks.append(Check(f"{type(error).__name__}: {error}", False))
        if not probe.checks:
            probe.checks.append(Check("nothing was checked", False))
        fallen = [check.text for check in probe.checks if not check.holds]
        held = [check.text for check in probe.checks if check.holds]
        return Result(
            case=self.name,
            verdict="fail" if fallen else "pass",
            measured="; ".join([*(f"FAILS {text}" for text in fallen), *held, *probe.remarks]),
            smallest_j=probe.smallest_j if math.isfinite(probe.smallest_j) else None,
            step=probe.step if math.isfinite(probe.step) else None,
            step_fraction=probe.fraction if math.isfinite(probe.step) else None,
            retries=probe.retries,
            guarded_share=probe.guarded / max(probe.particle_frames, 1),
            repeated_share=probe.retries / max(probe.frames + probe.retries, 1),
            seconds=time.perf_counter() - start,
        )


_CASES: dict[str, Case] = {}


def case(name: str, *, fast: bool = True) -> Callable[[Callable[[Probe], None]], Callable[[Probe], None]]:
    """Register the decorated function as a case; the first line of its docstring says what it is about."""

    def register(carry_out: Callable[[Probe], None]) -> Callable[[Probe], None]:
        about = (carry_out.__doc__ or "").partition("\n")[0]
        add_case(Case(name, about, carry_out, fast))
        return carry_out

    return register


def add_case(found: Case) -> None:
    """Register a case made by hand, such as one of a family that differs in its material."""
    if found.name in _CASES:
        raise ValueError(f"There are two cases {found.name!r}.")
    _CASES[found.name] = found


def registered() -> tuple[Case, ...]:
    """Every case of the modules imported so far, in the order of their registration."""
    return tuple(_CASES.values())
