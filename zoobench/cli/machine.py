"""`zoobench doctor`: checks of this machine."""

from typing import Annotated

from typer import Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption
from zoobench.cli.output import Format, emit, say
from zoobench.report.listing import Listing


def doctor(
    full: Annotated[bool, Option("--full", help="Check every row of the database, even if it is large.")] = False,
    mend: Annotated[bool, Option("--repair", help="Repair the damage in the database that can be repaired.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Check this installation and machine.

    It checks Python, packages, Taichi, the compile cache, plug-ins, the database and disk space. Exit code 1 if there
    is a problem. --repair restores damaged settings, removes runs whose settings cannot be restored, and queues
    runs whose results have changed.
    """
    from zoobench.harness.doctor import Verdict, examine

    if mend:
        from zoobench.db.store import Store

        with Store(db, create=False) as store:
            for sentence in store.mend() or ["nothing to repair"]:
                say(sentence)
    checks = list(examine(db, full=full))
    rows = tuple((check.name, str(check.verdict), check.detail) for check in checks)
    emit(Listing(("check", "verdict", "detail"), rows), form)
    if any(check.verdict is Verdict.PROBLEM for check in checks):
        raise Exit(1)
