"""The study's tables for people; programs get every field of the rows instead."""

from collections.abc import Callable, Sequence
from typing import Any

from zoobench.verify.accuracy.analyse import LevelRow, ReferenceRow
from zoobench.verify.accuracy.verdicts import EnergyRow, KnobRow, RefinementRow

Table = tuple[tuple[str, ...], list[tuple[str, ...]]]
"""Column names, and rows of as many texts."""


def level_table(rows: Sequence[LevelRow]) -> Table:
    """One row per level: errors in percent with the uncertainty of the reference, ranks, costs."""
    columns = (
        "env", "task", "fidelity", "score error", "noise", "rank tau", "same winner", "path error", "1-cos gradient",
        "s per simulated s", "with gradient", "particles",
    )  # fmt: skip
    winner = {None: "", True: "yes", False: "no"}
    return columns, [
        (
            row.env, row.task, row.fidelity, _error(row), _percent(row.floor), _number(row.tau), winner[row.winner],
            _percent(row.path), _number(row.angle), _seconds(row), _number(row.gradient_seconds),
            "" if row.particles is None else f"{row.particles:,}",
        )
        for row in rows
    ]  # fmt: skip


def reference_table(rows: Sequence[ReferenceRow]) -> Table:
    """One row per environment and task: whether scores converge, and the uncertainty of the limit."""
    columns = (
        "env", "task", "levels", "converged", "order", "scores [m/s]", "reference known to", "noise", "smooth for [s]",
    )  # fmt: skip
    return columns, [
        (
            row.env, row.task, row.levels,
            f"{row.converged} of {row.draws}" if row.converged else f"not converged (0 of {row.draws})",
            _number(row.order), _number(row.scale), _percent(row.unknown), _percent(row.floor), _number(row.chaos),
        )
        for row in rows
    ]  # fmt: skip


def step_table(rows: Sequence[RefinementRow]) -> Table:
    """Gain and cost of one more level."""
    columns = ("env", "task", "from", "to", "error", "becomes", "times smaller", "times dearer", "tau", "becomes")
    return columns, [
        (
            row.env, row.task, row.level, row.next_level, _percent(row.error), _percent(row.next_error),
            _number(row.gain), _number(row.cost), _number(row.tau), _number(row.next_tau),
        )
        for row in rows
    ]  # fmt: skip


def knob_table(rows: Sequence[KnobRow]) -> Table:
    """Effect and cost of each turned knob."""
    columns = (
        "env", "task", "level", "knob", "score error", "without", "scores change by", "noise", "times dearer",
        "verdict",
    )  # fmt: skip
    return columns, [
        (
            row.env, row.task, row.home, row.knob, _percent(row.error), _percent(row.home_error), _percent(row.change),
            _percent(row.floor), _number(row.cost), row.verdict,
        )
        for row in rows
    ]  # fmt: skip


def choice_table(rows: Sequence[KnobRow]) -> Table:
    """All knobs of an environment and task side by side: error, factor of the cost, and a sign for the effect.

    `=` is a difference below the noise, `+` better, `-` worse, `~` different but neither.
    """
    names = list(dict.fromkeys(row.knob for row in rows))
    cells: dict[tuple[str, str, str], dict[str, str]] = {}
    for row in rows:
        place = cells.setdefault((row.env, row.task, _percent(row.home_error) or "not known"), {})
        cost = "" if row.cost is None else f", x {row.cost:.2g}"
        place[row.knob] = f"{_SIGNS[row.effect]} {_percent(row.error)}{cost}"
    columns = ("env", "task", "as it is", *names)
    return columns, [(*place, *(found.get(name, "") for name in names)) for place, found in cells.items()]


def energy_table(rows: Sequence[EnergyRow]) -> Table:
    """Energy balances, in percent of the muscles' work."""
    columns = (
        "env", "fidelity", "put in [J]", "taken back", "stored", "viscosity", "yield", "contact", "unexplained",
    )  # fmt: skip
    shares = ("back", "stored", "viscous", "plastic", "contact", "unexplained")
    return columns, [
        (row.env, row.fidelity, _number(row.put_in), *(f"{100 * getattr(row, share):.1f} %" for share in shares))
        for row in rows
    ]


_SIGNS = {"no difference": "=", "better": "+", "worse": "-", "other": "~", "not known": "?"}


TABLES: dict[str, tuple[type[Any] | None, Callable[[Any], Table]]] = {
    "references": (ReferenceRow, reference_table),
    "levels": (LevelRow, level_table),
    "steps": (RefinementRow, step_table),
    "knobs": (KnobRow, knob_table),
    "choices": (None, choice_table),
    "energy": (EnergyRow, energy_table),
}
"""Kind of rows and table for people, by name; `choices` is the same table for programs."""


def _error(row: LevelRow) -> str:
    if row.error is None:
        return "not known"
    note = " (noise)" if row.at_floor else ""
    unknown = "" if row.unknown is None else f" ± {_percent(row.unknown)}"
    return f"{_percent(row.error)}{unknown}{note}"


def _seconds(row: LevelRow) -> str:
    if row.seconds is None:
        return ""
    return f"{row.seconds:.2g} ({row.seconds_least:.2g} to {row.seconds_most:.2g})"


def _percent(share: float | None) -> str:
    if share is None:
        return ""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
