"""`zoobench verify validate`: the simulator against closed forms and experiments."""

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

_VERDICTS = {"pass": "ok", "known": "known shortfall", "fail": "FAILED"}


def validate(
    case: Annotated[str, Option("--case", help="Cases: names or globs, separated by commas.")] = "*",
    fast: Annotated[bool, Option("--fast", help="Only the cases that take seconds.")] = False,
    plots: Annotated[
        Path | None, Option("--plots", help="Draw computed and reference values of each case into this folder.")
    ] = None,
    form: FormatOption = Format.TABLE,
) -> None:
    """Validate the simulator against closed forms and experiments.

    Each row is a measured value of a forward run or a gradient, with its bound and source. Exit code 1 if a value
    exceeds its bound. Known shortfalls are listed with their reasons and do not count; a known shortfall that meets its
    bound does.
    """
    from zoobench_verify.cases import select
    from zoobench_verify.comparison_figure import draw
    from zoobench_verify.validate.validation_suite import CASES

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
