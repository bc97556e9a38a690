"""Listings as a paper takes them: LaTeX tables for the packages booktabs and siunitx."""

import re
from collections.abc import Iterable, Sequence

from zoobench.report.foreign_text import visible
from zoobench.report.listing import Listing, Measured, cell_text, number_text

PREAMBLE = "% in the preamble: \\usepackage{booktabs,siunitx}"

_LATEX = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\n": " ",
    "±": r"$\pm$", "†": r"\dag{}", "‡": r"\ddag{}", "§": r"\S{}", "¶": r"\P{}", "‖": r"$\Vert$", "→": r"$\to$",
    "°": r"\textdegree{}", "<": r"\textless{}", ">": r"\textgreater{}", **{sign: f"\\{sign}" for sign in "&%$#_{}"},
}  # fmt: skip
_NUMBER = re.compile(r"-?\d+(\.\d+)?")


def latex_text(text: str) -> str:
    """The text with everything that means something to LaTeX escaped."""
    return "".join(_LATEX.get(sign, sign) for sign in visible(text))


def to_latex(listing: Listing, *, caption: str = "", label: str = "") -> str:
    """A table with its caption and label, or without both the tabular alone.

    Numbers stand in columns of siunitx, aligned at the decimal marker; bold cells are bold.
    """
    lines = _tabular(listing)
    if not caption and not label:
        return "\n".join(lines)
    begin = [r"\begin{table}", r"\centering"]
    begin += [f"\\caption{{{latex_text(caption)}}}"] if caption else []
    begin += [f"\\label{{{label}}}"] if label else []
    return "\n".join([*begin, *lines, r"\end{table}"])


def _tabular(listing: Listing) -> list[str]:
    columns = range(len(listing.columns))
    reading = listing.reading()
    numeric = [listing.columns[place] not in listing.texts and listing.are_numbers[place] for place in columns]
    cells = [[_cell(row[place], texts[place], numeric[place]) for place in columns]
             for row, texts in zip(listing.rows, reading, strict=True)]  # fmt: skip
    kinds = [_kind([row[place] for row in listing.rows], is_number) for place, is_number in enumerate(numeric)]
    heads = [f"{{{latex_text(name)}}}" if is_number else latex_text(name)
             for name, is_number in zip(listing.columns, numeric, strict=True)]  # fmt: skip
    lines = [f"\\begin{{tabular}}{{{' '.join(kinds)}}}", r"\toprule", _line(heads), r"\midrule"]
    for number, row in enumerate(cells):
        lines.append(_line(_stressed(text, numeric[place]) if (number, place) in listing.bold else text
                           for place, text in enumerate(row)))  # fmt: skip
    return [*lines, r"\bottomrule", r"\end{tabular}"]


def _cell(value: object, text: str, is_number: bool) -> str:
    """A cell; in a column of numbers other text stands in braces, and marks and notes behind the number."""
    if not is_number:
        return latex_text(text)
    number = _number(value)
    if number is None:
        return f"{{{latex_text(text)}}}" if text else ""
    return number + _behind(value)


def _behind(value: object) -> str:
    """The marks and notes of a number."""
    if not isinstance(value, Measured):
        return ""
    marks = f"\\textsuperscript{{{latex_text(value.marks.replace(' ', ''))}}}" if value.marks else ""
    notes = f"{{\\scriptsize~({latex_text(', '.join(value.notes))})}}" if value.notes else ""
    return marks + notes


def _number(value: object) -> str | None:
    """A number as siunitx reads it, with its uncertainty; None for other text, or an uneven interval."""
    if isinstance(value, Measured) and value.decimals is not None and value.half_width is None:
        return None
    if isinstance(value, Measured):
        return number_text(value, r" \pm ") or None
    return cell_text(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _kind(values: Sequence[object], is_number: bool) -> str:
    """The kind of a column: text, or numbers of so many digits before and behind the decimal marker."""
    if not is_number:
        return "l"
    numbers = [[part.split(".") for part in text.split(r" \pm ")] for value in values if (text := _number(value))]
    if not numbers or not all(_NUMBER.fullmatch(".".join(part)) for number in numbers for part in number):
        return "S"
    whole = max(len(number[0][0].lstrip("-")) for number in numbers)
    places = max(len(part[1]) if len(part) > 1 else 0 for number in numbers for part in number)
    sign = "-" if any(number[0][0].startswith("-") for number in numbers) else ""
    ends = [len("".join(number[1]).lstrip("0") or "0") for number in numbers if len(number) > 1]
    spread = f"({max(ends)})" if ends else ""
    point = f"{whole}.{places}" if places else f"{whole}"
    uncertain = ", separate-uncertainty = true" if ends else ""
    behind = max((_behind(value) for value in values if _number(value)), key=len)
    room = f", table-space-text-post = {{{behind}}}" if behind else ""
    return f"S[table-format = {sign}{point}{spread}{uncertain}{room}, detect-weight, mode = text]"


def _stressed(text: str, is_number: bool) -> str:
    return f"\\bfseries {text}" if is_number else f"\\textbf{{{text}}}"


def _line(cells: Iterable[str]) -> str:
    return " & ".join(cells) + r" \\"
