"""Marks at differences that a fidelity cannot decide."""

import pytest

from tests.report.content import make_spec
from zoobench.db.rows import RunState
from zoobench.report.statistics import t_interval
from zoobench.report.table_forms import table_listing
from zoobench.report.tables import Row, Table, TableCell
from zoobench.report.undecided import footnotes, mark_undecided
from zoobench.spec import Ref

SPEC = make_spec()


def table(*means: float) -> Table:
    """A table of one row."""
    cells = tuple(TableCell(t_interval([mean]), "m/s", 1, {RunState.DONE: 1}, spent=100.0) for mean in means)
    methods = tuple(Ref(f"method-{number}") for number in range(len(means)))
    row = Row(SPEC.env, SPEC.task, SPEC.design, SPEC.controller, (*cells, None))
    return Table(SPEC.fidelity, 100, SPEC.budget, (*methods, Ref("other")), (row,))


@pytest.mark.parametrize(
    ("means", "ratio", "marked"),
    [
        ((3.0, 2.1, 1.9, -1.0), 1.5, [False, True, False, False]),
        ((3.0, 2.1), None, [False, False]),
        ((-1.0, -1.1, -1.6), 1.5, [False, True, False]),
        ((3.0, 3.0, 2.9), 1.0, [False, False, False]),
    ],
)
def test_means_too_near_to_the_best_are_marked(
    means: tuple[float, ...], ratio: float | None, marked: list[bool]
) -> None:
    """Those within the ratio of it, if there is a study; of errors, too, and not where one is an error alone."""
    (found,) = mark_undecided([table(*means)], lambda *place: ratio)
    assert [cell.is_undecided for cell in found.rows[0].cells if cell is not None] == marked


def test_a_mark_is_explained() -> None:
    """Once for a place; nothing is said where nothing is marked."""
    found = mark_undecided([table(3.0, 2.1), table(3.0, 2.5)], lambda *place: 1.5)
    (note,) = footnotes(found, lambda *place: 1.5)
    assert note.startswith("‡ desert x turning: draft cannot tell from the best what is within 1.5 times of it")
    assert " ‡" in table_listing(found[0]).rows[0][-2]
    assert footnotes(mark_undecided([table(3.0, 1.0)], lambda *place: 1.5), lambda *place: 1.5) == ()
