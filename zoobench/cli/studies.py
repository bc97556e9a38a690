"""`zoobench gradcheck`: is the gradient the slope?"""

from typing import Annotated

from typer import Exit, Option

from zoobench.cli.machine import parse_counts
from zoobench.cli.options import FormatOption
from zoobench.cli.output import Format, emit, say


def gradcheck(
    env: Annotated[str, Option("--env", help="Environments: names or globs, with commas.")] = "*",
    task: Annotated[str, Option("--task", help="Tasks, likewise.")] = "*",
    design: Annotated[str, Option("--design", help="The body.")] = "caterpillar",
    controller: Annotated[str, Option("--controller", help="What drives it.")] = "sine-basis",
    fidelity: Annotated[str, Option("--fidelity", help="The grid; the precision is 64 bits in any case.")] = "smoke",
    horizons: Annotated[str, Option("--horizons", help="Substeps, with commas.")] = "10,50,200",
    form: FormatOption = Format.TABLE,
) -> None:
    """Check gradients against central differences.

    A random direction in every group of parameters, at growing horizons. Exit code 1 if a derivative is off by more
    than 1e-4 within 100 substeps, or anything is not finite.
    """
    from dataclasses import fields

    from zoobench.harness.grid import parse_selector
    from zoobench.registry import Kind
    from zoobench.report.listing import Listing
    from zoobench.studies.gradcheck import GradRow
    from zoobench.studies.gradcheck import gradcheck as check

    rows: list[GradRow] = []
    for row in check(
        parse_selector(env, Kind.ENV),
        parse_selector(task, Kind.TASK),
        design=parse_selector(design, Kind.DESIGN)[0],
        controller=parse_selector(controller, Kind.CONTROLLER)[0],
        fidelity=parse_selector(fidelity, Kind.FIDELITY)[0],
        horizons=parse_counts(horizons),
    ):
        rows.append(row)
        say(f"{row.env} x {row.task}, {row.substeps} substeps, {row.group}: relative error {row.relative_error:.1e}")
    names = tuple(field.name for field in fields(GradRow))
    emit(Listing((*names, "right"), tuple((*(getattr(row, n) for n in names), row.is_right) for row in rows)), form)
    if not all(row.is_right for row in rows):
        raise Exit(1)
