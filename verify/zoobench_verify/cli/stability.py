"""`zoobench verify stability`: extreme cases judged by their physics, and the largest stable steps."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Annotated, Any

from typer import Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption, parse_names
from zoobench.cli.output import Format, emit
from zoobench.cli.steps import Steps
from zoobench.cli.studies import save_each
from zoobench.errors import UsageError
from zoobench.report.listing import Listing


def stability(
    cases: Annotated[str, Option("--case", help="Cases: names or globs, separated by commas.")] = "*",
    fast: Annotated[bool, Option("--fast", help="Only the cases that take seconds.")] = False,
    largest_step: Annotated[
        bool, Option("--largest-step", help="Compare measured and predicted largest stable steps instead.")
    ] = False,
    only_list: Annotated[bool, Option("--list", help="List the cases instead.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Test the stability of the simulator in extreme cases.

    Volume ratios, energy, momentum, penetration and gradients are checked against bounds. The table also has the
    smallest step [s], its ratio to the largest stable step, the frames repeated with half the step, and the fractions
    of clamped particle-frames and of repeated frames. Each row is stored when its case ends. Exit code 1 if a case
    fails.
    """
    from zoobench_verify.cases import select
    from zoobench_verify.stability import stability_suite as suite
    from zoobench_verify.stability.largest import largest_steps

    if only_list:
        listed = tuple((case.name, case.is_fast, case.summary) for case in suite.CASES)
        emit(Listing(("case", "fast", "about"), listed), form)
        return
    if largest_step and (cases != "*" or fast):
        raise UsageError("--largest-step has scenes of its own and does all of them. Leave --case and --fast out.")
    chosen = select(suite.CASES, parse_names(cases), noun="stability case", fast=fast)
    rows: list[dict[str, Any]] = []
    with Steps(None if largest_step else len(chosen)) as steps:

        def rows_of_cases() -> Iterator[dict[str, Any]]:
            for case in chosen:
                steps.begin(case.name)
                yield suite.row_of(case.run())

        found = (asdict(row) for row in largest_steps()) if largest_step else rows_of_cases()
        study = suite.STEP_STUDY if largest_step else suite.STUDY
        for row in save_each(db, study, found, suite.stored):
            rows.append(row)
            steps.end(f"{row['verdict']}  {row['case']}  {row['seconds']:.1f} s")
    emit(Listing(tuple(rows[0]), tuple(tuple(row.values()) for row in rows)), form)
    if any(row["verdict"] == "fail" for row in rows):
        raise Exit(1)
