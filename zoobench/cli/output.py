"""Output of commands: data on standard output, messages on standard error."""

import io
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

from zoobench.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from zoobench.report.listing import Listing

_GAP = 3  # blanks between columns
_INDENT = 4  # blanks before the continuation lines of a row
_UNLIMITED = 10_000  # columns; off a terminal nothing is folded or cut


class Format(StrEnum):
    """The form in which a listing is printed."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"
    MD = "md"
    LATEX = "latex"


def say(text: str) -> None:
    """Print a message on standard error."""
    from zoobench.report.foreign_text import visible

    print(visible(text), file=sys.stderr, flush=True)


def print_text(text: str) -> None:
    """Print text on standard output in which others may have had a hand."""
    from zoobench.report.foreign_text import visible

    print(visible(text))


def replace_unknown_signs() -> None:
    """Let standard output replace characters that its encoding lacks, as on a terminal with code page 1252."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")


def emit(listing: "Listing", form: Format, *, programs: "Listing | None" = None) -> None:
    """Print a listing with its title, or `programs` in the formats for programs."""
    from zoobench.report.listing import csv_lines, flattened

    if form is Format.JSON:
        emit_json((programs or listing).records())
    elif form is Format.CSV:
        found = flattened(programs or listing)
        for line in csv_lines(found.columns, found.rows):
            print(line)
    else:
        _print_for_people(listing, form)


def emit_json(value: Any) -> None:
    """Print plain data as JSON, with escapes for characters that the stream cannot show."""
    from zoobench.report.listing import to_json

    text = to_json(value)
    encoding = sys.stdout.encoding or "utf-8"
    print(text if text.encode(encoding, "replace").decode(encoding) == text else to_json(value, only_ascii=True))


def _print_for_people(listing: "Listing", form: Format) -> None:
    from zoobench.report.foreign_text import in_markdown
    from zoobench.report.latex import PREAMBLE, to_latex
    from zoobench.report.listing import to_markdown

    if form is Format.LATEX:
        print(f"{PREAMBLE}\n{to_latex(listing, caption=listing.title)}")
        return
    if listing.title:
        print_text(f"### {in_markdown(listing.title)}\n" if form is Format.MD else f"{listing.title}\n")
    if form is Format.MD:
        print(to_markdown(listing))
    else:
        _print_table(listing)


def choose(name: str, all_names: Sequence[str], form: Format) -> list[str]:
    """The tables to print for `--table name`, `all` of them included.

    Raises:
        UsageError: an unknown name, or several tables as CSV.
    """
    if name != "all" and name not in all_names:
        raise UsageError(f"There is no table {name!r}. Choose one of {', '.join(all_names)}, or all.")
    if form is Format.CSV and name == "all":
        raise UsageError(
            f"CSV holds one table and all were asked for. Choose one with --table: {', '.join(all_names)}."
        )
    return list(all_names) if name == "all" else [name]


def emit_several(listings: "Mapping[str, Listing]", form: Format) -> None:
    """Print tables below each other; in JSON one object with a list for each, or the list alone if there is one."""
    if form is Format.JSON and len(listings) > 1:
        emit_json({name: listing.records() for name, listing in listings.items()})
        return
    for number, listing in enumerate(listings.values()):
        emit_next(listing, form, is_first=not number)


def emit_next(listing: "Listing", form: Format, *, is_first: bool) -> None:
    """Print one of several tables at once, below those before it."""
    if not is_first:
        print()
    emit(listing, form)
    sys.stdout.flush()


def _print_table(listing: "Listing") -> None:
    out = console()
    drawn = rich_table(listing) if out.is_terminal else None
    if drawn is None or out.measure(drawn, options=out.options.update(max_width=_UNLIMITED)).minimum > out.width:
        for line in plain_lines(listing, out.width):
            print(line)
        return
    with out.capture() as captured:
        out.print(drawn)
    for line in captured.get().splitlines():
        print(line.rstrip())


def plain_lines(listing: "Listing", limit: int = _UNLIMITED) -> Iterator[str]:
    """The lines that `rich_table` gives where nothing is folded or styled, for listings of any length.

    A row longer than `limit` goes on in the line below, indented, with the column that does not fit any more; a text
    that fits no line is folded between its words. Bold cells have a star, as bold cannot be seen.
    """
    reading = listing.reading()
    for number, place in listing.bold:
        reading[number][place] += " *"
    columns = range(len(listing.columns))
    distinct = [{row[place] for row in reading} for place in columns]  # most of very many rows are equal
    folds = [{text: _folded(text, limit - _INDENT) for text in texts} for texts in distinct]
    widths = [
        max([_width(heading), *(_width(line) for lines in found.values() for line in lines)])
        for heading, found in zip(listing.headings, folds, strict=True)
    ]
    groups = _groups(widths, limit)
    are_numbers = listing.are_numbers

    def padded(text: str, place: int) -> str:
        room = " " * (widths[place] - _width(text))
        return room + text if are_numbers[place] else text + room

    def lines_of(row: Sequence[Sequence[str]]) -> Iterator[str]:
        for group in groups:
            for parts in zip_longest(*(row[place] for place in group), fillvalue=""):
                line = (" " * _GAP).join(map(padded, parts, group)).rstrip()
                if group is groups[0]:
                    yield line
                elif line:
                    yield " " * _INDENT + line

    yield from lines_of([[heading] for heading in listing.headings])
    yield _rule() * min(limit, sum(widths) + _GAP * (len(widths) - 1))
    for row in reading:
        yield from lines_of([folds[place][row[place]] for place in columns])


def _width(text: str) -> int:
    """How wide a text is on a terminal."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len

    return cell_len(text)


def _rule() -> str:
    """The sign of a horizontal line that standard output can show."""
    try:
        "─".encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        return "-"
    return "─"


def _folded(text: str, width: int) -> list[str]:
    """The lines of a text, folded between words where they are wider."""
    from textwrap import wrap

    return [part for line in text.split("\n") for part in (wrap(line, width) if len(line) > width else [line])]


def _groups(widths: Sequence[int], limit: int) -> list[list[int]]:
    """Places of the columns that stand in one line; lines after the first are indented."""
    groups: list[list[int]] = []
    room = -1
    for place, width in enumerate(widths):
        if width > room:
            room = limit - _INDENT * bool(groups)
            groups.append([])
        groups[-1].append(place)
        room -= width + _GAP
    return groups


def emit_facts(facts: Iterable[tuple[str, str]]) -> None:
    """Print named facts below each other, the names aligned."""
    pairs = list(facts)
    width = max((len(name) for name, _ in pairs), default=0)
    for name, text in pairs:
        print_text(f"{name:<{width}}  {text}".rstrip())


def console(*, stderr: bool = False) -> "Console":
    """A Rich console that folds to a terminal's width and leaves lines whole elsewhere."""
    from rich.console import Console

    found = Console(stderr=stderr, highlight=False, markup=False, emoji=False)
    if not found.is_terminal:
        found.width = _UNLIMITED
    return found


def rich_table(listing: "Listing") -> "Table":
    """The listing as a Rich table: numbers to the right, the bold cells bold."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for heading, is_number in zip(listing.headings, listing.are_numbers, strict=True):
        table.add_column(Text(heading), justify="right" if is_number else "left")
    for number, row in enumerate(listing.reading()):
        styles = ["bold" if (number, place) in listing.bold else "" for place in range(len(row))]
        table.add_row(*(Text(text, style) for text, style in zip(row, styles, strict=True)))
    return table
