"""`zoobench doctor`: checks of this machine."""

from typing import Annotated

from typer import Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption
from zoobench.cli.output import Format, emit
from zoobench.report.listing import Listing


def doctor(
    full: Annotated[bool, Option("--full", help="Read a large database from end to end, too.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Check this installation and machine.

    Python, packages, Taichi, the compile cache, plug-ins, the database and disk space; exit code 1 if there is a
    problem.
    """
    from zoobench.verify.doctor import Verdict, examine

    checks = list(examine(db, full=full))
    rows = tuple((check.name, str(check.verdict), check.detail) for check in checks)
    emit(Listing(("check", "verdict", "detail"), rows), form)
    if any(check.verdict is Verdict.PROBLEM for check in checks):
        raise Exit(1)
