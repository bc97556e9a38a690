"""The study's tables for people; programs get every field of the rows instead."""

from collections.abc import Callable, Sequence
from typing import Any

from zoobench.verify.accuracy.analyse import LevelRow, ReferenceRow
from zoobench.verify.accuracy.verdicts import EnergyRow, KnobRow, RefinementRow

Table = tuple[tuple[str, ...], list[tuple[str, ...]]]
"""Column names, and rows of as many texts."""


_SHARES = {"floor", "unknown", "path", "error", "next_error", "home_error", "change"}
"""Numbers that are shown in percent."""


def _table(rows: Sequence[Any], *columns: str | tuple[str, str | Callable[[Any], str]]) -> Table:
    """A column is the name of a field, or a heading with the name of a field or a function that gives the text."""
    named = [(column, column) if isinstance(column, str) else column for column in columns]
    return tuple(heading for heading, _ in named), [tuple(_text(row, source) for _, source in named) for row in rows]


def _text(row: Any, source: str | Callable[[Any], str]) -> str:
    if callable(source):
        return source(row)
    value = getattr(row, source)
    if isinstance(value, str):
        return value
    return _percent(value) if source in _SHARES else _number(value)


def level_table(rows: Sequence[LevelRow]) -> Table:
    """One row per level: errors in percent with the uncertainty of the reference, ranks, costs."""
    return _table(
        rows, "env", "task", "fidelity", ("score error", _error), ("noise", "floor"), ("rank tau", "tau"),
        ("same winner", lambda row: {None: "", True: "yes", False: "no"}[row.winner]), ("path error", "path"),
        ("1-cos gradient", "angle"), ("s per simulated s", _seconds), ("with gradient", "gradient_seconds"),
        ("particles", lambda row: "" if row.particles is None else f"{row.particles:,}"),
    )  # fmt: skip


def reference_table(rows: Sequence[ReferenceRow]) -> Table:
    """One row per environment and task: whether scores converge, and the uncertainty of the limit."""
    return _table(
        rows, "env", "task", "levels", ("converged", _converged), "order", ("scores [m/s]", "scale"),
        ("reference known to", "unknown"), ("noise", "floor"), ("smooth for [s]", "chaos"),
    )  # fmt: skip


def step_table(rows: Sequence[RefinementRow]) -> Table:
    """Gain and cost of one more level."""
    return _table(
        rows, "env", "task", ("from", "level"), ("to", "next_level"), "error", ("becomes", "next_error"),
        ("times smaller", "gain"), ("times dearer", "cost"), "tau", ("becomes", "next_tau"),
    )  # fmt: skip


def knob_table(rows: Sequence[KnobRow]) -> Table:
    """Effect and cost of each turned knob."""
    return _table(
        rows, "env", "task", ("level", "home"), "knob", ("score error", "error"), ("without", "home_error"),
        ("scores change by", "change"), ("noise", "floor"), ("times dearer", "cost"), "verdict",
    )  # fmt: skip


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

    def share(name: str) -> Callable[[EnergyRow], str]:
        return lambda row: f"{100 * getattr(row, name):.1f} %"

    return _table(
        rows, "env", "fidelity", ("put in [J]", "put_in"), ("taken back", share("back")), ("stored", share("stored")),
        ("viscosity", share("viscous")), ("yield", share("plastic")), ("contact", share("contact")),
        ("unexplained", share("unexplained")),
    )  # fmt: skip


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


def _converged(row: ReferenceRow) -> str:
    return f"{row.converged} of {row.draws}" if row.converged else f"not converged (0 of {row.draws})"


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
