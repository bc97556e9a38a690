"""Listings as CSV, JSON and Markdown."""

import csv
import io
import json
import math

import pytest
from markdown_it import MarkdownIt

from zoobench.report.listing import Listing, cell_text, to_csv, to_json, to_latex, to_markdown

LISTING = Listing(("name", "score"), (("a,b|c", 0.123456789), ("d", None)), frozenset({(0, 1)}))


def test_csv_keeps_every_digit_and_reads_back() -> None:
    """The csv module reads what was written, with no value for None."""
    rows = list(csv.reader(io.StringIO(to_csv(LISTING))))
    assert rows == [["name", "score"], ["a,b|c", "0.123456789"], ["d", ""]]


def test_json_is_one_object_per_row_and_never_nan() -> None:
    """What is no finite number is null, since JSON has no word for it."""
    records = json.loads(to_json(Listing(("x",), ((float("nan"),), (float("inf"),), (2,))).records()))
    assert records == [{"x": None}, {"x": None}, {"x": 2}]


def test_markdown_escapes_pipes_and_stresses_the_bold_cells() -> None:
    """A pipe in a cell does not open a new column, and the winner is bold."""
    assert to_markdown(LISTING).splitlines() == [
        "| name | score |",
        "| --- | --- |",
        "| a,b\\|c | **0.1235** |",
        "| d |  |",
    ]


def test_a_row_that_does_not_fit_is_refused() -> None:
    """Columns and cells are counted when the listing is made."""
    with pytest.raises(ValueError, match="2 cells"):
        Listing(("only",), ((1, 2),))


def test_truth_values_read_as_words() -> None:
    """A person reads yes and no."""
    assert [cell_text(value) for value in (True, False, None, 3)] == ["yes", "no", "", "3"]


def test_whole_numbers_are_read_to_their_last_digit() -> None:
    """As budgets are, with which substeps are compared."""
    counts = (0.0, 252.0, 159264.0, -12345.0, 12345.6, math.inf, math.nan)
    assert [cell_text(value) for value in counts] == ["0", "252", "159264", "-12345", "1.235e+04", "inf", "nan"]


ODD = "\x1b[31mred\x9b2J\u202e<script>alert(1)</script> [here](javascript:x) \\\\|"


def test_no_listing_does_what_its_text_says() -> None:
    """Escape sequences are seen on a terminal, HTML and links in Markdown; JSON means what was given."""
    odd = Listing(("name",), ((ODD,),))
    assert cell_text(ODD).startswith("\\x1b[31mred\\x9b2J\\u202e")
    for text in (cell_text(ODD), to_json(odd.records()), to_csv(odd), to_markdown(odd)):
        assert all(sign.isprintable() or sign == "\n" for sign in text)
    assert json.loads(to_json(odd.records())) == [{"name": ODD}]
    html = MarkdownIt("commonmark", {"html": True}).enable("table").render(to_markdown(odd))
    assert "<script" not in html
    assert "href" not in html
    assert html.count("<td>") == 1


def test_a_spreadsheet_computes_nothing() -> None:
    """What would be a formula is text; numbers stay numbers, be they typed or written as text."""
    cells = ("=1+1", "+A1", "-cmd|' /C calc'!A0", "@SUM(A1)", "\t=1", -0.5, "-0.5", "+1e-3", "-", "a=b")
    (row,) = csv.reader(io.StringIO(to_csv(Listing(tuple("abcdefghij"), (cells,)))).readlines()[1:])
    assert row == ["'=1+1", "'+A1", "'-cmd|' /C calc'!A0", "'@SUM(A1)", "'\t=1", "-0.5", "-0.5", "+1e-3", "-", "a=b"]


def test_latex_is_a_booktabs_table_with_everything_escaped() -> None:
    """Bold cells are bold, numbers stand to the right, and no sign of a name is taken for a command."""
    listing = Listing(("a_b", "n [%]"), (("x & y\\z ±", 1.5), ("$5 {†}", 2.0)), frozenset({(0, 0)}))
    assert to_latex(listing).splitlines() == [
        r"\begin{tabular}{lr}",
        r"\toprule",
        r"a\_b & n [\%] \\",
        r"\midrule",
        r"\textbf{x \& y\textbackslash{}z $\pm$} & 1.5 \\",
        r"\$5 \{\dag{}\} & 2 \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]
