"""`zoobench validate`: the simulator against closed forms and experiments."""

from pathlib import Path
from typing import Annotated

from typer import Exit, Option

from zoobench.cli.options import FormatOption, parse_names
from zoobench.cli.output import Format, emit, say
from zoobench.cli.steps import Steps
from zoobench.report.listing import Listing

_COLUMNS = (
    "case", "measure", "value", "bound", "unit", "ok", "resolution", "precision", "seconds", "source",
)  # fmt: skip

_VERDICTS = {"pass": "ok", "known": "falls short, as is known", "fail": "MISSED"}


def validate(
    case: Annotated[str, Option("--case", help="Cases: names or globs, with commas.")] = "*",
    fast: Annotated[bool, Option("--fast", help="Only the cases done in seconds.")] = False,
    plots: Annotated[
        Path | None, Option("--plots", help="A folder for one plot per case: computed and reference.")
    ] = None,
    form: FormatOption = Format.TABLE,
) -> None:
    """Check the simulator against closed forms and experiments.

    One row per measured number, with its bound and their source, for forward runs and gradients. Exit code 1 if a
    number misses its bound, unless it is known to; known shortfalls are listed with their reasons, and one that is none
    any longer is a miss, too.
    """
    from zoobench.verify.cases import select
    from zoobench.verify.comparison_figure import draw
    from zoobench.verify.validate.validation_suite import CASES

    results = []
    wanted = select(CASES, parse_names(case), noun="validation case", fast=fast)
    with Steps(len(wanted)) as steps:
        for chosen in wanted:
            steps.begin(chosen.name)
            result = chosen.run()
            results.append(result)
            steps.end(f"{chosen.name}: {_VERDICTS[result.verdict]} in {result.seconds:.1f} s")
            for check in result.checks:
                if check.verdict == "known":
                    say(f"  {check.text}")
            if plots is not None and result.figure is not None:
                draw(result.figure, plots / f"{chosen.name}.png")
    rows = tuple(
        (
            result.case.name, check.measure, check.value, check.bound, check.unit, check.is_met,
            result.case.resolution, result.case.precision_text, round(result.seconds, 1), result.case.source,
        )
        for result in results
        for check in result.checks
    )  # fmt: skip
    emit(Listing(_COLUMNS, rows), form)
    if not all(result.is_met for result in results):
        raise Exit(1)
