"""`zoobench stability`: do hard cases stay within physics, and is the predicted step the largest stable one?"""

from typing import TYPE_CHECKING, Annotated

from typer import Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption, parse_names
from zoobench.cli.output import Format, emit, listing_of, say
from zoobench.cli.studies import save_each
from zoobench.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator


def stability(
    cases: Annotated[str, Option("--case", help="Cases: names or globs, with commas.")] = "*",
    fast: Annotated[bool, Option("--fast", help="Only the cases that take seconds.")] = False,
    largest_step: Annotated[
        bool, Option("--largest-step", help="Instead, find the largest stable steps and compare with the predicted.")
    ] = False,
    only_list: Annotated[bool, Option("--list", help="Instead, list the cases.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Carry out hard cases and judge each on its physics.

    Volume ratios, energy, momentum, penetration, gradients against their bounds; also the smallest step [s] and its
    fraction of the largest stable one, frames repeated with half the step, and the shares of clamped particle-frames
    and repeated frames. Rows are stored as they are done. Exit code 1 if a case fails.
    """
    from zoobench.report.listing import Listing
    from zoobench.verify.stability import stability_suite
    from zoobench.verify.stability.base import Result
    from zoobench.verify.stability.largest import StepRow, largest_steps

    if only_list:
        rows = tuple((found.name, found.is_fast, found.about) for found in stability_suite.suite())
        emit(Listing(("case", "fast", "about"), rows), form)
        return
    if largest_step and (cases != "*" or fast):
        raise UsageError("--largest-step has scenes of its own and does all of them. Leave --case and --fast out.")
    kind: type[Result] | type[StepRow] = StepRow if largest_step else Result
    found: list[Result | StepRow] = []
    results: Iterator[Result | StepRow] = (
        largest_steps() if largest_step else stability_suite.stability(parse_names(cases), fast=fast)
    )
    for row in save_each(
        db, stability_suite.STEP_STUDY if largest_step else stability_suite.STUDY, results, stability_suite.stored
    ):
        found.append(row)
        say(f"{row.verdict}  {row.case}  {row.seconds:.1f} s")
    emit(listing_of(kind, found), form)
    if not all(row.passed for row in found):
        raise Exit(1)
