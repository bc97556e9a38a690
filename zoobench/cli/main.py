"""The command line: every command is registered here, and every error that a user can act on is printed here."""

import errno
import gc
import os
import sys
from collections.abc import Sequence
from typing import Annotated

from typer import Exit, Option

from zoobench import __version__
from zoobench.cli.app import App
from zoobench.cli.cancel import cancel
from zoobench.cli.components import list_components, show
from zoobench.cli.curves import curves
from zoobench.cli.db import db
from zoobench.cli.design import design
from zoobench.cli.evaluate import evaluate
from zoobench.cli.leaderboard import leaderboard
from zoobench.cli.listings import results, table
from zoobench.cli.machine import doctor
from zoobench.cli.new import new
from zoobench.cli.output import replace_unknown_signs, say
from zoobench.cli.render import render
from zoobench.cli.report import report
from zoobench.cli.run import run
from zoobench.cli.status import status
from zoobench.cli.submit import submit
from zoobench.cli.top_level import ANY_ARGUMENTS, TopLevel, verify
from zoobench.cli.watch import watch
from zoobench.cli.work import work
from zoobench.errors import ZoobenchError

_GARBAGE_EVERY = 100_000  # new objects between two searches for garbage

app = App(
    cls=TopLevel,
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help reads the same in a terminal, a pipe and the README
)


def _print_version(asked: bool) -> None:
    if asked:
        print(f"zoobench {__version__}")
        raise Exit


@app.callback()
def _root(
    version: Annotated[
        bool, Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Which body, which brain and which algorithm wins in which environment.

    Start with: zoobench run --env desert --task turning
    """


app.command("list")(list_components)
app.command("show")(show)
app.command("run")(run)
app.command("work")(work)
app.command("status")(status)
app.command("cancel")(cancel)
app.command("results")(results)
app.command("table")(table)
app.command("curves")(curves)
app.command("report")(report)
app.command("render")(render)
app.command("watch")(watch)
app.command("evaluate")(evaluate)
app.command("submit")(submit)
app.command("doctor")(doctor)
app.command("new")(new)
app.add_typer(leaderboard, name="leaderboard")
app.add_typer(design, name="design")
app.add_typer(db, name="db")
app.command("verify", add_help_option=False, context_settings=ANY_ARGUMENTS)(verify)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line, that of the process for None; returns the exit code of an error that is printed.

    Every other ending is a SystemExit: 0 ok, 1 some run failed or a check fell short, 2 usage, 130 interrupted.
    """
    is_heard = sys.stdout is not None
    _open_closed_streams()
    if not is_heard:
        say("Error: Standard output is closed. Leave it open, or send it to a file or to /dev/null.")
        return 2
    replace_unknown_signs()
    gc.set_threshold(_GARBAGE_EVERY)  # reports keep all that they read: a fifth of their time went into looking it over
    try:
        try:
            app(args=None if arguments is None else list(arguments), prog_name="zoobench")
        finally:
            sys.stdout.flush()  # here, where a failure can still be reported
    except ZoobenchError as error:
        say(f"Error: {error}")
        return error.exit_code
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EPIPE):
            raise
        return _end_without_room(error)
    return 0


def _open_closed_streams() -> None:
    """Let standard streams that are closed lead nowhere: a database that got such a number would be written into."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))  # noqa: SIM115


def _end_without_room(error: OSError) -> int:
    """The end of a command whose output does not fit; that it is not read to its end is no error."""
    if error.errno == errno.ENOSPC:
        what = error.filename or "The output"
        print(f"Error: {what} does not fit: the disk is full. Free some space, then try again.", file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # or Python fails once more over the buffered rest when it ends
    return 1
