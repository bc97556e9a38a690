"""`zoobench verify effects`: the effects that each environment simulates, and their costs."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from zoobench.cli.options import EnvOption, FormatOption, OneFidelityOption
from zoobench.cli.output import Format, choose, emit_next, emit_several
from zoobench.cli.steps import Steps
from zoobench.report.listing import listing_of

if TYPE_CHECKING:
    from zoobench.report.listing import Listing
    from zoobench_verify.effects.coverage import StudiedScene

TABLES = ("coverage", "costs")


def effects(
    env: EnvOption = "*",
    fidelity: OneFidelityOption = "draft",
    repeats: Annotated[
        int, Option("--repeats", min=1, help="Number of alternating measurements with and without an effect.")
    ] = 7,
    table: Annotated[str, Option("--table", help="Table to print: coverage, costs or all.")] = "all",
    form: FormatOption = Format.TABLE,
) -> None:
    """Show the simulated physical effects and their costs.

    Coverage is derived from the scenes. Costs are nanoseconds of CPU time per particle and substep with and without an
    effect, their ratio with its 95 % interval, and bytes of state per particle. Each table is printed when it is ready;
    JSON of several tables is one object.
    """
    from zoobench.harness.grid import parse_one, parse_selector
    from zoobench.registry import Kind
    from zoobench_verify.effects.coverage import Coverage, coverage, studied_scenes
    from zoobench_verify.effects.effect_costs import EffectCost, costs

    wanted = choose(table, TABLES, form)
    scenes = list(studied_scenes(parse_selector(env, Kind.ENV), parse_one(fidelity, Kind.FIDELITY)))
    listings: dict[str, Listing] = {}
    with Steps(len(scenes) * ("costs" in wanted)) as steps:
        for name in wanted:
            if name == "coverage":
                listings[name] = listing_of(Coverage, [coverage(each.env, each.scene) for each in scenes])
            else:
                listings[name] = listing_of(EffectCost, _measured(scenes, partial(costs, repeats=repeats), steps))
            if form is not Format.JSON:
                emit_next(listings[name], form, is_first=len(listings) == 1)
    if form is Format.JSON:
        emit_several(listings, form)


def _measured(
    scenes: "Sequence[StudiedScene]", measure: "Callable[[StudiedScene], Iterator[Any]]", steps: Steps
) -> list[Any]:
    """The rows of the costs, scene by scene."""
    rows: list[Any] = []
    for studied in scenes:
        steps.begin(f"costs of {studied.env}")
        rows += measure(studied)
        steps.end(f"costs of {studied.env}: measured")
    return rows
