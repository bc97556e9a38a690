"""How a paper wants a table: which columns, under which names, in which units."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from zoobench.errors import UnknownNameError, UsageError
from zoobench.report.listing import Listing, Measured
from zoobench.report.tables import Table
from zoobench.report.units import check_units, in_units

_SIGNS = " †¶"  # of footnotes at names


@dataclass(frozen=True)
class Look:
    """The wishes for tables.

    Attributes:
        columns: the headings to show, without units, in their order; empty for all.
        names: other words for headings and components, by the words that are there.
        units: in which scores are shown, each where it fits.
        caption, label: of a LaTeX table; if none is given, the title and no label.
    """

    columns: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    caption: str = ""
    label: str = ""

    @classmethod
    def of(cls, columns: str, names: Iterable[str], units: str, caption: str, label: str) -> "Look":
        """Wishes as they are typed: `env,cmaes`, `lion=Lion (ours)` each, `mm/s,mm`.

        Raises:
            UsageError: a new name that is not written so, or a label that LaTeX does not take.
        """
        renamed = new_names(names)
        if any(sign in label for sign in "\\{}%#~^&$, \n"):
            raise UsageError(f"{label!r} is no label of LaTeX. Give letters, digits and signs as in tab:speeds.")
        return cls(words(columns), renamed, words(units), caption, label)

    def options(self) -> list[str]:
        """The command line options that ask for it."""
        texts = {"--columns": ",".join(self.columns), "--unit": ",".join(self.units), "--caption": self.caption}
        names = [word for old, new in self.names.items() for word in ("--rename", f"{old}={new}")]
        wanted = {name: text for name, text in {**texts, "--label": self.label}.items() if text}
        return [*(word for pair in wanted.items() for word in pair), *names]

    def check(self, shown: Sequence[tuple[Table, Listing]]) -> None:
        """Check that every wish fits some of the tables of one quantity, which are given with their listings.

        Raises:
            UsageError: a column, name or unit is not there.
        """
        if not shown:
            return
        headings = {_bare(name): None for _, listing in shown for name in listing.columns}
        cells = {_bare(cell) for _, each in shown for row in each.rows for cell in row if isinstance(cell, str)}
        for name in self.columns:
            if name not in headings:
                raise UnknownNameError("column", name, headings)
        for name in self.names:
            if name not in cells | headings.keys():
                raise UnknownNameError("name in the table:", name, cells | headings.keys())
        check_units(self.units, {table.quantity.unit for table, _ in shown if table.quantity is not None})

    def in_units(self, table: Table) -> tuple[Table, float]:
        """A table of one quantity with the unit that is wished, and the factor of its numbers."""
        if table.quantity is None:
            return table, 1.0
        quantity, factor = in_units(table.quantity, self.units)
        return replace(table, quantity=quantity), factor

    def apply(self, listing: Listing, factor: float = 1.0) -> Listing:
        """The listing with its numbers multiplied, its columns chosen and everything renamed."""
        kept = [place for place, name in enumerate(listing.columns) if not self.columns or _bare(name) in self.columns]
        if self.columns:
            kept.sort(key=lambda place: self.columns.index(_bare(listing.columns[place])))
        rows = tuple(tuple(self._cell(row[place], factor) for place in kept) for row in listing.rows)
        bold = {(row, kept.index(place)) for row, place in listing.bold if place in kept}
        texts = {self._name(name): text for name, text in listing.texts.items()}
        columns = tuple(self._name(listing.columns[place]) for place in kept)
        return replace(listing, columns=columns, rows=rows, bold=frozenset(bold), texts=texts)

    def _cell(self, cell: object, factor: float) -> object:
        if isinstance(cell, Measured):
            return cell.scaled(factor)
        return self._name(cell) if isinstance(cell, str) else cell

    def _name(self, text: str) -> str:
        """Another word for a name, whose signs and unit stay."""
        bare = _bare(text)
        return self.names[bare] + text.removeprefix(bare) if bare in self.names else text


def new_names(texts: Iterable[str]) -> dict[str, str]:
    """Other words by the words that are there, as they are typed: `lion=Lion (ours)` each.

    Raises:
        UsageError: one is not written so.
    """
    pairs = [text.partition("=") for text in texts]
    if bad := [old for old, sign, new in pairs if not (old and sign and new)]:
        raise UsageError(f"Cannot read --rename {bad[0]!r}. Write --rename lion='Lion (ours)'.")
    return {old: new for old, _, new in pairs}


def words(text: str) -> tuple[str, ...]:
    """The words of a text between commas."""
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _bare(heading: str) -> str:
    """A heading without its unit and footnotes."""
    name, bracket, unit = heading.rpartition(" [")
    return (name if bracket and unit.endswith("]") else heading).rstrip(_SIGNS)
