"""Leaderboards as files: published into a folder, and compared there with pages generated from their exports."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from zoobench.errors import UsageError, reason
from zoobench.files import replace_files
from zoobench.report.leaderboard import Leaderboard
from zoobench.report.leaderboard_export import from_text
from zoobench.report.leaderboard_pages import first_difference, pages
from zoobench.report.undecided import OrdersOf

INDEX = "index.html"
"""The report of a folder's leaderboards."""


def index_command(folder: Path) -> str:
    """The command that writes the report of a folder."""
    return f"zoobench report --from {folder} --output {folder / INDEX}"


@dataclass(frozen=True)
class Publication:
    """A leaderboard that was written.

    Attributes:
        paths: the export and the pages made from it.
        left_out: number of runs of the earlier export that the suite does not ask for any more.
    """

    paths: tuple[Path, ...]
    left_out: int


def publish(board: Leaderboard, folder: Path, orders_of: OrdersOf) -> Publication:
    """Write the export and the pages made from it; runs that only the folder's export has stay in it.

    So a leaderboard grows over machines and databases: a run's key holds every setting and version, and its attempts
    say where it was made.

    Raises:
        UsageError: the folder cannot be written, or holds something else by that name.
    """
    export = folder / f"{board.name}.json"
    left_out = 0
    if export.exists():
        earlier = from_text(_content(export), str(export))
        left_out = len(board.unasked(earlier))
        board = board.completed(earlier)
    return Publication(write(board, folder, orders_of), left_out)


def write(board: Leaderboard, folder: Path, orders_of: OrdersOf) -> tuple[Path, ...]:
    """Write the export of a leaderboard and the pages made from it in place of those that the folder has; their paths.

    Raises:
        UsageError: the folder cannot be written.
    """
    written = {folder / f"{board.name}{ending}": text.encode() for ending, text in pages(board, orders_of).items()}
    try:
        replace_files(written, make_folders=True)
    except OSError as error:
        raise UsageError(
            f"Cannot write a leaderboard into {str(folder)!r}: {reason(error)}. Give another folder."
        ) from None
    return tuple(written)


def read_export(folder: Path, name: str) -> Leaderboard:
    """The leaderboard of this name in a folder.

    Raises:
        UsageError: there is none, or it cannot be read.
    """
    found = {path.stem: path for path in exports_of(folder)}
    if name not in found:
        raise UsageError(f"There is no export {name}.json in {str(folder)!r}. Choose from {', '.join(found)}.")
    return from_text(_content(found[name]), str(found[name]))


def rebuild(folder: Path, orders_of: OrdersOf) -> list[Path]:
    """Write every page of a folder anew from its export; the paths of those that were not so.

    Raises:
        UsageError: there is no export, one cannot be read, or a page cannot be written.
    """
    boards = {path: from_text(_content(path), str(path)) for path in exports_of(folder)}
    made = {
        path.with_suffix(ending): text
        for path, board in boards.items()
        for ending, text in pages(board, orders_of).items()
    }
    changed = {path: text for path, text in made.items() if not path.exists() or _content(path) != text}
    try:
        replace_files({path: text.encode() for path, text in changed.items()})
    except OSError as error:
        raise UsageError(f"Cannot write the pages of {str(folder)!r}: {reason(error)}.") from None
    return list(changed)


def read_exports(folder: Path) -> tuple[list[Leaderboard], str]:
    """The leaderboards of a folder, and a mark that changes with any of their exports.

    Raises:
        UsageError: there is no export, or one cannot be read.
    """
    texts = {path: _content(path) for path in exports_of(folder)}
    digest = sha256("\0".join(f"{path.name}\0{text}" for path, text in texts.items()).encode())
    return [from_text(text, str(path)) for path, text in texts.items()], f"exports {digest.hexdigest()}"


def is_behind(folder: Path) -> bool:
    """Whether the folder has a report that was made from other exports.

    It is not made anew for a comparison: it holds a library, whose version may be another.
    """
    index = folder / INDEX
    return index.exists() and read_exports(folder)[1] not in _content(index)


def exports_of(folder: Path) -> list[Path]:
    """The exports of a folder, sorted by name.

    Raises:
        UsageError: there is none.
    """
    found = sorted(folder.glob("*.json"))
    if not found:
        raise UsageError(
            f"There is no export (*.json) in {str(folder)!r}. `zoobench leaderboard publish SUITE DIR` writes one."
        )
    return found


def differences(folder: Path, orders_of: OrdersOf) -> list[str]:
    """The differences between the pages of a folder and those rebuilt from its exports, byte for byte.

    A report in their folder (`INDEX`) must have been made from the same exports. Of every other file the first
    differing line; a page or an export that is missing is a difference too.

    Raises:
        UsageError: there is no export, or one cannot be read.
    """
    exports = exports_of(folder)
    alone = sorted(path for path in folder.glob("*.csv") if path.with_suffix(".json") not in exports)
    found = [difference for path in exports for difference in _of_export(path, orders_of)]
    if is_behind(folder):
        found.append(f"{folder / INDEX} was made from other exports; `{index_command(folder)}` writes it anew")
    return [*found, *(f"{page} has no export {page.with_suffix('.json').name}" for page in alone)]


def _of_export(export: Path, orders_of: OrdersOf) -> list[str]:
    found = []
    for ending, rebuilt in pages(from_text(_content(export), str(export)), orders_of).items():
        page = export.with_suffix(ending)
        if not page.exists():
            found.append(f"{page} is missing")
        elif difference := first_difference(_content(page), rebuilt):
            line, old, new = difference
            column = next((place for place, (a, b) in enumerate(zip(old or "", new or "", strict=False)) if a != b), 0)
            found.append(
                f"{page}, line {line} differs: there is {_around(old, column)}, from the export {_around(new, column)}"
            )
    return found


def _content(path: Path) -> str:
    try:
        return path.read_bytes().decode()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"Cannot read {str(path)!r}: {reason(error)}.") from None


def _around(line: str | None, column: int) -> str:
    """The part of a line, which may be very long, around a column."""
    if line is None:
        return "nothing any more"
    first, last = max(column - 30, 0), column + 60
    return repr("..." * (first > 0) + line[first:last] + "..." * (last < len(line)))
