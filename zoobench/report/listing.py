"""Rows with named columns, and their text as CSV, JSON and Markdown.

The JSON form is stable: a list with one object per row, the column names as keys, numbers as numbers, a value that
does not exist as null.
"""

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

from zoobench.report.foreign_text import in_csv, in_json, in_markdown, visible


@dataclass(frozen=True)
class Listing:
    """A rectangular listing. Column names are snake_case; a cell holds text, a number, a truth value or None.

    `bold` names the cells to stress, by row and column.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    bold: frozenset[tuple[int, int]] = frozenset()

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"A row of {len(row)} cells does not fit the {len(self.columns)} columns.")

    def records(self) -> list[dict[str, Any]]:
        """One dictionary per row; a number that is not finite becomes None, since JSON cannot hold it."""
        return [dict(zip(self.columns, map(_finite, row), strict=True)) for row in self.rows]


def cell_text(value: Any) -> str:
    """A cell as a person reads it: four significant digits, but all of a whole number; an empty cell for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        is_count = value.is_integer() and 1e4 <= abs(value) < 1e15  # above, .4g gives an exponent, as in 1.593e+05
        return f"{value:.0f}" if is_count else f"{value:.4g}"
    return visible(str(value))


def to_json(value: Any) -> str:
    """Indented JSON text of plain data; keys keep their order, NaN is refused."""
    return in_json(json.dumps(value, indent=2, allow_nan=False, ensure_ascii=False))


def to_csv(listing: Listing) -> str:
    """CSV with a header line and every digit of the numbers; None is an empty field."""
    return "\n".join(csv_lines(listing.columns, listing.rows))


def csv_lines(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> Iterator[str]:
    """The same line by line, so that any number of rows can be printed; a cell's line breaks stay within its line."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    for row in chain([columns], rows):
        writer.writerow(map(_csv_cell, row))
        yield buffer.getvalue().removesuffix("\n")
        buffer.seek(0)
        buffer.truncate()


def to_markdown(listing: Listing) -> str:
    """A Markdown table; pipes, line breaks and HTML inside cells are escaped."""
    lines = [_markdown_line(listing.columns), "|" + " --- |" * len(listing.columns)]
    for number, row in enumerate(listing.rows):
        texts = [cell_text(cell) for cell in row]
        stressed = [f"**{text}**" if (number, i) in listing.bold else text for i, text in enumerate(texts)]
        lines.append(_markdown_line(stressed))
    return "\n".join(lines)


def to_latex(listing: Listing) -> str:
    """A LaTeX tabular for the package booktabs; numbers to the right, the bold cells bold."""
    columns = range(len(listing.columns))
    are_numbers = [any(isinstance(row[place], int | float) for row in listing.rows) for place in columns]
    lines = [f"\\begin{{tabular}}{{{''.join('r' if is_number else 'l' for is_number in are_numbers)}}}", "\\toprule"]
    lines += [_latex_line(map(latex_text, listing.columns)), "\\midrule"]
    for number, row in enumerate(listing.rows):
        texts = [latex_text(cell_text(cell)) for cell in row]
        stressed = [f"\\textbf{{{text}}}" if (number, i) in listing.bold else text for i, text in enumerate(texts)]
        lines.append(_latex_line(stressed))
    return "\n".join([*lines, "\\bottomrule", "\\end{tabular}"])


_LATEX = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\n": " ",
    "±": r"$\pm$", "†": r"\dag{}", "‡": r"\ddag{}", "§": r"\S{}", **{sign: f"\\{sign}" for sign in "&%$#_{}"},
}  # fmt: skip


def latex_text(text: str) -> str:
    """The text with everything that means something to LaTeX escaped."""
    return "".join(_LATEX.get(sign, sign) for sign in text)


def _latex_line(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"


def _markdown_line(cells: Sequence[str]) -> str:
    escaped = (in_markdown(cell).replace("\\|", "\\\\|").replace("|", "\\|").replace("\n", " ") for cell in cells)
    return "| " + " | ".join(escaped) + " |"


def _csv_cell(value: Any) -> Any:
    return "" if value is None else in_csv(value) if isinstance(value, str) else value


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
