"""The log of a run, as `zoobench show --log` prints it."""

from datetime import datetime

from zoobench.cli.output import print_text, say
from zoobench.errors import UsageError


def print_log(run: str, attempt: int | None, db: str) -> None:
    """Print the log and the tracebacks of a run, of all attempts for None.

    Raises:
        UsageError: there is no such run or attempt.
    """
    from zoobench.db.store import Store

    with Store(db, create=False) as store:
        found = store.run(run)
        lines = store.logs(found.id, attempt=attempt)
        attempts = [item for item in store.attempts(found.id) if attempt in (None, item.number)]
    if attempt is not None and not attempts:
        raise UsageError(f"Run {found.id} has no attempt {attempt}. `zoobench show {found.id}` lists its attempts.")
    for item in attempts:
        say(f"attempt {item.number} of run {found.id}: {item.outcome}{f', {item.reason}' if item.reason else ''}")
        for line in lines:
            if line.attempt == item.number:
                print_text(f"{datetime.fromtimestamp(line.at):%H:%M:%S}  {line.text}")
        if item.traceback:
            print_text(item.traceback.rstrip())
    if not lines and not any(item.traceback for item in attempts):
        say(f"Run {found.id} is {found.state} and has no log output.")
