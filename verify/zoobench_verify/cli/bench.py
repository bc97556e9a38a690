"""`zoobench verify bench`: the speed of the simulator on this machine."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from zoobench.cli.options import FormatOption, parse_counts, parse_names
from zoobench.cli.output import Format, choose, emit_json, emit_several, say
from zoobench.cli.steps import Steps
from zoobench.errors import UsageError, reason
from zoobench.report.listing import Listing, Measured, listing_of, to_json

if TYPE_CHECKING:
    from zoobench_verify.bench.bench import BenchCase
    from zoobench_verify.bench.bench_rows import BenchResults, RateRow

TABLES = ("rates", "costs", "growth", "runs", "ratios", "run-ratios")


def bench(
    scenes: Annotated[str, Option("--scenes", help="Environments to measure. Default: all.")] = "",
    particles: Annotated[
        str, Option("--particles", help="Approximate particle counts, separated by commas.")
    ] = "10000",
    gradients: Annotated[bool, Option(help="Measure the backward pass, too.")] = True,
    repeats: Annotated[int, Option("--repeats", min=1, help="Episodes per case; the median is reported.")] = 5,
    frames: Annotated[
        int, Option("--frames", min=0, help="Episode length in control frames; 0: chosen for a precise measurement.")
    ] = 0,
    precision: Annotated[int, Option("--precision", help="Floating-point precision: 32 or 64 bits.")] = 32,
    worlds: Annotated[int, Option("--worlds", min=1, help="Worlds simulated in parallel.")] = 1,
    device: Annotated[str, Option("--device", help="Device: cpu or cuda.")] = "cpu",
    run: Annotated[
        list[str] | None,
        Option(
            "--run",
            help="Profile a `zoobench run` with these options, as in '--env ground --task turning'. Without --scenes, "
            "nothing else is measured. Can be given several times.",
        ),
    ] = None,
    sources: Annotated[
        list[Path] | None,
        Option("--from", help="Measure nothing; show the results in this file. Can be given several times."),
    ] = None,
    against: Annotated[Path | None, Option("--against", help="Compare with the results in this file.")] = None,
    output: Annotated[
        Path | None, Option("--output", "-o", help="Write each result to this .json file when it is ready.")
    ] = None,
    plot: Annotated[Path | None, Option("--plot", help="Draw rates and shares of time into this file.")] = None,
    table: Annotated[str, Option("--table", help=f"Table to print: {', '.join(TABLES)} or all.")] = "all",
    form: FormatOption = Format.TABLE,
) -> None:
    """Measure the speed of the simulator on this machine.

    Rates are million particle-substeps per second of CPU time: forward, backward, and both together. The tables also
    give kernel-launch overhead, compile times, memory, and the growth of the cost with the number of particles. If a
    C++ compiler is installed, the rate of a small C++ program is measured, too; --against uses it to compare machines.
    """
    from zoobench_verify.bench import bench_rows
    from zoobench_verify.bench.bench import cases

    if precision not in (32, 64) or device not in ("cpu", "cuda"):
        raise UsageError(f"No {precision} bits on {device!r}. The precision is 32 or 64, the device cpu or cuda.")
    chosen = choose(table, TABLES, form)
    if output is not None and output.is_dir():
        raise UsageError(f"No results can be written to {str(output)!r}, which is a folder. Give a file.")
    old = None if against is None else bench_rows.read(against)
    if sources:
        results = bench_rows.joined([bench_rows.read(source) for source in sources])
    else:
        wanted = [] if run and not scenes else cases(
            parse_names(scenes) if scenes else [], parse_counts(particles, "particle counts"),
            gradients=gradients, repeats=repeats, frames=frames, precision=precision, worlds=worlds, device=device,
        )  # fmt: skip
        results = _measure(wanted, run or [], lambda done: _write(done, output))
    if output is not None and sources:
        _write(results, output)
    if plot is not None:
        from zoobench_verify.bench.bench_plot import draw

        draw(results, plot)
        say(f"drawn: {plot}")
    _print(results, old, chosen, form)


def _measure(
    wanted: "Sequence[BenchCase]", runs: Sequence[str], on_results: "Callable[[BenchResults], None]"
) -> "BenchResults":
    """Measure the cases and the runs; `on_results` is given the results so far after each."""
    from dataclasses import replace
    from datetime import UTC, datetime

    from zoobench.harness.provenance import gather
    from zoobench_verify.bench import cpp_reference
    from zoobench_verify.bench.bench import bench as measure
    from zoobench_verify.bench.bench_rows import BenchResults
    from zoobench_verify.bench.run_shares import measure_run

    told = gather()
    machine = {name: told[name] for name in ("zoobench", "code", "packages", "python", "cpu", "memory", "gpus")}
    results = BenchResults({"measured": f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC", **machine})
    program = ""
    try:
        program = str(cpp_reference.build()) if wanted else ""
    except cpp_reference.NoReferenceError as error:
        say(f"{error} Rates are not compared with C++.")
    named = [replace(case, reference=program) for case in wanted]
    with Steps(len(named) + len(runs)) as steps:
        for rate, cost in measure(named, on_case=lambda case: steps.begin(f"{case.scene}, {case.asked} particles")):
            results = replace(results, rates=(*results.rates, rate), costs=(*results.costs, cost))
            on_results(results)
            steps.end(f"{rate.scene}, {rate.particle_count} particles: {rate.forward_mps:.3g} M/s forward")
        for options in runs:
            steps.begin(f"zoobench run {options}")
            results = replace(results, runs=(*results.runs, measure_run(options)))
            on_results(results)
            steps.end(f"zoobench run {options}: measured")
    return results


def _write(results: "BenchResults", path: Path | None) -> None:
    """Replace a file by the results so far.

    Raises:
        UsageError: it cannot be written.
    """
    from zoobench.files import replace_files

    if path is not None:
        try:
            replace_files({path: f"{to_json(results.to_dict())}\n".encode()}, make_folders=True)
        except OSError as error:
            raise UsageError(
                f"No results can be written to {str(path)!r}: {reason(error)}. Give another file."
            ) from error


def _print(results: "BenchResults", old: "BenchResults | None", chosen: Sequence[str], form: Format) -> None:
    """Print tables with every field for programs, with the rates in fewer columns for people."""
    from zoobench_verify.bench import bench_rows, comparison

    found: dict[str, tuple[type[Any], Sequence[Any]]] = {
        "rates": (bench_rows.RateRow, results.rates),
        "costs": (bench_rows.CostRow, results.costs),
        "growth": (comparison.GrowthRow, comparison.growth(results.rates)),
        "runs": (bench_rows.RunShare, results.runs),
        "ratios": (comparison.RatioRow, comparison.ratios(results, old) if old else []),
        "run-ratios": (comparison.RunRatioRow, list(comparison.run_ratios(results, old)) if old else []),
    }
    if old is not None and not found["ratios"][1] and not found["run-ratios"][1]:
        say("Nothing to compare: no case with the same particles, worlds and precision is in both results.")
    listings = {name: listing_of(*found[name]) for name in chosen}
    if form is Format.JSON and len(chosen) > 1:
        records = {name: listing.records() for name, listing in listings.items()}
        emit_json({"machine": dict(results.machine), **records})
        return
    if form not in (Format.CSV, Format.JSON) and "rates" in chosen:
        listings["rates"] = _rates_for_people(results.rates)
    shown = {name: listing for name, listing in listings.items() if listing.rows or len(chosen) == 1}
    emit_several(shown, form)


def _rates_for_people(rows: "Sequence[RateRow]") -> Listing:
    """Rates with the least and the largest of their repeats."""
    columns = (
        "scene", "particles", "worlds", "bits", "forward [M/s]", "reverse [M/s]", "both [M/s]", "backward/forward",
        "recomputed", "forward, CPU [s]", "forward, wall [s]", "both, CPU [s]", "both, wall [s]", "C++ [M/s]",
    )  # fmt: skip

    def rate(row: "RateRow", name: str) -> Measured | None:
        middle, low, high = (getattr(row, f"{name}_mps{end}") for end in ("", "_min", "_max"))
        return None if middle is None else Measured(middle, low, high, by_ends=True)

    return Listing(
        columns,
        tuple(
            (
                row.scene, row.particle_count, row.worlds, row.precision, rate(row, "forward"), rate(row, "reverse"),
                rate(row, "both"), row.backward_over_forward, row.recomputed, row.forward_cpu_s, row.forward_wall_s,
                row.both_cpu_s, row.both_wall_s, row.reference_mps,
            )
            for row in rows
        ),
    )  # fmt: skip
