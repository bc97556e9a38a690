"""The best solutions of the published leaderboards, which come with the package: `best:ENV/TASK/DESIGN`.

`best:BOARD/ENV/TASK/DESIGN` is that of one leaderboard, and `best:ground[obstacle=slot]/TASK/DESIGN` one that was found
with these settings of the environment. Settings of a run name them by the key of their run, as they name runs of a
database.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from zoobench.errors import StorageError, UnknownNameError, UsageError
from zoobench.inputs import Start
from zoobench.spec import AXES, WALL_GAP, Ref, RunSpec, is_at_wall, split_outside_brackets

PREFIX = "best:"


@dataclass(frozen=True)
class PublishedRun:
    """The best run of a row of a leaderboard, over methods and seeds.

    Attributes:
        board: the leaderboard.
        key, spec: of the run.
        params: its solution, `[parameter_count]`.
        score: in `unit`.
        tears: whether its simulation diverged on the finer grid on which the board confirms its best solutions.
        at_wall: whether its robot is known to have come near a side of its arena.
    """

    board: str
    key: str
    spec: RunSpec
    params: tuple[float, ...]
    score: float
    unit: str
    tears: bool = False
    at_wall: bool = False

    @property
    def name(self) -> str:
        """As it is typed, whichever the board."""
        return f"{PREFIX}{self._place}"

    @property
    def full_name(self) -> str:
        """As it is typed for this board."""
        return f"{PREFIX}{self.board}/{self._place}"

    def name_beside(self, other: "PublishedRun") -> str:
        """The full name, with the settings of the environment that another run has not."""
        env = self.spec.env
        own = tuple(item for item in env.params if item not in other.spec.env.params)
        return self.full_name.replace(f"/{env.name}/", f"/{Ref(env.name, 0, own)}/", 1)

    def is_named(self, places: Sequence[str]) -> bool:
        """Whether it is a run of this board, if one is given, environment with settings, task and design."""
        *board, env, task, design = places
        wanted, spec = Ref.parse(env), self.spec
        return (
            board in ([], [self.board])
            and (wanted.name, task, design) == (spec.env.name, spec.task.name, spec.design.name)
            and wanted.version in (0, spec.env.version)
            and set(wanted.params) <= set(spec.env.params)
        )

    @property
    def start(self) -> Start:
        """The solution as the start of another run."""
        return Start(self.spec, self.params)

    @property
    def _place(self) -> str:
        return f"{self.spec.env.name}/{self.spec.task.name}/{self.spec.design.name}"


def folder() -> Path:
    """The folder of the leaderboards: in an installed package, or next to that of a checkout."""
    package = Path(__file__).parent.parent
    inside = package / "leaderboards"
    return inside if inside.is_dir() else package.parent / "leaderboards"


def solutions() -> tuple[PublishedRun, ...]:
    """Those of all leaderboards, in the order of their names.

    Raises:
        StorageError: a leaderboard cannot be read.
    """
    return _all(folder())


def names() -> list[str]:
    """All that can be typed, each once: those of any board, those of each, and those that settings tell apart."""
    every = solutions()
    best = {name: named(name) for name in dict.fromkeys(each.full_name for each in every)}
    apart = (each.name_beside(best[each.full_name]) for each in every)
    return list(dict.fromkeys([*(each.name for each in every), *best, *apart]))


def named(text: str) -> PublishedRun:
    """The solution of this name: the best by score among those of the name whose scores compare.

    Scores are larger the better in every task. They compare where the question was the same: the same versions of
    environment, task and design, the same fidelity, and as many frames. Of several such groups that of the environment
    with the fewest settings is taken, as an obstacle makes another question, then that of the latest versions, then of
    the finest grid, then of the longest episode: a coarse grid or a short episode may flatter, so that 0.20 m/s there
    need not be less than 0.24 here. Settings of the environment in the name choose another group. Controller, method,
    budget and the settings of a design may differ, since scores are to compare these. A solution that tears on a finer
    grid, or was found at a wall, is taken only if the group has no other.

    Raises:
        UnknownNameError: there is none; suggests the nearest.
        UsageError: the settings of the environment are malformed.
        StorageError: a leaderboard cannot be read.
    """
    every, places = solutions(), split_outside_brackets(text.removeprefix(PREFIX), "/")
    found = [each for each in every if len(places) in (3, 4) and each.is_named(places)]
    if not found:
        raise UnknownNameError(
            f"solution, {PREFIX}ENV/TASK/DESIGN or {PREFIX}BOARD/ENV/TASK/DESIGN:",
            text,
            {each.full_name if len(places) > 3 else each.name for each in every} if "[" not in text else names(),
            "`zoobench list solutions` names all.",
        )
    return max(found, key=_standing)


def _standing(run: PublishedRun) -> tuple[object, ...]:
    """The key that ranks solutions of one name, the most important criterion first; see `named`."""
    spec = run.spec
    versions = tuple(ref.version for ref in (spec.env, spec.task, spec.design))
    spacing = spec.fidelity.kwargs.get("grid_spacing", math.inf)
    return -len(spec.env.params), versions, -float(spacing), spec.frames, not run.tears, not run.at_wall, run.score


def start(key: str) -> Start | None:
    """The solution of the published run whose key begins so.

    Raises:
        StorageError: a leaderboard cannot be read.
    """
    found = with_key(key)
    return None if found is None else found.start


def with_key(key: str) -> PublishedRun | None:
    """The published run whose key begins so.

    Raises:
        StorageError: a leaderboard cannot be read.
    """
    return next((each for each in solutions() if each.key.startswith(key)), None)


@cache
def _all(where: Path) -> tuple[PublishedRun, ...]:
    """The solutions of all leaderboards of a folder."""
    return tuple(each for path in sorted(where.glob("*.json")) for each in _solutions(path))


def cell_of(record: Mapping[str, Any], components: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The settings but the seed of a run in an export, which names components by their places."""
    return {**record["spec"], **{axis: components[record["spec"][axis]] for axis in AXES}}


def _solutions(path: Path) -> list[PublishedRun]:
    try:
        document = json.loads(path.read_text())
        components = document["components"]
        return [_published(path.stem, record, components) for record in document["runs"] if "solution" in record]
    except (OSError, ValueError, LookupError, TypeError, UsageError) as error:
        raise StorageError(
            f"The leaderboard {path.name} of this zoobench cannot be read: {error}. Install the package again."
        ) from None


def wall_gap_in(record: Mapping[str, Any]) -> float | None:
    """How near the robot of a run in an export came to a side of its arena [cells]; None if it is not known.

    Runs of an earlier zoobench did not read it; then an episode over more frames may tell.

    Raises:
        LookupError, TypeError, ValueError: it is no such record.
    """
    final = record["finals"].get(WALL_GAP)
    value = record.get("lasting", {}).get("home_gap") if final is None else final["value"]
    return None if value is None else float(value)


def _published(board: str, record: Mapping[str, Any], components: Sequence[Mapping[str, Any]]) -> PublishedRun:
    score = record["finals"]["score"]
    finer = record.get("finer")
    return PublishedRun(
        board,
        str(record["key"]),
        RunSpec.from_dict({**cell_of(record, components), "seed": record["seed"]}),
        tuple(map(float, record["solution"])),
        float(score["value"]),
        str(score["unit"]),
        tears=finer is not None and finer["score"] is None,
        at_wall=is_at_wall(wall_gap_in(record)),
    )
