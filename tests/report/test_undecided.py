"""Marks at differences that a fidelity cannot decide."""

import math
from dataclasses import dataclass, replace

import pytest

from tests.report.content import make_spec
from zoobench.db.rows import RunState
from zoobench.report.entries import Entry
from zoobench.report.statistics import t_interval
from zoobench.report.table_cell import TableCell
from zoobench.report.table_forms import table_listing
from zoobench.report.tables import Row, Table
from zoobench.report.undecided import footnotes, mark_undecided
from zoobench.spec import Ref

SPEC = make_spec()


@dataclass(frozen=True)
class Known:
    """Which orders hold."""

    ratio: float | None
    bodies: tuple[str, ...] = ("baby-seal", "panda")


def table(*means: float) -> Table:
    """A table of one row."""
    cells = tuple(TableCell(t_interval([mean]), "m/s", 1, {RunState.DONE: 1}, spent=100.0) for mean in means)
    names = (*(f"method-{number}" for number in range(len(means))), "other")
    entries = tuple(Entry(SPEC.controller, Ref(name)) for name in names)
    row = Row(SPEC.env, SPEC.task, SPEC.design, (*cells, None))
    return Table(SPEC.fidelity, 100, SPEC.budget, entries, (row,))


@pytest.mark.parametrize(
    ("means", "ratio", "marked"),
    [
        ((3.0, 2.1, 1.9, -1.0), 1.5, [False, True, False, False]),
        ((3.0, 2.1), None, [False, False]),
        ((-1.0, -1.1, -1.6), 1.5, [False, True, False]),
        ((3.0, 3.0, 2.9), 1.0, [False, False, False]),
        ((3.0, 2.1, 0.1), math.inf, [False, True, True]),
    ],
)
def test_means_too_near_to_the_best_are_marked(
    means: tuple[float, ...], ratio: float | None, marked: list[bool]
) -> None:
    """Those within the ratio of it, if there is a study, all if none is known; of errors, too, and not where one is an
    error alone."""
    known = None if ratio is None else Known(None if math.isinf(ratio) else ratio)
    (found,) = mark_undecided([table(*means)], lambda *place: known)
    assert [cell.is_undecided for cell in found.rows[0].cells if cell is not None] == marked


def test_a_mark_is_explained() -> None:
    """Once for a place; nothing is said where nothing is marked."""
    found = mark_undecided([table(3.0, 2.1), table(3.0, 2.5)], lambda *place: Known(1.5))
    (note,) = footnotes(found, lambda *place: Known(1.5))
    assert note.startswith("‡ desert x turning: draft cannot tell from the best what is within 1.5 times of it")
    assert note.endswith("(measured on baby-seal, panda)")
    assert " ‡" in table_listing(found[0]).reading()[0][-2]
    assert footnotes(mark_undecided([table(3.0, 1.0)], lambda *place: Known(1.5)), lambda *place: Known(1.5)) == ()


def bodies(**means: float) -> Table:
    """A table of two methods with a row for each body, whose best means these are."""
    rows = [replace(table(0.1 * mean, mean).rows[0], design=Ref(name)) for name, mean in means.items()]
    return replace(table(1.0, 1.0), rows=tuple(rows))


def test_an_order_of_bodies_that_is_not_known_is_told() -> None:
    """Those nearer than the ratio of two bodies, whatever that of one is; or all, where none was measured."""
    several = bodies(fish=3.0, panda=1.0, seal=1.1)
    (note,) = footnotes([several], lambda *place: Known(1.5 if place[-1] else 1.01))
    assert note.startswith("desert x turning: draft tells the order of two bodies above a ratio of 1.5 (measured on")
    assert note.endswith(", not that of panda and seal")
    assert footnotes([several], lambda *place: Known(1.05)) == ()
    for unknown in (Known(None), None):
        (note,) = footnotes([several], lambda *place, found=unknown: found)
        assert note == "no order of two bodies is known at draft: desert"
    assert footnotes([bodies(fish=3.0)], lambda *place: None) == ()


def test_of_an_environment_the_tasks_without_figures_are_told() -> None:
    """One of two."""
    turning = bodies(fish=3.0, panda=1.0)
    moving = tuple(replace(row, task=Ref("movement-speed")) for row in turning.rows)
    (note,) = footnotes(
        [replace(turning, rows=(*turning.rows, *moving))],
        lambda env, task, fidelity, of_two: Known(1.5) if task.name == "turning" else None,
    )
    assert note == "no order of two bodies is known at draft: desert x movement-speed"
