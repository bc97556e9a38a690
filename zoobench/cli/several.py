"""Tables of dataclass objects, one or several from one command."""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, fields
from typing import TYPE_CHECKING, Any

from zoobench.cli.output import Format, emit
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from zoobench.report.listing import Listing


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


def listing_of(kind: type[Any], rows: Sequence[Any]) -> "Listing":
    """Dataclass objects as a listing, a column for each field; those of no field stay out."""
    from zoobench.report.listing import Listing

    return Listing(tuple(field.name for field in fields(kind)), tuple(astuple(row) for row in rows))


def emit_several(listings: Mapping[str, "Listing"], form: Format) -> None:
    """Print tables below each other; in JSON one object with a list for each, or the list alone if there is one."""
    if form is Format.JSON and len(listings) > 1:
        records = {name: listing.records() for name, listing in listings.items()}
        emit(next(iter(listings.values())), form, records=records)
        return
    for number, listing in enumerate(listings.values()):
        if number:
            print()
        emit(listing, form)
