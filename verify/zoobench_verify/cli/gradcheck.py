"""`zoobench verify gradcheck`: gradients against central differences."""

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Annotated

from typer import Exit, Option

from zoobench.cli.options import (
    EnvOption,
    FormatOption,
    OneControllerOption,
    OneDesignOption,
    TaskOption,
    component_option,
)
from zoobench.cli.output import Format, choose, emit_several, say
from zoobench.cli.steps import Steps
from zoobench.errors import UsageError
from zoobench.report.listing import listing_of

if TYPE_CHECKING:
    from zoobench.spec import Ref

TABLES = ("rows", "summary")


def gradcheck(
    env: EnvOption = "*",
    task: TaskOption = "*",
    design: OneDesignOption = "caterpillar",
    controller: OneControllerOption = "sine-basis",
    fidelity: Annotated[
        str,
        component_option("fidelities", "--fidelity", "Resolution of the simulation; the precision is always 64 bits."),
    ] = "smoke",
    horizons: Annotated[str, Option("--horizons", help="Horizons in substeps, separated by commas.")] = "10,50,200,800",
    directions: Annotated[
        int, Option("--directions", help="Random directions per parameter group; the worst is shown.")
    ] = 1,
    seed: Annotated[
        int, Option("--seed", min=0, help="Seed of the controller's parameters and of the directions.")
    ] = 0,
    table: Annotated[str, Option("--table", help="Table to print: rows, summary or all.")] = "all",
    form: FormatOption = Format.TABLE,
) -> None:
    """Check gradients against central differences.

    Directional derivatives are compared for every parameter group and horizon. The summary gives the horizon from which
    the dynamics are chaotic. Exit code 1 if the relative error exceeds 1e-4 within 100 substeps, or if a derivative is
    not finite.
    """
    from zoobench.harness.grid import parse_one, parse_selector
    from zoobench.registry import Kind
    from zoobench_verify.gradcheck.check import GradRow, Summary, summarise
    from zoobench_verify.gradcheck.check import gradcheck as check
    from zoobench_verify.gradcheck.gradient_case import GradientCase

    wanted, substeps = choose(table, TABLES, form), _parse_horizons(horizons)
    rows: list[GradRow] = []
    summaries: list[Summary] = []
    robot = parse_one(design, Kind.DESIGN), parse_one(controller, Kind.CONTROLLER), parse_one(fidelity, Kind.FIDELITY)
    cells = _possible(parse_selector(env, Kind.ENV), parse_selector(task, Kind.TASK))
    with Steps(len(cells)) as steps:
        for one_env, one_task in cells:
            name = f"{one_env} x {one_task}"
            steps.begin(name)
            case = GradientCase(one_env, one_task, *robot, seed)
            own: list[GradRow] = []
            for row in check(case, substeps, directions=directions, seed=seed):
                own.append(row)
                say(f"  {name}, {row.substeps} substeps, {row.group}: relative error {row.relative_error:.1e}")
            rows += own
            summaries.append(summarise(case, own))
            steps.end(f"{name}: {'ok' if all(row.is_right for row in own) else 'OFF'}")
    listings = {"rows": listing_of(GradRow, rows), "summary": listing_of(Summary, summaries)}
    emit_several({name: listings[name] for name in wanted}, form)
    if not all(row.is_right for row in rows):
        raise Exit(1)


def _possible(envs: Sequence["Ref"], tasks: Sequence["Ref"]) -> list[tuple["Ref", "Ref"]]:
    """The pairs in which the task makes sense, as there is an object where it needs one; the others are said.

    Raises:
        UsageError: there is none.
    """
    from zoobench.cell.task_fault import sense_fault

    faults = {cell: sense_fault(*cell) for cell in product(envs, tasks)}
    if all(faults.values()):
        raise UsageError(next(iter(faults.values())))
    if skipped := [f"{one_env} x {one_task}" for (one_env, one_task), fault in faults.items() if fault]:
        say(f"Skipped, as the task makes no sense there: {', '.join(skipped)}.")
    return [cell for cell, fault in faults.items() if not fault]


def _parse_horizons(text: str) -> list[int]:
    """Read `50,200` as positive numbers of substeps.

    Raises:
        UsageError: something else.
    """
    try:
        found = [int(word) for word in text.split(",")]
    except ValueError:
        found = [0]
    if min(found) < 1:
        raise UsageError(f"Cannot read {text!r} as horizons. Write positive numbers, for example 50,200.")
    return found
