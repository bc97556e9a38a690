"""`zoobench verify bench`: the speed of the simulator on this machine."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from zoobench.cli.options import EnvOption, FormatOption, OneFidelityOption
from zoobench.cli.output import Format, emit
from zoobench.cli.steps import Steps
from zoobench.report.listing import Listing, Measured

if TYPE_CHECKING:
    from zoobench_verify.bench.speed import EpisodeRate, Speed


def bench(
    env: EnvOption = "*",
    fidelity: OneFidelityOption = "draft",
    worlds: Annotated[int, Option("--worlds", min=1, help="Worlds simulated in parallel.")] = 1,
    gradients: Annotated[bool, Option(help="Also measure the backward pass.")] = True,
    repeats: Annotated[int, Option("--repeats", min=1, help="Episodes per environment; the median is shown.")] = 5,
    form: FormatOption = Format.TABLE,
) -> None:
    """Measure the speed of the simulator on this machine.

    The speed is control frames of 8 ms simulated per second on one core, for the caterpillar in each environment,
    forward and with the gradient, as the median with minimum and maximum over the repeats. M/s are million
    particle-substeps per second.
    """
    from zoobench.harness.grid import parse_one, parse_selector
    from zoobench.registry import Kind
    from zoobench_verify.bench.speed import Speed, measure

    envs, resolution = parse_selector(env, Kind.ENV), parse_one(fidelity, Kind.FIDELITY)
    rows: list[Speed] = []
    with Steps(len(envs)) as steps:
        for one in envs:
            steps.begin(str(one))
            rows.append(measure(one, resolution, worlds=worlds, gradients=gradients, repeats=repeats))
            steps.end(f"{one}: {rows[-1].forward.fps:.3g} frames/s forward")
    emit(_speeds(rows), form, programs=_with_origin(_speeds_for_programs(rows)))


def _with_origin(listing: Listing) -> Listing:
    """A listing for programs with the commit and the processor that its numbers are of."""
    from zoobench.harness.provenance import gather

    told = gather()
    origin: tuple[Any, ...] = (told["code"]["commit"], told["cpu"]["model"])
    return Listing((*listing.columns, "commit", "processor"), tuple((*row, *origin) for row in listing.rows))


def _speeds(rows: "Sequence[Speed]") -> Listing:
    """Rates with the least and the largest of their repeats."""
    columns = ("env", "worlds", "particles", "forward [frames/s]", "with gradient [frames/s]", "forward [M/s]",
               "with gradient [M/s]")  # fmt: skip

    def frames(rate: "EpisodeRate | None") -> Measured | None:
        return None if rate is None else Measured(rate.fps, rate.least, rate.largest, by_ends=True)

    return Listing(
        columns,
        tuple(
            (row.env, row.worlds, row.particles, frames(row.forward), frames(row.gradient), row.forward.mps,
             row.gradient and row.gradient.mps)
            for row in rows
        ),
    )  # fmt: skip


def _speeds_for_programs(rows: "Sequence[Speed]") -> Listing:
    """Every number in a column of its own."""
    names = ("fps", "least", "largest", "mps")
    columns = ("env", "fidelity", "worlds", "particles", "frames",
               *(f"{what}_{name}" for what in ("forward", "gradient") for name in names))  # fmt: skip
    return Listing(
        columns,
        tuple(
            (row.env, row.fidelity, row.worlds, row.particles, row.frames,
             *(getattr(rate, name, None) for rate in (row.forward, row.gradient) for name in names))
            for row in rows
        ),
    )  # fmt: skip
