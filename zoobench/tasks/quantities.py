"""What the scores of a task are called: scores, of which more is better, or errors, of which less is, and their unit.

Methods maximise a score, so that of a task with an error is below zero. People are shown the error.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref

ERROR = "error"
"""Tag of a task whose score is an error with its sign turned."""

_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "k": 1e3, "M": 1e6}


@dataclass(frozen=True, order=True)
class Quantity:
    """A quantity with its unit; of an error less is better."""

    is_error: bool
    unit: str

    @property
    def noun(self) -> str:
        """What it is called."""
        return "error" if self.is_error else "score"

    @property
    def title(self) -> str:
        """For example `Error [mm], less is better`."""
        unit = f" [{self.unit}]" if self.unit else ""
        return f"{self.noun.capitalize()}{unit}{', less is better' * self.is_error}"

    @property
    def unit_text(self) -> str:
        """For example `m/s`, or of an error `mm, less is better`, for a column of units."""
        return ", ".join([self.unit] * bool(self.unit) + ["less is better"] * self.is_error)

    @property
    def sign(self) -> float:
        """By which a score is multiplied to be shown."""
        return -1.0 if self.is_error else 1.0

    def text(self, score: float) -> str:
        """A score as it is said: `score 0.1234`, or `error 0.05` for one of -0.05."""
        return f"{self.noun} {self.sign * score:.4g}"


def heading(quantities: Iterable[Quantity]) -> str:
    """What a column or an axis with all of these is called: `score`, `error`, or `score or error`."""
    return " or ".join(sorted({quantity.noun for quantity in quantities}, reverse=True)) or "score"


def quantity_of(task: Ref, unit: str = "") -> Quantity:
    """The quantity of a task's scores, in the unit that is stored beside them, or that of the task itself."""
    if task.name not in registry.names(Kind.TASK):
        return Quantity(False, unit)
    component = registry.get(Kind.TASK, task.name)
    return Quantity(ERROR in component.tags, unit or str(getattr(component.factory, "unit", "")))


def conversion(unit: str, wanted: str) -> float | None:
    """By which numbers in a unit are multiplied to be in another, `mm/s` for `m/s`; None where that is not one."""
    if unit == wanted:
        return 1.0
    found = [1.0 / scale for prefix, scale in _PREFIXES.items() if wanted == f"{prefix}{unit}"]
    back = [scale for prefix, scale in _PREFIXES.items() if unit == f"{prefix}{wanted}"]
    return next(iter(found + back), None) if unit and wanted else None


def check_units(wanted: tuple[str, ...], units: set[str]) -> None:
    """Check that each wanted unit is one of what is shown.

    Raises:
        UsageError: one is not.
    """
    for unit in wanted:
        if not any(conversion(own, unit) for own in units):
            known = ", ".join(sorted(filter(None, units))) or "none"
            raise UsageError(f"Nothing here can be shown in {unit!r}. The units are {known}; give mm/s for m/s.")
