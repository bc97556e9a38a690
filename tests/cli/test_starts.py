"""`run`, with and without --dry-run, with a stored run to start from."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from tests.report.content import add_done, add_ended, make_spec
from zoobench.accuracy.tolerance import choose
from zoobench.cell.problem import Problem
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.harness.request import RunRequest
from zoobench.inputs import named_run
from zoobench.spec import RunSelection, RunSpec

HOME = cell(design="caterpillar")


@pytest.fixture
def database(tmp_path: Path) -> Path:
    """Run 1 kept no solution; run 2, a caterpillar's, has one."""
    path = tmp_path / "zoobench.db"
    params = Problem(HOME).initial(np.random.default_rng(0)).tolist()
    with Store(path) as store:
        add_done(store, make_spec(), 1.0)
        add_ended(store, HOME, Ending(RunState.DONE, finals=(FinalRow("score", 1.0, "m/s"),), params=tuple(params)))
    return path


def _specs(method: str, db: Path, notes: list[str] | None = None) -> list[RunSpec]:
    request = RunRequest(RunSelection("ice", "turning", method=method), smoke=True)
    cells = request.cells(str(db), choose, [].append if notes is None else notes.append)
    return [found for found in cells if isinstance(found, RunSpec)]


def test_a_number_becomes_a_key(database: Path) -> None:
    """By number, by key and as the setting has it, it is the same run, and what it takes is said."""
    notes: list[str] = []
    (spec,) = _specs("diffphysics[start=2]", database, notes)
    assert named_run(spec.method) == HOME.key()[:16]
    assert "the controller's" in notes[0]
    assert _specs(f"diffphysics[start={HOME.key()[:9]}]", database) == [spec]
    assert _specs(str(spec.method), database) == [spec]


@pytest.mark.parametrize(
    ("start", "options", "reason"),
    [
        ("7", (), "No run matches '7'"),
        ("1", (), "kept no solutions"),
        ("2", ("--design", "fish"), "The start does not fit: it has"),
        ("2", ("--controller", "trajectory"), "The start does not fit: it has"),
    ],
)
def test_a_start_that_cannot_be_is_refused(
    zoobench: Command, database: Path, start: str, options: tuple[str, ...], reason: str
) -> None:
    """Before anything is queued, with the reason."""
    words = ("--env", "ice", "--task", "turning", "--smoke", "--method", f"diffphysics[start={start}]", *options)
    for dry in ((), ("--dry-run",)):
        reply = zoobench("run", *dry, *words)
        assert reply.code == 2
        assert reason in reply.err
    with Store(database) as store:
        assert len(store.runs()) == 2


def test_the_command_that_repeats_a_run_repeats_its_start_first(zoobench: Command, database: Path) -> None:
    """So that it works where neither has been done."""
    (spec,) = _specs("cmaes[start=2]", database)
    with Store(database) as store:
        store.enqueue([spec])
    card = json.loads(zoobench("show", "3", "--format", "json").out)
    before, after = card["repeat"].split(" && ")
    assert "random-v1" in before
    assert f"start=run-{HOME.key()[:16]}" in after
    assert zoobench("run", "--dry-run", *shlex.split(after)[2:]).code == 0
