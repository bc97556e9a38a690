"""`zoobench reach`: is the medium as large as the robot can feel?"""

from typing import Annotated

from typer import Exit, Option

from zoobench.cli.options import FormatOption, OneFidelityOption, TaskOption
from zoobench.cli.output import Format, emit, say


def reach(
    env: Annotated[str, Option("--env", help="Environments with a medium: names or globs, with commas.")],
    task: TaskOption = "*",
    fidelity: OneFidelityOption = "draft",
    frames: Annotated[int, Option("--frames", min=1, help="Control frames of an episode.")] = 200,
    controllers: Annotated[int, Option("--controllers", min=1, help="Random controllers to compare with.")] = 3,
    scale: Annotated[float, Option("--scale", help="Length and width by those of the environment.")] = 1.0,
    form: FormatOption = Format.TABLE,
) -> None:
    """Compare scores in a medium with those in a larger one.

    The larger has twice the length and width; the noise floor is the spread of the score [m/s] over starts a fraction
    of a grid cell apart. Exit code 1 if a change is beyond it: the medium is too small.
    """
    from dataclasses import astuple, fields

    from zoobench.harness.grid import parse_one, parse_selector
    from zoobench.registry import Kind
    from zoobench.report.listing import Listing
    from zoobench.verify.reach import ReachRow
    from zoobench.verify.reach import reach as compare

    rows: list[ReachRow] = []
    for row in compare(
        parse_selector(env, Kind.ENV),
        parse_selector(task, Kind.TASK),
        fidelity=parse_one(fidelity, Kind.FIDELITY),
        frames=frames,
        controllers=controllers,
        scale=scale,
    ):
        rows.append(row)
        say(f"{row.env} x {row.task}, controller {row.controller}: change {row.change:.2g}, noise {row.noise:.2g}")
    names = tuple(field.name for field in fields(ReachRow))
    emit(Listing((*names, "enough"), tuple((*astuple(row), row.is_enough) for row in rows)), form)
    if not all(row.is_enough for row in rows):
        raise Exit(1)
