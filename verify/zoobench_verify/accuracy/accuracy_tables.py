"""The study's tables for people; programs get every field of the rows instead."""

from collections.abc import Callable, Sequence
from typing import Any

from zoobench.accuracy.levels import KeptOrders, LevelRow
from zoobench_verify.accuracy.analyse import Analysis, MatrixRow
from zoobench_verify.accuracy.energy_rows import EnergyRow
from zoobench_verify.accuracy.pairs import HELD

Table = tuple[tuple[str, ...], list[tuple[str, ...]]]
"""Column names, and rows of as many texts."""


def short_table(rows: Sequence[LevelRow]) -> Table:
    """One row per level: the score error, and the differences above which rankings agree with the finest level's."""
    return _table(
        rows, "env", "task", ("level", lambda row: row.fidelity), ("score error", _error),
        (f"ranking agrees with finest in {100 * HELD:.0f} % of pairs: one body", lambda row: _held(row.one_body)),
        ("two bodies", lambda row: _held(row.two_bodies)),
        ("bodies", lambda row: ", ".join(sorted(row.bodies))),
    )  # fmt: skip


def level_table(rows: Sequence[LevelRow]) -> Table:
    """One row per level, or knob: errors in percent with the uncertainty of the reference, reliable rankings, costs."""
    return _table(
        rows, "env", "task", "fidelity", ("score error", _error), ("score / finest", _band),
        ("finest / score where trained", lambda row: _percent(row.transfer)),
        ("ranking agrees for ratios above: one body", lambda row: _number(row.one_body.ratio)),
        ("two bodies", lambda row: _number(row.two_bodies.ratio)),
        ("1-cos gradient", lambda row: _number(row.angle)),
        ("s per simulated s", lambda row: _number(row.seconds)),
        ("with gradient", lambda row: _number(row.gradient_seconds)), ("MiB", lambda row: _whole(row.memory)),
        ("particles", lambda row: _whole(row.particles)),
    )  # fmt: skip


def matrix_table(rows: Sequence[MatrixRow]) -> Table:
    """Where gaits were found by where they are evaluated, as a share of the score where they were found."""
    names = list(dict.fromkeys(row.evaluated for row in rows))
    cells: dict[tuple[str, str, str], dict[str, str]] = {}
    for row in rows:
        cells.setdefault((row.env, row.task, row.found), {})[row.evaluated] = _percent(row.ratio)
    columns = ("env", "task", "trained at", *(f"at {name}" for name in names))
    return columns, [(*place, *(found.get(name, "") for name in names)) for place, found in cells.items()]


def knob_table(rows: Sequence[LevelRow]) -> Table:
    """All knobs of an environment and task side by side: error, and CPU seconds per simulated second."""
    names = list(dict.fromkeys(row.fidelity for row in rows))
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        cost = "" if row.seconds is None else f", {row.seconds:.2g} s"
        cells.setdefault((row.env, row.task), {})[row.fidelity] = f"{_percent(row.error)}{cost}"
    columns = ("env", "task", *names)
    return columns, [(*place, *(found.get(name, "") for name in names)) for place, found in cells.items()]


def energy_table(rows: Sequence[EnergyRow]) -> Table:
    """Energy balances, in percent of the muscles' work."""

    def share(name: str) -> Callable[[EnergyRow], str]:
        return lambda row: f"{100 * getattr(row, name):.1f} %"

    return _table(
        rows, "env", "fidelity", ("work done [J]", lambda row: _number(row.put_in)), ("work absorbed", share("back")),
        ("stored", share("stored")), ("viscosity", share("viscous")), ("yield", share("plastic")),
        ("contact", share("contact")), ("unexplained", share("unexplained")),
    )  # fmt: skip


TABLES: dict[str, tuple[type[Any], Callable[[Any], Table], Callable[[Analysis], Sequence[Any]] | None]] = {
    "short": (LevelRow, short_table, lambda analysis: analysis.levels),
    "levels": (LevelRow, level_table, lambda analysis: analysis.levels),
    "matrix": (MatrixRow, matrix_table, lambda analysis: analysis.matrix),
    "knobs": (LevelRow, knob_table, lambda analysis: analysis.knobs),
    "random": (LevelRow, level_table, lambda analysis: analysis.random),
    "energy": (EnergyRow, energy_table, None),
}
"""Kind of rows, table for people, and where the rows are in the analysis, by name."""


def _held(orders: KeptOrders) -> str:
    """The difference of scores above which rankings agree."""
    if not orders.pairs:
        return "not compared"
    ratio = orders.ratio
    which = "not known" if ratio is None else "any difference" if ratio == 1.0 else f"above {_percent(ratio - 1)}"
    return f"{which} ({orders.pairs} pairs)"


def _table(rows: Sequence[Any], *columns: str | tuple[str, Callable[[Any], str]]) -> Table:
    """A column is the name of a field, or a heading with a function that gives the text."""
    named = [(each, None) if isinstance(each, str) else each for each in columns]
    texts = [tuple(getattr(row, name) if text is None else text(row) for name, text in named) for row in rows]
    return tuple(name for name, _ in named), texts


def _error(row: LevelRow) -> str:
    least = "" if row.checked else " or more"  # two transfers on one grid may have the same error
    unknown = "not measured" if row.unknown is None else f"{_percent(row.unknown)}{least}"
    return "not known" if row.error is None else f"{_percent(row.error)} ± {unknown}"


def _band(row: LevelRow) -> str:
    return "" if row.median is None else f"{row.median:.2f} ({row.low:.2f} to {row.high:.2f})"


def _percent(share: float | None) -> str:
    if share is None:
        return ""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _whole(value: float | None) -> str:
    return "" if value is None else f"{value:,.0f}"
