"""`zoobench status`: the state of the runs in a database."""

import time
from typing import TYPE_CHECKING, Annotated

from typer import Option

from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, FormatOption
from zoobench.cli.output import Format, console, emit, emit_json, rich_table, say

if TYPE_CHECKING:
    from rich.console import RenderableType

    from zoobench.db.store import Store

_REFRESH_SECONDS = 1.0


def status(
    watch: Annotated[bool, Option("--watch", "-w", help="Refresh until all runs have ended.")] = False,
    db: DatabaseOption = DEFAULT_DATABASE,
    form: FormatOption = Format.TABLE,
) -> None:
    """Count the runs by state and show those in progress.

    Each run has its attempt, fraction of the budget spent, best score so far, seconds since its last report, seconds
    until its worker's lease ends, and estimated time left.
    """
    from zoobench.db.store import Store

    with Store(db, create=False) as store:
        if watch and form is Format.TABLE:
            _watch(store)
        else:
            _print_once(store, form)


def _print_once(store: "Store", form: Format) -> None:
    from zoobench.db.rows import RunState
    from zoobench.report.views import counts_text, running_listing, running_overview

    counts = store.counts()
    runs = store.runs(states=[RunState.RUNNING])
    if form is Format.JSON:
        emit_json({"counts": counts, "running": running_listing(runs).records()})
        return
    if form is Format.TABLE:
        print(counts_text(counts))
    else:
        say(counts_text(counts))
    if runs or form is not Format.TABLE:
        emit(running_overview(runs), form, programs=running_listing(runs))


def _watch(store: "Store") -> None:
    from rich.live import Live

    from zoobench.db.rows import OPEN_STATES

    with Live(_picture(store), console=console(), auto_refresh=False) as live:
        while any(store.counts().get(state) for state in OPEN_STATES):
            time.sleep(_REFRESH_SECONDS)
            live.update(_picture(store), refresh=True)


def _picture(store: "Store") -> "RenderableType":
    from rich.console import Group
    from rich.text import Text

    from zoobench.db.rows import RunState
    from zoobench.report.views import counts_text, running_overview

    listing = running_overview(store.runs(states=[RunState.RUNNING]))
    counts = Text(counts_text(store.counts()))
    return Group(counts, rich_table(listing)) if listing.rows else counts
