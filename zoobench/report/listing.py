"""Rows of typed values with named columns, and their text: the one place where values of results become text.

A listing is for people: few columns, headings with units, estimates with their intervals. What programs get of a
command is a listing, too, with a column for each field of its rows and plain values alone. The JSON form of that is
stable: a list with one object per row, the column names as keys, numbers as numbers, a value that does not exist as
null.
"""

import csv
import io
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import chain
from typing import Any

from zoobench.report.foreign_text import in_csv, in_json, in_markdown, visible

Text = Callable[[Any], str]
"""How a value reads."""

_MOST_DIGITS = 6  # significant ones of a number with an interval


@dataclass(frozen=True)
class Measured:
    """A number with its interval and notes.

    Attributes:
        value: None where there is none, as the first of `notes` says.
        low, high: the ends of the interval; None without one.
        notes: in brackets behind it.
        marks: signs of footnotes.
        by_ends: whether the interval is told by its ends even if it lies evenly, as of the least and the largest.
    """

    value: float | None
    low: float | None = None
    high: float | None = None
    notes: tuple[str, ...] = ()
    marks: str = ""
    by_ends: bool = False

    @property
    def half_width(self) -> float | None:
        """Half of the interval where it lies evenly around the value; None without one."""
        if self.by_ends or self.value is None or self.low is None or self.high is None:
            return None
        below, above = self.value - self.low, self.high - self.value
        return above if math.isclose(below, above, rel_tol=1e-6, abs_tol=1e-12 * abs(self.value)) else None

    @property
    def decimals(self) -> int | None:
        """The decimal places that the interval supports: two digits of its half, one where it lies unevenly.

        None without an interval, or with one so narrow that the number would have too many digits.
        """
        if self.value is None or self.low is None or self.high is None or not self.high > self.low:
            return None
        digits = 1 if self.half_width is None else 2
        half = float(f"{(self.high - self.low) / 2:.{digits - 1}e}")
        places = digits - 1 - math.floor(math.log10(half))
        return places if places + math.floor(math.log10(max(abs(self.value), half))) < _MOST_DIGITS else None

    def scaled(self, factor: float) -> "Measured":
        """In another unit, or with the sign turned."""
        low, high = (None if end is None else end * factor for end in (self.low, self.high))
        ends = (high, low) if factor < 0.0 else (low, high)
        return replace(self, value=None if self.value is None else self.value * factor, low=ends[0], high=ends[1])


@dataclass(frozen=True)
class Listing:
    """A rectangular listing.

    Attributes:
        columns: headings; snake_case for programs.
        rows: a cell holds text, a number, a truth value, None, or for people an `Measured`.
        bold: the cells to stress, by row and column.
        texts: how the values of a column read, by its heading; as `cell_text` if it is not there.
        title: above it, for people.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    bold: frozenset[tuple[int, int]] = frozenset()
    texts: Mapping[str, Text] = field(default_factory=dict)
    title: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"A row of {len(row)} cells does not fit the {len(self.columns)} columns.")

    def records(self) -> list[dict[str, Any]]:
        """One dictionary per row of plain values; a number that is not finite becomes None, as JSON cannot hold it."""
        return [dict(zip(self.columns, map(_plain, row), strict=True)) for row in self.rows]

    def reading(self) -> list[list[str]]:
        """The cells as they read."""
        texts = [self.texts.get(name, cell_text) for name in self.columns]
        return [
            ["" if cell is None else visible(text(cell)) for text, cell in zip(texts, row, strict=True)]
            for row in self.rows
        ]

    @property
    def headings(self) -> list[str]:
        """The headings as they read."""
        return [visible(name).replace("\n", " ") for name in self.columns]

    @property
    def are_numbers(self) -> list[bool]:
        """Whether a column holds numbers, which stand to the right."""
        return [
            any(isinstance(row[place], int | float | Measured) for row in self.rows)
            for place in range(len(self.columns))
        ]


def listing_of(kind: type[Any], rows: Iterable[Any]) -> Listing:
    """Dataclass objects as a listing for programs, with a column for each field."""
    names = tuple(item.name for item in fields(kind))
    return Listing(names, tuple(tuple(asdict(row).values()) for row in rows))


def listing_by(columns: Mapping[str, Callable[[Any], Any]], items: Iterable[Any]) -> Listing:
    """A listing for programs: a row for each item, with what each column takes of it."""
    return Listing(tuple(columns), tuple(tuple(take(item) for take in columns.values()) for item in items))


def cell_text(value: Any) -> str:
    """A cell as a person reads it: four significant digits, but all of a whole number; an empty cell for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        is_count = value.is_integer() and 1e4 <= abs(value) < 1e15  # above, .4g gives an exponent, as in 1.593e+05
        return f"{value:.0f}" if is_count else f"{value:z.4g}"
    return estimate_text(value) if isinstance(value, Measured) else visible(str(value))


def estimate_text(found: Measured) -> str:
    """For example `0.182 ± 0.043 ‡ (n=2 of 3)`, `0.85 (0.80 to 0.91)`, or without a value `no score (n=0 of 3)`.

    Digits go as far as the interval supports them.
    """
    number, *notes = (number_text(found), *found.notes) if found.value is not None else found.notes
    words = [number, found.marks, f"({', '.join(notes)})" if notes else ""]
    return " ".join(filter(None, words))


def number_text(found: Measured, sign: str = " ± ") -> str:
    """Its number with the interval alone."""
    if found.value is None:
        return ""
    decimals = found.decimals
    half = found.half_width
    if decimals is None:
        return cell_text(found.value) + (f"{sign}{half:.2g}" if half else "")
    numbers = [found.value, half] if half is not None else [found.value, found.low, found.high]
    value, *ends = (f"{round(number or 0.0, decimals):z.{max(decimals, 0)}f}" for number in numbers)
    return f"{value}{sign}{ends[0]}" if half is not None else f"{value} ({ends[0]} to {ends[1]})"


def percent(share: float) -> str:
    """A share as a person reads it."""
    return f"{share:.0%}"


def to_json(value: Any, *, only_ascii: bool = False) -> str:
    """Indented JSON text of plain data; keys keep their order, NaN is refused."""
    return in_json(json.dumps(value, indent=2, allow_nan=False, ensure_ascii=only_ascii))


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
    """A Markdown table; pipes, line breaks and HTML inside cells and headings are escaped."""
    lines = [_markdown_line(listing.headings), "|" + " --- |" * len(listing.columns)]
    for number, texts in enumerate(listing.reading()):
        stressed = [f"**{text}**" if (number, i) in listing.bold else text for i, text in enumerate(texts)]
        lines.append(_markdown_line(stressed))
    return "\n".join(lines)


def _markdown_line(cells: Sequence[str]) -> str:
    escaped = (in_markdown(cell).replace("\\|", "\\\\|").replace("|", "\\|").replace("\n", " ") for cell in cells)
    return "| " + " | ".join(escaped) + " |"


def flattened(listing: Listing) -> Listing:
    """With a column for each entry of cells that hold dictionaries, as CSV needs it: `bodies.panda`."""
    columns: dict[str, list[Any]] = {}
    for name, *cells in zip(listing.columns, *listing.rows, strict=True):
        keys = dict.fromkeys(key for cell in cells if isinstance(cell, dict) for key in cell)
        if keys:
            columns |= {f"{name}.{key}": [(cell or {}).get(key) for cell in cells] for key in keys}
        else:
            columns[name] = cells
    return Listing(tuple(columns), tuple(zip(*columns.values(), strict=True)))


def _csv_cell(value: Any) -> Any:
    plain = value if isinstance(value, float) else _plain(value)
    return "" if plain is None else in_csv(plain) if isinstance(plain, str) else plain


def _plain(value: Any) -> Any:
    """A value as JSON takes it.

    Raises:
        TypeError: it is for people, as an estimate is.
    """
    if isinstance(value, Measured):
        raise TypeError(f"{value} is for people, and programs need its numbers one by one.")
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value if value is None or isinstance(value, bool | int) else str(value)
