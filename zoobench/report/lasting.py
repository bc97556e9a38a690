"""The results of the best solutions in longer episodes: the same gait over several times its frames."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from zoobench.db.rows import LASTING
from zoobench.spec import RunSpec

if TYPE_CHECKING:
    from zoobench.db.query import Reader

TIMES = 3
"""Factor by which an episode is longer than the solution's own."""

COLUMN = f"{TIMES}x"
"""The name of the column in tables."""

LEGEND = (
    f"{COLUMN}: share of its score that the best solution of each method, in their order, keeps over {TIMES} times its "
    "frames; of errors, the error there. at a wall: it met a side of its arena there. "
    "turned away: its mean reward in the last third was negative. torn, diverged: it has no score there. "
    "?: not evaluated"
)


@dataclass(frozen=True)
class Lasting:
    """A solution over more frames than its own.

    Attributes:
        frames: that were simulated.
        score: over all of them; None without one.
        end: how it ended, such as `torn in frame 252`; empty if it went on.
        wall_gap: smallest distance from a side of the arena over all of them [cells]; None if nothing was simulated.
        home_gap: the same over the solution's own frames; None if they are not the first of these.
    """

    frames: int
    score: float | None
    end: str
    wall_gap: float | None = None
    home_gap: float | None = None

    def text(self, home: float, sign: float = 1.0) -> str:
        """For example `87%`, `-12% turned away` or `torn in frame 252`.

        `home` is the score over its own frames; one of no more than zero is shown times `sign`, as its `Quantity` says.
        """
        if self.score is None:
            return self.end
        kept = f"{self.score / home:z.0%}" if home > 0.0 else f"{sign * self.score:.4g}"
        return f"{kept} {self.end}".strip()

    def document(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)

    @classmethod
    def from_document(cls, given: Mapping[str, Any]) -> "Lasting":
        """The inverse of `document`.

        Raises:
            LookupError, TypeError, ValueError: it is no such data.
        """
        numbers = {name: None if given[name] is None else float(given[name]) for name in _NUMBERS}
        if any(value is not None and not math.isfinite(value) for value in numbers.values()):
            raise ValueError(f"a number of {dict(given)} is not finite")
        return cls(int(given["frames"]), numbers["score"], str(given["end"]), numbers["wall_gap"], numbers["home_gap"])


_NUMBERS = ("score", "wall_gap", "home_gap")


def read_lasting(reader: "Reader", specs: Mapping[int, RunSpec]) -> dict[int, Lasting]:
    """The results over more frames of these runs' solutions, by id; the latest evaluation counts.

    Raises:
        StorageError: the database cannot be read.
    """
    rows: Iterable[Mapping[str, Any]] = (row.document for study in reader.studies(LASTING) for row in study.rows)
    return {
        row["run"]: Lasting.from_document(row)
        for row in rows
        if row["run"] in specs and row["key"] == specs[row["run"]].key()
    }
