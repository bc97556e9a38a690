"""The quantity of a task's scores and its unit: a score, of which more is better, or an error, of which less is.

Methods maximise a score, so that of a task with an error is below zero. People are shown the error.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import Ref

ERROR = "error"
"""Tag of a task whose score is an error with its sign turned."""


@dataclass(frozen=True, order=True)
class Quantity:
    """A quantity with its unit; of an error less is better."""

    is_error: bool
    unit: str

    @property
    def noun(self) -> str:
        """Its name."""
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
        """Factor by which a score is multiplied to be shown."""
        return -1.0 if self.is_error else 1.0

    def text(self, score: float, digits: int = 4) -> str:
        """A score as it is said: `score 0.1234 m/s`, or `error 0.05 m` for one of -0.05."""
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        return f"{self.noun} {self.sign * score:z.{digits}g}{unit}"


def heading(quantities: Iterable[Quantity]) -> str:
    """The heading of a column or an axis with all of these: `score`, `error`, or `score or error`."""
    return " or ".join(sorted({quantity.noun for quantity in quantities}, reverse=True)) or "score"


def quantity_of(task: Ref, unit: str = "") -> Quantity:
    """The quantity of a task's scores, in the unit that is stored with them, or that of the task itself."""
    if task.name not in registry.names(Kind.TASK):
        return Quantity(False, unit)
    component = registry.get(Kind.TASK, task.name)
    return Quantity(ERROR in component.tags, unit or str(getattr(component.factory, "unit", "")))
