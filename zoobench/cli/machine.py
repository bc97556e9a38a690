"""`zoobench doctor` and `zoobench bench`: checks of this machine, and its speed."""

from typing import Annotated

from typer import Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption, parse_counts, parse_names
from zoobench.cli.output import Format, emit, listing_of, say
from zoobench.errors import UsageError
from zoobench.report.listing import Listing


def doctor(db: DatabaseOption = DEFAULT_DATABASE, form: FormatOption = Format.TABLE) -> None:
    """Check this installation and machine.

    Python, packages, Taichi, the compile cache, plug-ins, the database and disk space; exit code 1 if there is a
    problem.
    """
    from zoobench.verify.doctor import Verdict, examine

    checks = list(examine(db))
    rows = tuple((check.name, str(check.verdict), check.detail) for check in checks)
    emit(Listing(("check", "verdict", "detail"), rows), form)
    if any(check.verdict is Verdict.PROBLEM for check in checks):
        raise Exit(1)


def bench(
    scenes: Annotated[str, Option("--scenes", help="Environments to measure; all if not given.")] = "",
    particles: Annotated[str, Option("--particles", help="Particle counts to come close to.")] = "10000",
    gradients: Annotated[bool, Option(help="Measure the backward pass too.")] = True,
    repeats: Annotated[int, Option("--repeats", min=1, help="Measured episodes, of which the median.")] = 5,
    precision: Annotated[int, Option("--precision", help="32 or 64 bits.")] = 32,
    device: Annotated[str, Option("--device", help="cpu or cuda.")] = "cpu",
    form: FormatOption = Format.TABLE,
) -> None:
    """Measure how fast the simulator is here.

    Million particle-substeps per second forward, and forward and backward together; compile time [s] with an empty
    and a filled cache; peak memory [MiB].
    """
    from zoobench.verify.bench.bench import BenchRow
    from zoobench.verify.bench.bench import bench as measure

    if precision not in (32, 64) or device not in ("cpu", "cuda"):
        raise UsageError(f"No {precision} bits on {device!r}. The precision is 32 or 64, the device cpu or cuda.")

    rows = measure(
        parse_names(scenes) if scenes else [],
        parse_counts(particles, "particle counts"),
        gradients=gradients,
        repeats=repeats,
        precision=precision,
        device=device,
        on_case=lambda case: say(f"measuring {case.scene} with about {case.particle_count} particles"),
    )
    emit(listing_of(BenchRow, rows), form)
