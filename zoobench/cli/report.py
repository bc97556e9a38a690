"""`zoobench report`: results as one page for a browser."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, selection, takes
from zoobench.cli.output import say
from zoobench.errors import UsageError, reason
from zoobench.spec import FRAME_SECONDS, RunSelection

if TYPE_CHECKING:
    from zoobench.report.page.sections import Section, Still
    from zoobench.report.run_results import RunResult
    from zoobench.spec import Ref


_FILM_EVERY = 2  # control frames to a picture of a film


@takes(selection)
def report(
    chosen: RunSelection,
    output: Annotated[Path, Option("--output", "-o", help="Output file, ending in .html.")] = Path("report.html"),
    source: Annotated[
        Path | None, Option("--from", help="Read a folder of leaderboards instead of the database.")
    ] = None,
    stills: Annotated[
        int, Option("--stills", min=0, help="Number of the best robots to simulate again and show as stills.")
    ] = 0,
    films: Annotated[
        int, Option("--films", min=0, help="Number of the best robots to show as films of about 100 kB each.")
    ] = 0,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write the results as one HTML page.

    The page has tables that sort and filter, a comparison of the methods over all rows, learning curves, scores over
    cost, failures and provenance, with the command that repeats each row. It needs no network. Smoke runs are left
    out, and so are rows beyond the first 200 or beyond 2,500 runs. Needs the extra `report`; stills and films also need
    `render`.
    """
    from zoobench.accuracy.levels import published
    from zoobench.accuracy.tolerance import error_at
    from zoobench.files import replace_files
    from zoobench.report.page.html import check_tools, page
    from zoobench.report.page.sections import Level

    if output.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"{str(output)!r} does not end in .html, the format of the report. Choose such a name.")
    check_tools()
    if source is not None and chosen != RunSelection():
        raise UsageError("--from shows whole leaderboards. Leave out the options that select runs of a database.")
    if stills or films:
        from zoobench.render.canvas import check_drawing  # loads the simulator

        check_drawing()
    mark = ""
    if source is None:
        sections = [_database_section(db, chosen, output, stills, films)]
        command = sections[0].foot.command
    else:
        sections, mark = _leaderboards(source, stills, films)
        flags = "".join(f" {word}" for word in _flags(stills, films))
        command = f"zoobench report --from {source.name}{flags} --output {source.name}/{output.name}"
    levels = [
        Level(level.env, level.task, level.fidelity, level.error, level.seconds)
        for level in published().levels
        if level.error is not None and level.seconds is not None
    ]
    text = page(sections, levels, error_at, command, mark)
    try:
        replace_files({output: text.encode()}, make_folders=True)
    except OSError as error:
        raise UsageError(
            f"The report cannot be written to {str(output)!r}: {reason(error)}. Give another -o."
        ) from None
    for section in sections:
        if section.left_out:
            say(f"Left out: {section.left_out:,} rows of {section.name}. Select rows with --env, --task and so on.")
    say(f"Written: {output}, {len(text.encode()) / 2**20:.1f} MiB")


def _database_section(db: str, chosen: RunSelection, output: Path, stills: int, films: int) -> "Section":
    """The chosen runs of a database.

    Raises:
        UsageError: there is nothing to show.
        StorageError: the database cannot be read.
    """
    from dataclasses import replace

    from zoobench.accuracy.tolerance import orders
    from zoobench.db.store import Store
    from zoobench.harness.starts import solution_of
    from zoobench.report.cells import read_cells
    from zoobench.report.equal_costs import with_early_winners
    from zoobench.report.footer import footer
    from zoobench.report.learning_curves import curves
    from zoobench.report.page.sections import Section, best_runs, fitted, runs_in
    from zoobench.report.run_results import results_of
    from zoobench.report.tables import tables_of_cells
    from zoobench.report.undecided import footnotes, mark_undecided

    with Store(db, create=False) as store:
        cells = read_cells(store, chosen)
        tables, left_out = fitted(tables_of_cells(cells))
        tables = mark_undecided(with_early_winners(store, tables), orders)
        if not tables:
            raise UsageError("No finished run to show yet. Try: zoobench run --env desert --task turning")
        results = results_of(store, runs_in(tables, cells))
        origins = store.origins([run for table in tables for run in table.runs])
        command = ["zoobench", "report", *chosen.options(), *_flags(stills, films)]
        foot = replace(
            footer(tables, origins, [*command, "--output", output.name]), undecided=footnotes(tables, orders)
        )
        known = curves(store, results, "substeps")
        section = Section("Results", "", tables, results, 0, foot, known, left_out=left_out)
        best = best_runs(section)[: max(stills, films)]
        robots = ((f"run {each.run.id}: ", each, solution_of(store, each.run)) for each in best)
        return replace(section, stills=_stills(robots, films))


def _flags(stills: int, films: int) -> list[str]:
    pictures = {"--stills": stills, "--films": films}
    return [word for name, count in pictures.items() if count for word in (name, str(count))]


def _stills(robots: "Iterable[tuple[str, RunResult, tuple[float, ...]]]", films: int) -> "list[Still]":
    """Pictures of the best episodes of runs, given with the beginning of a title and a solution; of the first films."""
    found = (_still(*robot, moves=number < films) for number, robot in enumerate(robots))
    return [still for still in found if still is not None]


def _still(begin: str, result: "RunResult", params: tuple[float, ...], *, moves: bool) -> "Still | None":
    """A picture or a film of a run's best episode, simulated again; None, and a word, where this version cannot."""
    from zoobench.errors import ZoobenchError
    from zoobench.render.film import film
    from zoobench.render.film_files import CLIP_RATE, clip, sheet, sheet_moments
    from zoobench.report.page.sections import Still

    run, score = result.run, result.finals["score"]
    title = f"{begin}{run.spec}, score {score.value:.4g} {score.unit}"
    if moves:
        title += f", slowed {1.0 / (CLIP_RATE * _FILM_EVERY * FRAME_SECONDS):.2g} times"
    say(f"simulating {title}")
    try:
        frames = run.spec.frames
        moments = range(0, frames + 1, _FILM_EVERY) if moves else sheet_moments(frames)
        episode = film(run.spec, params, moments=moments)
    except ZoobenchError as error:
        say(f"  left out: {error}")
        return None
    if not moves:
        return Still(title, sheet(episode))
    moving, middle = clip(episode)
    say(f"  film of {len(moving) / 1000:.0f} kB")
    return Still(title, middle, moving)


def _leaderboards(folder: Path, stills: int, films: int) -> "tuple[list[Section], str]":
    """The leaderboards of a folder, the fullest first, with so many robots of each, and the mark of their exports.

    A robot is the best in the first task of an environment, on the fullest board that has it.
    """
    from dataclasses import replace

    from zoobench.accuracy.tolerance import orders
    from zoobench.report.leaderboard_files import read_exports
    from zoobench.report.page.sections import best_runs, section_of

    boards, mark = read_exports(folder)
    sections = []
    seen: set[Ref] = set()
    for board in sorted(boards, key=lambda board: len(board.results()), reverse=True):
        section = section_of(board, orders)
        robots: list[tuple[str, RunResult, tuple[float, ...]]] = []
        for best in best_runs(section):
            if best.spec.env not in seen and (params := board.rows[best.run.id - 1].solution) is not None:
                seen.add(best.spec.env)
                robots.append(("", best, params))
        sections.append(replace(section, stills=_stills(robots[: max(stills, films)], films)))
    return sections, mark
