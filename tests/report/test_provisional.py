"""Environments whose scores do not hold are marked wherever these stand, and it is said why."""

import csv
import io
from pathlib import Path

import pytest

from tests.report.boards import unknown
from tests.report.content import add_done, make_spec
from zoobench import registry
from zoobench.db.rows import RunState
from zoobench.db.store import Store
from zoobench.registry import Kind
from zoobench.report.footer import footer
from zoobench.report.leaderboard import BoardRow, Leaderboard
from zoobench.report.leaderboard_pages import csv_page, markdown_page
from zoobench.report.provisional import footnotes, marked
from zoobench.report.run_results import choose_results, origins
from zoobench.report.table_forms import long_listing, table_listing
from zoobench.report.tables import score_tables
from zoobench.report.views import results_listing, results_overview, results_record, run_card
from zoobench.spec import Ref, RunSelection

LAND, MUD = make_spec(), make_spec(env="wetland-v5")


@pytest.mark.parametrize("env", ["wetland", "wetland-v5", "ocean-v4", "shallow-water-v3[depth=0.2]"])
def test_it_is_marked_in_every_version_and_explained(env: str) -> None:
    """The old version is no longer registered, and its scores are no better."""
    ref = Ref.parse(env)
    assert marked({ref: "soft"}) == {ref: "soft †"}
    (note,) = footnotes([ref, ref])
    assert note.startswith(f"† {ref.name} is provisional: ")
    assert len(note) > 80


@pytest.mark.parametrize("env", ["clay", "wetland"])
def test_the_figures_of_a_bed_name_the_soil_that_they_are_of(env: str) -> None:
    """That of the default: softer beds, and those of boards before, have the same note."""
    strength = registry.resolve(Kind.ENV, Ref(env)).kwargs["yield_stress"]
    (note,) = footnotes([Ref.parse(f"{env}[yield_stress=50]")])
    assert f"{strength:g} Pa" in note


def test_other_media_and_vanished_plugins_are_not() -> None:
    """A name that nothing registers any more says nothing."""
    refs = {Ref.parse(name): name for name in ("desert", "snow-v1", "moon-v3")}
    assert marked(refs) == refs
    assert not footnotes(refs)


def test_results_tables_and_cards_say_so(tmp_path: Path) -> None:
    """A dagger for readers, a column and a reason for programs, a line in the footer."""
    with Store(tmp_path / "a.db") as store:
        for spec in (LAND, MUD):
            add_done(store, spec, 0.5)
        found = choose_results(store, RunSelection())
        tables = score_tables(found)
        foot = footer(tables, origins(store, found), ["zoobench", "table"])
    assert [row[1] for row in results_overview(found).rows] == ["desert", "wetland †"]
    assert [record["provisional"] for record in results_listing(found).records()] == [False, True]
    reasons = [record["provisional"] for record in map(results_record, found)]
    assert reasons == [None, footnotes([MUD.env])[0]]
    assert run_card(found[1], ())["provisional"] == reasons[1]
    assert [row[0] for row in table_listing(tables[0]).rows] == ["desert", "wetland †"]
    assert [record["provisional"] for record in long_listing(tables).records()] == [False, True]
    assert [line for line in foot.lines() if line.startswith("provisional: † wetland")]


@pytest.mark.parametrize(("spec", "count"), [(LAND, 0), (MUD, 1)])
def test_pages_of_leaderboards_say_so_below_the_tables(spec: object, count: int) -> None:
    """Once, and only where a row is concerned; the CSV has a column."""
    assert isinstance(spec, type(LAND))
    board = Leaderboard("mine", "mine", "a test", (BoardRow(spec, RunState.FAILED, "broken"),))
    text = markdown_page(board, unknown)
    assert text.count("is provisional: ") == count
    assert text.count("[at the end](#origin)") == count
    assert not count or text.index("is provisional: ") > text.index("## Score")
    (row,) = csv.DictReader(io.StringIO(csv_page(board, unknown)))
    assert row["provisional"] == str(bool(count))
