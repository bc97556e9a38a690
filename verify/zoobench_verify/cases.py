"""The frame of the verification suites: cases, checks of values against bounds, results, and the choice by name."""

import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, SupportsFloat

from zoobench.errors import UsageError, ZoobenchError
from zoobench.spec import matching
from zoobench_verify.comparison_figure import Figure


@dataclass(frozen=True)
class Shortfall:
    """Why the simulator misses a bound that stays where physics puts it.

    Attributes:
        reason: the known cause.
        worst: how far off the bound a value may lie; one beyond is another fault.
    """

    reason: str
    worst: float


@dataclass(frozen=True)
class Check:
    """A measured value and the closed interval that it must lie in, or a statement and whether it is true.

    Attributes:
        measure: the measured quantity, or the statement.
        value: a number, or the truth of a statement, which has no bounds.
        unit: of value and bounds; `-` for a pure number.
        at_least, at_most: None where there is no bound on that side.
        shortfall: None if the bound is to be met.
    """

    measure: str
    value: float | bool
    unit: str = "-"
    at_least: float | None = None
    at_most: float | None = None
    shortfall: Shortfall | None = None

    def __post_init__(self) -> None:
        if self.at_least is None and self.at_most is None and not isinstance(self.value, bool):
            raise ValueError(f"The check {self.measure!r} has no bound.")

    @property
    def is_met(self) -> bool:
        """True, or finite and within the bounds."""
        if isinstance(self.value, bool):
            return self.value
        low, high = self._bounds
        return bool(math.isfinite(self.value) and low <= self.value <= high)

    @property
    def verdict(self) -> str:
        """`pass`, `fail`, or `known` for a value that misses its bound as its shortfall says.

        A bound that is met in spite of a shortfall fails, too: the mark must go.
        """
        if self.shortfall is None:
            return "pass" if self.is_met else "fail"
        low, high = self._bounds
        worst = self.shortfall.worst
        return "known" if worst <= self.value < low or high < self.value <= worst else "fail"

    @property
    def _bounds(self) -> tuple[float, float]:
        return (
            -math.inf if self.at_least is None else self.at_least,
            math.inf if self.at_most is None else self.at_most,
        )

    @property
    def bound(self) -> str:
        """The bounds as text; empty for a statement."""
        return self._bound(4)

    def _bound(self, digits: int) -> str:
        low, high = (None if end is None else f"{end:.{digits}g}" for end in (self.at_least, self.at_most))
        if low is None:
            return "" if high is None else f"<= {high}"
        return f">= {low}" if high is None else f"{low} to {high}"

    @property
    def text(self) -> str:
        """The whole check on one line."""
        if isinstance(self.value, bool):
            return self.measure
        why = f" (known shortfall: {self.shortfall.reason})" if self.shortfall else ""
        return f"{self.measure} {self.value:.3g} {self._bound(3)}{why}"


@dataclass
class CaseRecorder:
    """Records the checks, remarks and figure of a case while it is carried out.

    Attributes:
        checks: in the order of measurement.
        remarks: measured figures that are reported without a bound.
        figure: computed curves with their references, if the case draws any.
    """

    checks: list[Check] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    figure: Figure | None = None

    def at_most(
        self, measure: str, value: SupportsFloat, bound: float, unit: str = "-", *, shortfall: Shortfall | None = None
    ) -> None:
        """Check that the value is finite and does not exceed the bound."""
        self.checks.append(Check(measure, float(value), unit, at_most=bound, shortfall=shortfall))

    def at_least(
        self, measure: str, value: SupportsFloat, bound: float, unit: str = "-", *, shortfall: Shortfall | None = None
    ) -> None:
        """Check that the value is finite and reaches the bound."""
        self.checks.append(Check(measure, float(value), unit, at_least=bound, shortfall=shortfall))

    def within(
        self,
        measure: str,
        value: SupportsFloat,
        low: float,
        high: float,
        unit: str = "-",
        *,
        shortfall: Shortfall | None = None,
    ) -> None:
        """Check that the value lies in a closed interval."""
        self.checks.append(Check(measure, float(value), unit, low, high, shortfall))

    def holds(self, statement: str, truth: bool) -> None:
        """Check that a statement is true."""
        self.checks.append(Check(f"{statement}: {'yes' if truth else 'no'}", bool(truth)))

    def refuses(self, what: str, words: str, action: Callable[[], object]) -> None:
        """Check that the action raises a ZoobenchError whose message contains `words`."""
        try:
            action()
        except ZoobenchError as error:
            named = words in str(error)
            self.checks.append(Check(f"{what} refused{'' if named else f', but with {error!s:.80}'}", named))
        else:
            self.checks.append(Check(f"{what} accepted", False))

    def remark(self, text: str) -> None:
        """Report a figure without a bound."""
        self.remarks.append(text)

    def plot(self, title: str, x_label: str, y_label: str, *, log: str = "") -> Figure:
        """The figure of the case, without curves; `log` names its logarithmic axes."""
        self.figure = Figure(title, x_label, y_label, log)
        return self.figure

    def columns(self) -> dict[str, Any]:
        """Further columns of the result, by name."""
        return {}


@dataclass(frozen=True)
class CaseResult:
    """Checks and timing of a case.

    Attributes:
        seconds: wall time, compilation included [s].
        columns: further measured quantities, by the names of their columns.
    """

    case: "Case"
    checks: tuple[Check, ...]
    seconds: float
    remarks: tuple[str, ...] = ()
    figure: Figure | None = None
    columns: Mapping[str, Any] = field(default_factory=dict)

    @property
    def is_met(self) -> bool:
        """Whether all checks are met, but for known shortfalls."""
        return self.verdict != "fail"

    @property
    def verdict(self) -> str:
        """`fail` if any check does, `known` if some fall short as is known, else `pass`."""
        found = {check.verdict for check in self.checks}
        return "fail" if "fail" in found else "known" if "known" in found else "pass"

    @property
    def measured(self) -> str:
        """All checks on one line, those that fail first, and the remarks."""
        fallen = [f"FAILS {check.text}" for check in self.checks if check.verdict == "fail"]
        passed = [check.text for check in self.checks if check.verdict != "fail"]
        return "; ".join([*fallen, *passed, *self.remarks])


@dataclass(frozen=True)
class Case:
    """One case of a suite.

    Attributes:
        carry_out: does the work with a recorder of the type `recorder`.
        is_fast: done in a few seconds.
        source: publication or closed form that gives the bounds.
        resolution: of the grid, in words.
        precision: 32 or 64 bits; 0 where both are compared.
    """

    name: str
    summary: str
    carry_out: Callable[[Any], None] = field(compare=False)
    is_fast: bool = True
    source: str = ""
    resolution: str = ""
    precision: int = 64
    recorder: type[CaseRecorder] = CaseRecorder

    @property
    def precision_text(self) -> str:
        """`float32`, `float64` or `both`."""
        return f"float{self.precision}" if self.precision else "both"

    def run(self) -> CaseResult:
        """Carry out the case; an exception, or no check at all, is a failure of the case."""
        record = self.recorder()
        start = time.perf_counter()
        try:
            self.carry_out(record)
        except Exception as error:
            record.checks.append(Check(f"{type(error).__name__}: {error}", False))
        if not record.checks:
            record.checks.append(Check("nothing was checked", False))
        seconds = time.perf_counter() - start
        return CaseResult(self, tuple(record.checks), seconds, tuple(record.remarks), record.figure, record.columns())


_CASES: defaultdict[str, list[Case]] = defaultdict(list)
"""Cases by the name of the module that defines them."""


def case(
    name: str, source: str = "", resolution: str = "", *, args: tuple[Any, ...] = (), **settings: Any
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make the decorated function a case of its module; the first line of its docstring is the summary by default.

    Args:
        args: passed to the function after the recorder.
        settings: further attributes of the case.
    """

    def register(function: Callable[..., None]) -> Callable[..., None]:
        summary = settings.pop("summary", (function.__doc__ or "").partition("\n")[0])
        settings.update(source=source, resolution=resolution)
        _CASES[function.__module__].append(Case(name, summary, lambda record: function(record, *args), **settings))
        return function

    return register


def cases_of(*modules: ModuleType) -> tuple[Case, ...]:
    """All cases of some modules, in the order of the modules and of the cases in each."""
    return tuple(found for module in modules for found in _CASES[module.__name__])


def select(cases: Sequence[Case], patterns: Iterable[str], *, noun: str, fast: bool = False) -> list[Case]:
    """The cases whose names match a name or glob, only those done in seconds if `fast`; in the order of the suite.

    Args:
        noun: word for a case in messages.

    Raises:
        UnknownNameError: a pattern matches no case.
        UsageError: `fast`, and no matching case is fast.
    """
    names = [case.name for case in cases]
    chosen = {name for pattern in patterns for name in matching(pattern, names, noun)}
    selected = [case for case in cases if case.name in chosen and (case.is_fast or not fast)]
    if not selected:
        raise UsageError(f"The cases {', '.join(sorted(chosen))} need longer than seconds. Leave --fast out.")
    return selected
