"""The footer of a table: the provenance of its numbers, and the command that makes it again.

It depends on the database and the command only, not on the moment: the same runs give the same text.
"""

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from zoobench import registry
from zoobench.db.many_rows import OriginRow
from zoobench.registry import KINDS, Kind
from zoobench.report.entries import UNKNOWN_COST
from zoobench.report.lasting import LEGEND
from zoobench.report.leaderboard import Attempt
from zoobench.report.provisional import footnotes
from zoobench.report.table_cell import TableCell
from zoobench.report.tables import Table
from zoobench.spec import LEAST_WALL_GAP, Ref

_PACKAGES = ("zoobench", "taichi", "torch", "numpy")
_LEGEND = (
    "mean over seeds ± half of the 95 % Student-t interval, none where all seeds gave the same; n: seeds behind it, "
    "where they are not those of the title; bold or *: all seeds done, the interval better than those of the other "
    "methods, and amounts spent less than 5 % apart, or better already when no more had been spent than by any of them"
)
_AT_WALL = (
    f"‖ a robot came within {LEAST_WALL_GAP:g} cells of a side of its arena, which has a part in the score: nobody "
    "wins by it; give a larger arena, where it has a length, or fewer frames"
)
_OVERTURNED = "§ wins here and not on a finer grid, where another method's best solution is better"


@dataclass(frozen=True)
class Footer:
    """The provenance of a set of tables.

    Attributes:
        commits: of zoobench, each marked where there were uncommitted changes.
        components: every reference in the tables with its version and all parameters.
        machines: processor, cores, accelerators, memory.
        packages: name and version of the packages on which the numbers depend.
        plugins: the components of other distributions, with the hash of their code: two where it has changed between
            runs without a new version.
        superseded: components that have a newer version here, with which other numbers are made.
        provisional: the environments whose scores are provisional, and why.
        undecided: where differences are marked that the fidelity cannot decide.
        external: the agents that were trained elsewhere, and the meaning of their mark.
        overturned: the meaning of the mark at winners that do not win on a finer grid; empty without one.
        walls: the meaning of the mark at robots that met a side of their arena, and the number of runs not checked.
        lasting: the meaning of the column on more frames; empty without one.
        dates: first start and last end of the runs, UTC; empty without a finished run.
        command: the command that prints these tables.
    """

    commits: tuple[str, ...]
    components: tuple[str, ...]
    machines: tuple[str, ...]
    packages: tuple[str, ...]
    dates: tuple[str, ...]
    command: str
    plugins: tuple[str, ...] = ()
    superseded: tuple[str, ...] = ()
    provisional: tuple[str, ...] = ()
    undecided: tuple[str, ...] = ()
    external: tuple[str, ...] = ()
    overturned: tuple[str, ...] = ()
    walls: tuple[str, ...] = ()
    lasting: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """The footer as text, one fact a line."""
        unknown = ("unknown",)
        facts = {
            "cells": (_LEGEND,),
            "provisional": self.provisional,
            "undecided": self.undecided,
            "overturned": self.overturned,
            "walls": self.walls,
            "lasting": self.lasting,
            "external": self.external,
            "commit": self.commits or unknown,
            "components": self.components or unknown,
            "plug-ins": self.plugins,
            "superseded": self.superseded,
            "machine": self.machines or unknown,
            "packages": self.packages or unknown,
            "runs from": (" to ".join(self.dates),) if self.dates else unknown,
            "made by": (self.command,),
        }
        return [f"{name}: {'; '.join(values)}" for name, values in facts.items() if values]


def footer(tables: Sequence[Table], attempts: Iterable[Attempt | OriginRow], command: Sequence[str]) -> Footer:
    """Gather the provenance of these tables from the attempts that made their numbers."""
    made = list(attempts)
    documents = [attempt.provenance for attempt in made]
    times = [time for attempt in made for time in (attempt.started_at, attempt.ended_at) if time is not None]
    return Footer(
        commits=_distinct(_commit(document.get("code", {})) for document in documents),
        components=_distinct(str(ref) for _, ref in _refs(tables)),
        machines=_distinct(map(machine_text, documents)),
        packages=_distinct(map(_packages, documents)),
        dates=_distinct(_date(time) for time in (min(times), max(times))) if times else (),
        command=shlex.join(command),
        plugins=_distinct(_plugins(documents)),
        superseded=_distinct(_superseded(tables)),
        provisional=footnotes({row.env for table in tables for row in table.rows}),
        external=_distinct(_external(tables)),
        overturned=(_OVERTURNED,) if any(cell.is_overturned for cell in _cells(tables)) else (),
        walls=tuple(_walls(list(_cells(tables)))),
        lasting=(LEGEND,) if any(cell.lasting for cell in _cells(tables)) else (),
    )


def _cells(tables: Sequence[Table]) -> Iterator[TableCell]:
    return (cell for table in tables for row in table.rows for cell in row.cells if cell is not None)


def _walls(cells: Sequence[TableCell]) -> Iterator[str]:
    if any(cell.is_at_wall for cell in cells):
        yield _AT_WALL
    gaps = [gap for cell in cells for gap in cell.gaps]
    if unknown := gaps.count(None):
        yield f"whether it met one is not known of {unknown:,} of {len(gaps):,} runs, which an earlier zoobench did"


def _refs(tables: Sequence[Table]) -> set[tuple[Kind, Ref]]:
    """Every reference in the tables."""
    rows = [row for table in tables for row in table.rows]
    found = {(KINDS[axis], getattr(row, axis)) for row in rows for axis in ("env", "task", "design")}
    found |= {(Kind.FIDELITY, table.fidelity) for table in tables}
    entries = {entry for table in tables for entry in table.entries}
    return found | {(KINDS[axis], getattr(entry, axis)) for entry in entries for axis in ("controller", "method")}


def _external(tables: Sequence[Table]) -> Iterator[str]:
    """The methods that are agents of somebody else, which no budget of training is known of."""
    for entry in {entry for table in tables for entry in table.entries}:
        if entry.is_external:
            agent = entry.agent or entry.method.kwargs.get("policy")
            yield f"{UNKNOWN_COST} {agent} was trained elsewhere at a cost that is not known: it wins and loses nothing"


def _plugins(documents: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """The components of plug-ins, as `environment wet-rock-v1 of zoobench-wet-rock 1.0, code 0123456789ab`."""
    codes: dict[str, set[str]] = {}
    for document in documents:
        for name, facts in document.get("plugins", {}).items():
            package = "a package that is not known"  # as of runs by an earlier zoobench in a checkout
            if facts["distribution"]:
                package = f"{facts['distribution']} {facts['version']}"
            whole = f"{name} of {package}"
            codes.setdefault(whole, set()).add(str(facts["code"])[:12])
    for name, found in codes.items():
        yield f"{name}, code {' and '.join(sorted(found))}{' (CHANGED between runs)' * (len(found) > 1)}"


def _superseded(tables: Sequence[Table]) -> Iterator[str]:
    """The components that are registered in a newer version, such as `voxel-v1 is voxel-v2 now`."""
    for kind, ref in _refs(tables):
        if ref.name in registry.names(kind) and (newest := registry.get(kind, ref.name).version) > ref.version:
            yield f"{ref.name}-v{ref.version} is {ref.name}-v{newest} now"


def _commit(code: Mapping[str, Any]) -> str:
    if not code.get("commit"):
        return f"not a commit, files {str(code.get('files', 'unknown'))[:12]}"
    state = f" with uncommitted changes, files {str(code.get('files'))[:12]}" if code.get("dirty") else ""
    return f"{str(code['commit'])[:12]}{state}"


def machine_text(document: Mapping[str, Any]) -> str:
    """The machine that a provenance tells of: processor, cores, accelerators, memory."""
    cpu = document.get("cpu", {})
    parts = [f"{cpu.get('model') or 'unknown processor'} ({cpu.get('cores')} cores, {cpu.get('threads')} threads)"]
    parts += document.get("gpus", [])
    if memory := document.get("memory"):
        parts.append(f"{memory / 2**30:.0f} GiB")
    return ", ".join(parts)


def _packages(document: Mapping[str, Any]) -> str:
    versions = document.get("packages", {})
    known = [f"{name} {versions[name]}" for name in _PACKAGES if versions.get(name)]
    return ", ".join([f"Python {document.get('python', 'unknown')}", *known])


def _date(time: float) -> str:
    return datetime.fromtimestamp(time, UTC).strftime("%Y-%m-%d %H:%M UTC")


def _distinct(texts: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(set(texts)))
