"""Every error that zoobench raises on purpose.

A message says what was given, what was expected, and what to do next. `exit_code` is what the command line returns.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches


class ZoobenchError(Exception):
    """Base of all errors that a user can act on; printed without a traceback."""

    exit_code = 2


class UsageError(ZoobenchError):
    """The input cannot be used as it is: a malformed selector, a negative seed, a value out of range."""


class UnknownNameError(UsageError):
    """A name that is not registered; suggests the nearest known ones."""

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        names = sorted(known)
        near = get_close_matches(name, names, n=3, cutoff=0.5)
        hint = f"Did you mean {' or '.join(repr(match) for match in near)}?" if near else ""
        choices = f"Known: {', '.join(names) or 'none'}."
        super().__init__(f"Unknown {kind} {name!r}. {hint} {choices}".replace("  ", " "))
        self.suggestions = near


class SceneError(UsageError):
    """A scene that cannot be simulated: matter outside the arena, an empty body, a negative density."""


class StepSizeError(UsageError):
    """A time step was asked for that is above what the scene's stiffest particle allows."""


class StorageError(ZoobenchError):
    """The experiment database cannot be opened, read or written."""


class StorageFullError(StorageError):
    """No room is left on the disk that holds the database; nothing already stored is lost."""

    exit_code = 1


class BudgetExhaustedError(ZoobenchError):
    """A method asked for more simulation than its budget holds; methods ask `Problem.affords` first."""

    exit_code = 1


@dataclass(frozen=True)
class Divergence:
    """Where and how a simulation blew up.

    `quantity` names what left its bounds (`finite state`, `det F`, `Courant number`, ...), `value` its worst value and
    `limit` the bound, `place` the particle's position [m], `step` the substep counted from the start of
    the episode, `frame` its control frame.
    """

    world: int
    frame: int
    step: int
    quantity: str
    value: float
    limit: float
    particle: int
    place: tuple[float, float, float]
    advice: str

    def __str__(self) -> str:
        where = ", ".join(f"{c:.4g}" for c in self.place)
        return (
            f"The simulation diverged by substep {self.step} (frame {self.frame}, world {self.world}): "
            f"{self.quantity} is {self.value:.4g}, the limit is {self.limit:.4g}, "
            f"at particle {self.particle} near ({where}) m. {self.advice}"
        )


@dataclass(frozen=True)
class Unbuildable:
    """Why a design makes no robot: `fault` says what it lacks and what to do about it."""

    fault: str

    def __str__(self) -> str:
        return f"The design cannot be built: {self.fault}"


Failure = Divergence | Unbuildable
"""Why an episode has no score."""


class DivergenceError(ZoobenchError):
    """No simulation gave numbers that mean anything; recorded as a DIVERGED run."""

    exit_code = 1

    def __init__(self, failure: Failure) -> None:
        super().__init__(str(failure))
        self.failure = failure
