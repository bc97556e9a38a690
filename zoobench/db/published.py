"""The best solutions of the published leaderboards, which come with the package: `best:ENV/TASK/DESIGN`.

Settings name them by the key of their run, as they name runs of a database.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from zoobench.errors import StorageError, UsageError
from zoobench.inputs import Start
from zoobench.spec import AXES, RunSpec

PREFIX = "best:"


@dataclass(frozen=True)
class PublishedRun:
    """The best run of a row of a leaderboard, over methods and seeds.

    Attributes:
        key, spec: of the run.
        params: its solution, `[parameter_count]`.
        score: in `unit`.
    """

    key: str
    spec: RunSpec
    params: tuple[float, ...]
    score: float
    unit: str

    @property
    def name(self) -> str:
        """As it is typed."""
        return f"{PREFIX}{self.spec.env.name}/{self.spec.task.name}/{self.spec.design.name}"


def folder() -> Path:
    """Where the leaderboards lie: in an installed package, or beside that of a checkout."""
    package = Path(__file__).parent.parent
    inside = package / "leaderboards"
    return inside if inside.is_dir() else package.parent / "leaderboards"


def names() -> list[str]:
    """All that can be typed, each once."""
    return list(dict.fromkeys(each.name for each in _all(folder())))


def named(text: str) -> PublishedRun:
    """The solution of this name; of several leaderboards, that of the one whose name comes last.

    Raises:
        UsageError: there is none.
        StorageError: a leaderboard cannot be read.
    """
    found = [each for each in _all(folder()) if each.name == text]
    if not found:
        known = ", ".join(names()) or "none"
        raise UsageError(f"No leaderboard has a solution {text!r}. Write {PREFIX}ENV/TASK/DESIGN; published: {known}.")
    return found[-1]


def start(key: str) -> Start | None:
    """The solution of the published run whose key begins so.

    Raises:
        StorageError: a leaderboard cannot be read.
    """
    return next((Start(each.spec, each.params) for each in _all(folder()) if each.key.startswith(key)), None)


@cache
def _all(where: Path) -> tuple[PublishedRun, ...]:
    """The solutions of all leaderboards of a folder, in the order of their names."""
    return tuple(each for path in sorted(where.glob("*.json")) for each in _solutions(path))


def cell_of(record: Mapping[str, Any], components: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The settings but the seed of a run in an export, which names components by their places."""
    return {**record["spec"], **{axis: components[record["spec"][axis]] for axis in AXES}}


def _solutions(path: Path) -> list[PublishedRun]:
    try:
        document = json.loads(path.read_text())
        components = document["components"]
        return [_published(record, components) for record in document["runs"] if "solution" in record]
    except (OSError, ValueError, LookupError, TypeError, UsageError) as error:
        raise StorageError(
            f"The leaderboard {path.name} of this zoobench cannot be read: {error}. Install the package again."
        ) from None


def _published(record: Mapping[str, Any], components: Sequence[Mapping[str, Any]]) -> PublishedRun:
    score = record["finals"]["score"]
    return PublishedRun(
        str(record["key"]),
        RunSpec.from_dict({**cell_of(record, components), "seed": record["seed"]}),
        tuple(map(float, record["solution"])),
        float(score["value"]),
        str(score["unit"]),
    )
