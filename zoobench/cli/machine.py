"""`zoobench doctor`: checks of this machine."""

from typing import Annotated

from typer import Exit, Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption
from zoobench.cli.output import Format, emit, say
from zoobench.report.listing import Listing


def doctor(
    full: Annotated[bool, Option("--full", help="Read a large database from end to end, too.")] = False,
    mend: Annotated[bool, Option("--mend", help="Put right what is damaged in the database and can be.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Check this installation and machine.

    Python, packages, Taichi, the compile cache, plug-ins, the database and disk space; exit code 1 if there is a
    problem. With --mend damaged settings are written anew from what is left of them, a run of which too little is left
    is removed, and one whose results have changed is queued to be done again.
    """
    from zoobench.verify.doctor import Verdict, examine

    if mend:
        from zoobench.db.store import Store

        with Store(db, create=False) as store:
            for sentence in store.mend() or ["nothing to mend"]:
                say(sentence)
    checks = list(examine(db, full=full))
    rows = tuple((check.name, str(check.verdict), check.detail) for check in checks)
    emit(Listing(("check", "verdict", "detail"), rows), form)
    if any(check.verdict is Verdict.PROBLEM for check in checks):
        raise Exit(1)
