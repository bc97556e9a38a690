"""The budget meter: cost of a method so far, in every unit that a budget can have."""

import time
from dataclasses import dataclass, field, fields
from typing import Any

from zoobench.spec import Budget, BudgetKind


@dataclass
class BudgetMeter:
    """Cost of a method so far.

    Attributes:
        forward, backward: world-substeps simulated, which a budget in substeps pays for.
        equilibration: world-substeps in which bodies of design spaces came to rest, which no budget pays for.
        recomputed: world-substeps simulated again for gradients. Their number depends on the memory at hand, and so no
            budget pays for them either.
        retries: frames that were repeated with half the step.
        episodes: evaluations, with or without gradient.
        iterations: counted by the method.
        costliest: forward substeps of the costliest evaluation that did not diverge, repeated frames not included.
        earlier_seconds: wall time of earlier attempts [s].
        refused: whether something was asked for that exceeds the budget.
    """

    forward: int = 0
    backward: int = 0
    equilibration: int = 0
    recomputed: int = 0
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
        """World-substeps that are charged: the same on every machine."""
        return self.forward + self.backward

    @property
    def seconds(self) -> float:
        """Wall time since the first evaluation, earlier attempts included [s]."""
        running = 0.0 if self._started is None else time.perf_counter() - self._started
        return self.earlier_seconds + running

    def is_left(self, budget: Budget) -> bool:
        """Whether any of the budget is left.

        For a budget of wall time, True holds until the next evaluation: the clock runs while the method prepares it.
        """
        if budget.kind != "seconds":
            return self.spent(budget.kind) < budget.amount
        self._promised = self._promised or self.seconds < budget.amount
        return self._promised

    def start_clock(self) -> None:
        """Start the wall clock at the first evaluation; every call ends the promise of `is_left`."""
        self._promised = False
        if self._started is None:
            self._started = time.perf_counter()

    def charge(self, substeps: int, *, gradient: bool) -> None:
        """Count the substeps of an episode that was not simulated, with or without gradient."""
        self.forward += substeps
        if gradient:
            self.backward += substeps

    def spent(self, kind: BudgetKind) -> float:
        """The amount spent in this unit."""
        return float(getattr(self, kind))

    def has_ended(self, budget: Budget) -> bool:
        """Whether the budget, and not the method, ended the run."""
        is_spent = budget.kind != "seconds" and self.spent(budget.kind) >= budget.amount
        return self.refused or is_spent

    def fraction(self, budget: Budget) -> float:
        """The share of a budget that is spent, in [0, 1]."""
        return min(1.0, self.spent(budget.kind) / budget.amount)

    def state(self) -> dict[str, float]:
        """Plain numbers for a method's checkpoint."""
        counts = {item.name: getattr(self, item.name) for item in fields(self) if item.init and item.compare}
        return {**counts, "earlier_seconds": self.seconds}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`, so that a resumed run ends where the uninterrupted one would."""
        for name, value in state.items():
            setattr(self, name, value)
