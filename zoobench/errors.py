"""The errors that zoobench raises on purpose.

A message names what was given, what was expected, and what to do. `exit_code` is that of the command line.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches


class ZoobenchError(Exception):
    """Base of all errors that a user can act on; printed without a traceback."""

    exit_code = 2


class UsageError(ZoobenchError):
    """Invalid input: a malformed selector, a negative seed, a value out of range."""


class UnknownNameError(UsageError):
    """A name that is not registered; the message suggests similar ones, and tells all, or how to list them."""

    def __init__(self, kind: str, name: str, known: Iterable[str], listing: str = "") -> None:
        names = sorted(known)
        near = get_close_matches(name, names, n=3, cutoff=0.5)
        hint = f"Did you mean {' or '.join(repr(match) for match in near)}?" if near else ""
        choices = listing or f"Known: {', '.join(names) or 'none'}."
        super().__init__(f"Unknown {kind} {name!r}. {hint} {choices}".replace("  ", " "))


class UnknownRunError(UsageError):
    """No run has the number, or a key that begins so."""


class SceneError(UsageError):
    """A scene that cannot be simulated: matter outside the arena, an empty body, a negative density."""


class StepSizeError(UsageError):
    """The given time step exceeds the stability limit of the scene's stiffest particle."""


class StorageError(ZoobenchError):
    """The experiment database cannot be opened, read or written."""


class StorageFullError(StorageError):
    """The disk of the database is full; data already stored is kept."""

    exit_code = 1


class BudgetExhaustedError(ZoobenchError):
    """The budget does not suffice for a simulation; methods call `Problem.affords` first."""

    exit_code = 1


@contextmanager
def extra(name: str, user: str) -> Iterator[None]:
    """A context for importing libraries of an extra, which `user`, as "Figures need", cannot do without.

    Raises:
        UsageError: one of them is not installed.
    """
    try:
        yield
    except ImportError as error:
        library = (error.name or name).partition(".")[0]
        raise UsageError(f"{user} {library}, which is not installed. Try: pip install 'zoobench[{name}]'.") from None


def reason(error: OSError | UnicodeError) -> str:
    """Why a file cannot be read or written, without the number of the error and the path."""
    return "it is no text in UTF-8" if isinstance(error, UnicodeError) else error.strerror or str(error)


BEYOND = "distance beyond the arena in cells"
"""The quantity of a divergence by matter that has left the arena."""


@dataclass(frozen=True)
class Divergence:
    """Where and how a simulation diverged.

    `quantity` is the one that left its bounds (`finite state`, `det F`, `Courant number`, ...), `value` its worst value
    and `limit` the bound, `place` the particle's position [m], `step` the substep counted from the start of the
    episode, `frame` its control frame, `body` that of the particle.
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
    body: str = "robot"

    def __str__(self) -> str:
        owner = "" if self.body == "robot" else f" of the {self.body}"
        where = ", ".join(f"{c:.4g}" for c in self.place)
        return (
            f"The simulation diverged by substep {self.step} (frame {self.frame}, world {self.world}): "
            f"{self.quantity} is {self.value:.4g}, the limit is {self.limit:.4g}, "
            f"at particle {self.particle}{owner} near ({where}) m. {self.advice}"
        )


@dataclass(frozen=True)
class Unbuildable:
    """Why a design cannot be built: `fault` names the defect and the remedy."""

    fault: str

    def __str__(self) -> str:
        return f"The design cannot be built: {self.fault}"


@dataclass(frozen=True)
class Displaced:
    """Why an object is not where it was put when the episode begins: `fault` names it and the remedy."""

    fault: str

    def __str__(self) -> str:
        return self.fault


Failure = Divergence | Unbuildable | Displaced
"""Why an episode has no score."""


class DivergenceError(ZoobenchError):
    """All simulations of a run failed; the run is recorded as DIVERGED."""

    exit_code = 1

    def __init__(self, failure: Failure) -> None:
        super().__init__(str(failure))
        self.failure = failure
