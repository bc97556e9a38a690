"""`zoobench table --suite`, `--publish` and `--check`: leaderboards, from a database to committed files and back."""

from pathlib import Path
from typing import TYPE_CHECKING

from typer import Exit

from zoobench.cli.output import say
from zoobench.errors import UsageError
from zoobench.files import replace_files

if TYPE_CHECKING:
    from zoobench.report.leaderboard import Leaderboard


def board_of(suite: str, db: str) -> "Leaderboard":
    """What a database knows of a suite.

    Raises:
        UsageError: there is no such suite, or it is for smoke runs only.
        StorageError: the database cannot be read.
    """
    from zoobench.db.store import Store
    from zoobench.harness import suites
    from zoobench.harness.grid import Skip
    from zoobench.report.leaderboard import gather

    found = suites.load(suite)
    asked = [(cell.spec, cell.reason) if isinstance(cell, Skip) else (cell, None) for cell in found.cells]
    with Store(db, create=False) as store:
        return gather(store, found.name, found.source, found.summary, asked)


def publish(board: "Leaderboard", folder: Path) -> None:
    """Write the export and the pages made from it; runs that only the folder's export knows stay in it.

    So a leaderboard grows over machines and databases: a run's key holds every setting and version, and its attempts
    say where it was made.

    Raises:
        UsageError: the folder cannot be written, or holds something else by that name.
    """
    from zoobench.report.leaderboard import from_text
    from zoobench.report.leaderboard_pages import pages

    export = folder / f"{board.name}.json"
    if export.exists():
        earlier = from_text(_content(export), str(export))
        if count := len(board.unasked(earlier)):
            runs = "1 run" if count == 1 else f"{count:,} runs"
            say(f"Left out: {runs} of the earlier export, which the suite does not ask for any more")
        board = board.completed(earlier)
    written = {folder / f"{board.name}{ending}": text.encode() for ending, text in pages(board).items()}
    try:
        replace_files(written, make_folders=True)
    except OSError as error:
        raise UsageError(f"Cannot write a leaderboard into {str(folder)!r}: {error}.") from None
    for path in written:
        say(f"Written: {path}")


def check(folder: Path) -> None:
    """Rebuild every page from its export and compare byte for byte.

    Raises:
        Exit: code 1 if something differs; the first differing line of every file is told.
        UsageError: there is no export, or one cannot be read.
    """
    exports = sorted(folder.glob("*.json"))
    if not exports:
        raise UsageError(
            f"There is no export (*.json) in {str(folder)!r}. `zoobench table --suite NAME --publish DIR` writes one."
        )
    differences = [difference for path in exports for difference in _differences(path)]
    for page in sorted(path for path in folder.glob("*.csv") if path.with_suffix(".json") not in exports):
        differences.append(f"{page} has no export {page.with_suffix('.json').name}")
    for difference in differences:
        say(difference)
    if differences:
        raise Exit(1)
    say(f"Every page is what its export makes of it: {', '.join(path.stem for path in exports)}")


def _differences(export: Path) -> list[str]:
    """What is wrong with the pages of an export, and with its own form."""
    from zoobench.report.leaderboard import from_text
    from zoobench.report.leaderboard_pages import first_difference, pages

    found = []
    for ending, rebuilt in pages(from_text(_content(export), str(export))).items():
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
        raise UsageError(f"Cannot read {str(path)!r}: {error}.") from None


def _around(line: str | None, column: int) -> str:
    """What a person needs to see of a line that may be very long."""
    if line is None:
        return "nothing any more"
    first, last = max(column - 30, 0), column + 60
    return repr("..." * (first > 0) + line[first:last] + "..." * (last < len(line)))
