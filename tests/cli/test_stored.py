"""`run` and what follows it with stored gaits and bodies, from one database."""

import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from tests.report.content import add_ended, make_spec
from zoobench import registry
from zoobench.cell.problem import Problem
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.harness.starts import look_in
from zoobench.harness.worker_pool import run_all
from zoobench.inputs import run_name
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

GAIT = cell(design="block", controller="sine-basis", frames=3)
BODY = cell(design="voxel[edge=0.025]", frames=3)
ARGUMENTS = ("--env", "ground", "--task", "movement-speed", "--smoke", "--method", "random[batch=1]")


@pytest.fixture
def database(tmp_path: Path) -> Path:
    """Run 1 has found a gait, run 2 a body; run 3 has not ended, run 4 failed."""
    path = tmp_path / "zoobench.db"
    with Store(path) as store:
        for spec in (GAIT, BODY):
            params = tuple(Problem(spec).initial(np.random.default_rng(0)).tolist())
            add_ended(store, spec, Ending(RunState.DONE, finals=(FinalRow("score", 1.0, "m/s"),), params=params))
        store.enqueue([replace(GAIT, seed=5)])
        add_ended(store, make_spec(), Ending(RunState.FAILED, "ValueError: boom"))
    look_in(str(path))
    return path


def _both() -> RunSpec:
    """The stored gait on the stored body: nothing is left to be found."""
    gait, body = (f"stored[run={run_name(spec.key())}]" for spec in (GAIT, BODY))
    return cell(Budget("iterations", 1), design=body, controller=gait, method="random[batch=1]", frames=3)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--controller", "stored[run=7]"), "No run matches '7'"),
        (("--controller", "stored[run=3]"), "has no solution yet"),
        (("--design", "stored[run=4]"), "is failed and has no solution"),
        (("--design", "stored[run=1]"), "was given to it"),
        (("--design", "caterpillar", "--controller", "stored[run=1]"), "drives the 8 muscles of block"),
        (("--controller", "stored"), "write stored[run=...]"),
        (("--design", "stored[run=2]", "--fidelity", "draft[grid_spacing=0.02]"), "parameters at smoke"),
    ],
)
def test_what_cannot_be_is_refused(zoobench: Command, database: Path, options: tuple[str, ...], reason: str) -> None:
    """Before anything is queued, with the reason, with and without --dry-run."""
    arguments = ARGUMENTS if "--fidelity" not in options else [word for word in ARGUMENTS if word != "--smoke"]
    for dry in ((), ("--dry-run",)):
        reply = zoobench("run", *dry, *arguments, *options)
        assert reply.code == 2
        assert reason in " ".join(reply.err.split())
    with Store(database) as store:
        assert len(store.runs()) == 4


def test_numbers_become_keys(zoobench: Command, database: Path) -> None:
    """In every axis, so that the run is the same in any database; other names of muscles are told."""
    words = (*ARGUMENTS, "--controller", "stored[run=1]", "--design")
    (row,) = json.loads(zoobench("run", "--dry-run", *words, "stored[run=2]", "--format", "json").out)
    assert row["design"].startswith("stored-v1[run=")
    reply = zoobench("run", "--dry-run", *words, "sdf-lerp")
    assert "The gait of block drives the muscles of sdf-lerp in their order" in reply.err or reply.code == 2


@pytest.mark.slow
def test_a_run_with_a_stored_gait_and_body_can_be_done_shown_filmed_and_tried(
    zoobench: Command, database: Path, tmp_path: Path
) -> None:
    """Its score is that of the gait on the body; every command finds what it names in the database."""
    with Store(database) as store:
        (run,) = store.enqueue([_both()]).new
        params = [store.solution(number) or () for number in (1, 2)]
    (done,) = run_all(database, [run], jobs=1)
    assert done.state is RunState.DONE, done.reason
    control = Problem(GAIT).robot.control_count
    whole = Problem(replace(BODY, frames=3))
    assert whole.robot.control_count == control
    wanted = whole.evaluate(np.array([*params[0], *params[1][control:]])).score
    assert done.score == pytest.approx(wanted, rel=0.01)  # a given body comes to rest in another way than a drawn one
    text = str(run)
    card = json.loads(zoobench("show", text, "--format", "json").out)
    commands = card["repeat"].split(" && ")
    assert len(commands) == 3
    assert "stored" in commands[-1]
    assert zoobench("run", "--dry-run", *shlex.split(commands[-1])[2:]).code == 0
    assert zoobench("design", "export", text, "-o", str(tmp_path / "body.npz")).code == 0
    assert zoobench("evaluate", text, "--env", "ice").code == 0
    assert zoobench("render", text, "-o", str(tmp_path / "film.npz")).code == 0
    with np.load(tmp_path / "body.npz") as body:
        count = len(body["positions"])
    assert 0 < count < Problem(BODY).body.particle_count
    assert registry.get(Kind.DESIGN, "stored").required == {"run"}
    assert Ref.parse(str(_both().design)) == _both().design


@pytest.mark.slow  # tests/harness/test_warm_start.py shows it of a method that begins with what it names
def test_without_what_it_names_a_run_fails_and_says_why(tmp_path: Path, database: Path) -> None:
    """In a database without those runs."""
    spec = cell()
    bare = replace(spec, controller=Ref("stored", 1, (("run", run_name(GAIT.key())),)))
    with Store(tmp_path / "other.db") as store:
        ids = store.enqueue([bare]).new
    (row,) = run_all(tmp_path / "other.db", ids, jobs=1)
    assert row.state is RunState.FAILED
    assert row.reason is not None
    assert "Do that run first" in row.reason
