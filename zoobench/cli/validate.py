"""`zoobench validate`: does the simulator agree with closed forms and experiments?"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Exit, Option

from zoobench.cli.options import FormatOption, parse_names
from zoobench.cli.output import Format, emit, say

if TYPE_CHECKING:
    from zoobench.report.listing import Listing
    from zoobench.verify.validate.base import Case, Outcome

_COLUMNS = (
    "case", "measure", "value", "bound", "unit", "ok", "resolution", "precision", "seconds", "source",
)  # fmt: skip


def validate(
    case: Annotated[str, Option("--case", help="Cases: names or globs, with commas.")] = "*",
    fast: Annotated[bool, Option("--fast", help="Only the cases that are done in seconds.")] = False,
    plots: Annotated[
        Path | None, Option("--plots", help="A folder for one plot per case, computed beside reference.")
    ] = None,
    form: FormatOption = Format.TABLE,
) -> None:
    """Check the simulator against closed forms and experiments.

    One row for every measured number with its bound and where both come from, forward and gradient. Exit code 1 if a
    number misses its bound.
    """
    from zoobench.verify.validate.validation_suite import run, select

    outcomes: list[tuple[Case, Outcome]] = []
    for chosen, outcome in run(select(parse_names(case), fast=fast)):
        outcomes.append((chosen, outcome))
        say(f"{chosen.name}: {'ok' if outcome.is_met else 'MISSED'} in {outcome.seconds:.1f} s")
        if plots is not None:
            from zoobench.verify.validate.validation_plots import draw

            draw(outcome.figure, plots / f"{chosen.name}.png")
    emit(_listing(outcomes), form)
    if not all(outcome.is_met for _, outcome in outcomes):
        raise Exit(1)


def _listing(outcomes: "list[tuple[Case, Outcome]]") -> "Listing":
    """One row per check."""
    from zoobench.report.listing import Listing

    rows = tuple(
        (
            case.name, check.measure, check.value, check.bound, check.unit, check.is_met, case.grid,
            case.precision_text, round(outcome.seconds, 1), case.source,
        )
        for case, outcome in outcomes
        for check in outcome.checks
    )  # fmt: skip
    return Listing(_COLUMNS, rows)
