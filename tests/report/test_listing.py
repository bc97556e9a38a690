"""Listings as CSV, JSON and Markdown."""

import csv
import io
import json
import math

import pytest
from markdown_it import MarkdownIt

from zoobench.report.latex import to_latex
from zoobench.report.listing import Listing, Measured, cell_text, flattened, to_csv, to_json, to_markdown

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


def test_headings_do_no_more_than_cells() -> None:
    """A name of a metric is text of others, too, wherever it stands."""
    listing = Listing((ODD,), (("x",),), title=ODD)
    texts = (to_csv(listing), to_markdown(listing), to_latex(listing, caption=listing.title), *listing.headings)
    for text in texts:
        assert all(sign.isprintable() or sign == "\n" for sign in text)
    html = MarkdownIt("commonmark", {"html": True}).enable("table").render(to_markdown(listing))
    assert "<script" not in html
    assert "href" not in html


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (Measured(0.1815, 0.1385, 0.2245), "0.181 ± 0.043"),
        (Measured(1.001, 0.9985, 1.0035), "1.0010 ± 0.0025"),
        (Measured(0.0618, -0.0008, 0.1244), "0.062 ± 0.063"),
        (Measured(12345.6, 12000.0, 12691.2), "12350 ± 350"),
        (Measured(0.85, 0.8, 0.95), "0.85 (0.80 to 0.95)"),
        (Measured(0.5, 0.5 - 1e-9, 0.5 + 1e-9), "0.5 ± 1e-09"),
        (Measured(0.31, notes=("n=1 of 3", "failed 2/3"), marks="‡"), "0.31 ‡ (n=1 of 3, failed 2/3)"),
        (Measured(None, notes=("no score", "n=0")), "no score (n=0)"),
        (Measured(1.0, 1.0, 1.0), "1"),
    ],
)
def test_digits_are_those_that_the_interval_supports(found: Measured, text: str) -> None:
    """Two of its half, and one where it lies unevenly; four without one."""
    assert cell_text(found) == text


def test_an_error_is_a_score_with_its_sign_turned() -> None:
    """The ends of the interval change places."""
    assert Measured(-0.02, -0.03, -0.01).scaled(-1e3) == Measured(20.0, 10.0, 30.0)


def test_programs_get_numbers_and_no_estimates() -> None:
    """What is meant for people is refused in the forms for programs, and dictionaries have a column for each entry."""
    with pytest.raises(TypeError, match="for people"):
        Listing(("x",), ((Measured(1.0),),)).records()
    flat = flattened(Listing(("a", "b"), ((1, {"c": 2.0}), (3, {"d": "e"}), (4, None))))
    assert (flat.columns, flat.rows) == (("a", "b.c", "b.d"), ((1, 2.0, None), (3, None, "e"), (4, None, None)))


def test_latex_is_a_table_of_booktabs_and_siunitx_with_everything_escaped() -> None:
    """Bold cells are bold, numbers are aligned, what is none stands in braces, and no sign of a name is a command."""
    rows = (("x & y\\z ±", 1.5, Measured(0.1815, 0.1385, 0.2245)), ("$5 {†}", -22.25, Measured(1.2, notes=("n=1",))))
    listing = Listing(
        ("a_b", "n [%]", "v"), (*rows, ("z", None, Measured(None, notes=("no_score",)))), frozenset({(0, 0), (0, 2)})
    )
    assert to_latex(listing, caption="5 %", label="tab:x").splitlines() == [
        r"\begin{table}",
        r"\centering",
        r"\caption{5 \%}",
        r"\label{tab:x}",
        r"\begin{tabular}{l S[table-format = -2.2, detect-weight, mode = text] "
        r"S[table-format = 1.3(2), separate-uncertainty = true, table-space-text-post = {{\scriptsize~(n=1)}}, "
        r"detect-weight, mode = text]}",
        r"\toprule",
        r"a\_b & {n [\%]} & {v} \\",
        r"\midrule",
        r"\textbf{x \& y\textbackslash{}z $\pm$} & 1.5 & \bfseries 0.181 \pm 0.043 \\",
        r"\$5 \{\dag{}\} & -22.25 & 1.2{\scriptsize~(n=1)} \\",
        r"z &  & {no\_score} \\",
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
    ]
