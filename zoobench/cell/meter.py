"""The budget meter: what a method has spent, in every currency that a budget can be given in."""

import time
from dataclasses import dataclass, field, fields
from typing import Any

from zoobench.spec import Budget, BudgetKind


@dataclass
class BudgetMeter:
    """What a method has spent.

    Attributes:
        forward, recomputed, backward: world-substeps simulated.
        retries: frames that were put back and repeated with half the step.
        episodes: evaluations, with a gradient or without.
        iterations: counted by the method.
        costliest: forward substeps of the costliest evaluation so far that did not blow up, without those repeated.
        earlier_seconds: wall time of the attempts before this one.
        refused: whether the budget has not held something that was asked for.
    """

    forward: int = 0
    recomputed: int = 0
    backward: int = 0
    retries: int = 0
    episodes: int = 0
    iterations: int = 0
    costliest: int = 0
    earlier_seconds: float = 0.0
    refused: bool = field(default=False, compare=False)
    _started: float | None = field(default=None, repr=False, compare=False)
    _promised: bool = field(default=False, repr=False, compare=False)

    @property
    def substeps(self) -> int:
        """World-substeps of all three kinds together."""
        return self.forward + self.recomputed + self.backward

    @property
    def seconds(self) -> float:
        """Wall time since the first evaluation, attempts before this one included."""
        running = 0.0 if self._started is None else time.perf_counter() - self._started
        return self.earlier_seconds + running

    def is_left(self, budget: Budget) -> bool:
        """Whether anything of a budget is left.

        Of wall time, a yes is a promise that holds for the next evaluation: the clock runs on while a method breeds
        what it has asked for.
        """
        if budget.kind != "seconds":
            return self.spent(budget.kind) < budget.amount
        self._promised = self._promised or self.seconds < budget.amount
        return self._promised

    def start_clock(self) -> None:
        """Start the wall clock, once, at an evaluation; what was promised is used up with it."""
        self._promised = False
        if self._started is None:
            self._started = time.perf_counter()

    def charge(self, substeps: int, *, gradient: bool) -> None:
        """Count an episode of so many substeps that was not simulated, with its gradient or without."""
        self.forward += substeps
        if gradient:
            self.recomputed += substeps
            self.backward += substeps

    def spent(self, kind: BudgetKind) -> float:
        """How much of this currency is spent."""
        return float(getattr(self, kind))

    def has_ended(self, budget: Budget) -> bool:
        """Whether it was the budget that ended what was metered, and not that nothing more was wanted."""
        is_spent = budget.kind != "seconds" and self.spent(budget.kind) >= budget.amount
        return self.refused or is_spent

    def fraction(self, budget: Budget) -> float:
        """The spent share of a budget, in [0, 1]."""
        return min(1.0, self.spent(budget.kind) / budget.amount)

    def state(self) -> dict[str, float]:
        """Plain numbers for a method's checkpoint."""
        counts = {item.name: getattr(self, item.name) for item in fields(self) if item.init and item.compare}
        return {**counts, "earlier_seconds": self.seconds}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from `state`: a resumed run stops where the uninterrupted one would."""
        for name, value in state.items():
            setattr(self, name, value)
