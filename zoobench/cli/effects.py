"""`zoobench effects`: the effects that each environment simulates, and their costs."""

from typing import Annotated, Any

from typer import Option

from zoobench.cli.options import EnvOption, FormatOption, OneFidelityOption
from zoobench.cli.output import Format, choose, emit_several, listing_of
from zoobench.cli.steps import Steps

TABLES = ("coverage", "costs", "shares")


def effects(
    env: EnvOption = "*",
    fidelity: OneFidelityOption = "draft",
    particles: Annotated[
        int, Option("--particles", help="Instead, choose each grid for about this many particles; 0: do not.")
    ] = 0,
    repeats: Annotated[int, Option("--repeats", min=1, help="Measurements in turn, of which the median.")] = 7,
    table: Annotated[str, Option("--table", help="coverage, costs, shares or all.")] = "all",
    form: FormatOption = Format.TABLE,
) -> None:
    """Show which effects are simulated, and their costs.

    Coverage is derived from the scenes. Costs are nanoseconds of processor time per particle and substep, with an
    effect and without it, and bytes of state per particle. Shares are those of the parts of a substep.
    """
    from zoobench.harness.grid import parse_one, parse_selector
    from zoobench.registry import Kind
    from zoobench.verify.effects.coverage import Coverage, coverage, studied_scenes
    from zoobench.verify.effects.effect_costs import EffectCost, Share, costs, shares

    wanted = choose(table, TABLES, form)
    kinds = dict(zip(TABLES, (Coverage, EffectCost, Share), strict=True))
    found: dict[str, list[Any]] = {name: [] for name in wanted}
    envs = parse_selector(env, Kind.ENV)
    measures = {name: measure for name, measure in (("costs", costs), ("shares", shares)) if name in wanted}
    with Steps(len(envs) * len(measures)) as steps:
        for studied in studied_scenes(envs, parse_one(fidelity, Kind.FIDELITY), particles):
            if "coverage" in wanted:
                found["coverage"].append(coverage(studied.env, studied.scene))
            for name, measure in measures.items():
                steps.begin(f"{name} of {studied.env}")
                found[name].extend(measure(studied, repeats))
                steps.end(f"{name} of {studied.env}: measured")
    emit_several({name: listing_of(kinds[name], rows) for name, rows in found.items()}, form)
