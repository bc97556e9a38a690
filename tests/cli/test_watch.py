"""`zoobench watch`: which robot is shown, where, and on which page."""

import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from tests.report.content import add_ended, claim_new
from zoobench import registry
from zoobench.cell.free_cell import has_gait
from zoobench.cell.problem import Problem
from zoobench.db.rows import Batch, Ending, FinalRow, MilestoneRow, RunState
from zoobench.db.store import Store
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.render import watching
from zoobench.render.viewer import Viewer
from zoobench.render.watching import Check, Watched
from zoobench.spec import Ref, RunSpec

pytest.importorskip("viser")

GAIT = cell(environment="ice", design="block", controller="sine-basis", task="turning", frames=3)
BODY = cell(design="voxel[edge=0.025]", frames=3)
LEARNS = cell(controller="sine-basis", frames=3)


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[Watched | None]:
    """What was to be watched, asked three times by each command."""
    found: list[Watched | None] = []

    def watch(viewer: Viewer, newest: Callable[[], Watched | None], tell: Callable[[str], None], check: Check) -> int:
        assert viewer.server.get_port()
        found.extend(newest() for _ in range(3))
        return 250

    monkeypatch.setattr(watching, "watch", watch)
    return found


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """A database: run 1 has a fixed body, run 2 one of a design space, run 3 goes on and run 4 has failed."""
    path = tmp_path / "zoobench.db"
    with Store(path) as store:
        for spec in (GAIT, BODY):
            finals = (FinalRow("score", 1.0, "m/s"),)
            add_ended(store, spec, Ending(RunState.DONE, finals=finals, params=_params(spec)))
        claim_new(store, LEARNS)
        add_ended(store, replace(LEARNS, seed=1), Ending(RunState.FAILED, reason="no"))
    return path


def _params(spec: RunSpec) -> tuple[float, ...]:
    return tuple(Problem(spec).initial(np.random.default_rng(0)).tolist())


def _names(watched: Watched | None) -> tuple[str, ...]:
    assert watched is not None
    spec = watched.cell
    return spec.env.name, spec.task.name, spec.design.name, spec.fidelity.name


def test_a_design_is_shown_anywhere(zoobench: Command, shown: list[Watched | None]) -> None:
    """By default the caterpillar on the ground, moved by hand; the time that it lived is told."""
    reply = zoobench("watch", "--port", 0)
    assert (reply.code, reply.out) == (0, "")
    assert reply.err == "250 control frames, 2.0 s of the robot's time\n"
    assert zoobench("watch", "--port", 0, "--env", "ice", "--design", "block", "--fidelity", "smoke").code == 0
    assert list(map(_names, shown)) == [
        *[("ground", "movement-speed", "caterpillar", "draft")] * 3,
        *[("ice", "movement-speed", "block", "smoke")] * 3,
    ]
    assert not any(each and has_gait(each.cell) for each in shown)


def test_the_robot_of_a_run_is_shown_as_it_was_trained(
    zoobench: Command, runs: Path, shown: list[Watched | None]
) -> None:
    """Where it was, or elsewhere; a body of a design space as it was found."""
    for words in (("1",), ("1", "--env", "ground", "--frames", "7"), ("2",)):
        reply = zoobench("watch", "--port", 0, *words)
        assert reply.code == 0, reply.err
    assert list(map(_names, shown))[::3] == [
        ("ice", "turning", "block", "smoke"),
        ("ground", "turning", "block", "smoke"),
        ("ground", "movement-speed", "stored", "smoke"),
    ]
    assert [each.cell.frames for each in shown[::3] if each] == [3, 7, 3]
    assert all(each and has_gait(each.cell) for each in shown)
    for each in shown[::3]:
        assert each is not None
        assert Problem(each.cell, worlds=1).parameter_count == 0
    assert shown[0] is not None
    assert shown[0].words == "block in ice: turning, run 1, random, score 1 m/s"


def test_a_run_that_goes_on_is_shown_at_its_best_so_far(
    zoobench: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing before it has found something, each better one when it is there, and the solution at the end."""
    found: list[Watched | None] = []
    params = np.array(_params(LEARNS))
    with Store(tmp_path / "zoobench.db") as store:
        claim = claim_new(store, LEARNS)

        def watch(
            viewer: Viewer, newest: Callable[[], Watched | None], tell: Callable[[str], None], check: Check
        ) -> int:
            found.append(newest())
            for step, score in ((1, 0.1), (2, 0.2)):
                best = MilestoneRow(step, score, tuple((step * params).tolist()))
                store.commit(claim, Batch(milestones={step: best}))
                found.extend([newest(), newest()])
            finals = (FinalRow("score", 0.3, "m/s"),)
            store.finish(claim, Ending(RunState.DONE, finals=finals, params=tuple((3 * params).tolist())), Batch())
            found.extend([newest(), newest()])
            return 0

        monkeypatch.setattr(watching, "watch", watch)
        reply = zoobench("watch", "1", "--port", 0)
    assert reply.code == 0, reply.err
    nothing, *rest = found
    assert nothing is None
    assert rest[::2] == rest[1::2]
    assert len({each.cell for each in rest if each}) == 3
    assert [each.words.split(", ", 1)[1] for each in rest[::2] if each] == [
        "run 1 after 1 iteration, random, score 0.1 m/s",
        "run 1 after 2 iterations, random, score 0.2 m/s",
        "run 1, random, score 0.3 m/s",
    ]


def test_what_cannot_be_shown_is_refused(zoobench: Command, runs: Path, shown: list[Watched | None]) -> None:
    """A run without a solution, one that is not there, a name that is unknown; a gait of other muscles by `Problem`."""
    for words, reason in (
        (["4"], "is failed and has no solution"),
        (["17"], "No run matches"),
        (["best:ground/turning/nothing"], "Did you mean"),
        (["--env", "moon"], "Unknown environment"),
        (["--port", "70000"], "Give at most 65535"),
    ):
        reply = zoobench("watch", *words)
        assert reply.code == 2
        assert reason in " ".join(reply.err.split()), reply.err
    assert zoobench("watch", "1", "--design", "caterpillar", "--port", 0).code == 0
    assert shown[0] is not None
    with pytest.raises(UsageError, match="does not fit"):
        Problem(shown[0].cell)


def test_a_published_run_of_an_earlier_version_is_shown(zoobench: Command, shown: list[Watched | None]) -> None:
    """In the environment of today; which run it is, is said once."""
    reply = zoobench("watch", "best:ground/movement-speed/caterpillar", "--port", 0)
    assert reply.code == 0, reply.err
    assert reply.err.count("is of the leaderboard") == 1
    assert shown[0] is not None
    newest = registry.resolve(Kind.ENV, Ref("ground")).version
    assert (shown[0].cell.env.name, shown[0].cell.env.version) == ("ground", newest)


def test_a_port_in_use_is_told(zoobench: Command) -> None:
    """And another asked for."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        reply = zoobench("watch", "--port", port)
    assert reply.code == 2
    assert f"port {port}: Address already in use. Give another --port" in reply.err


def test_a_missing_extra_is_named_before_anything_is_built(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Instead of a traceback."""
    monkeypatch.setitem(sys.modules, "viser", None)
    reply = zoobench("watch")
    assert reply.code == 2
    assert "pip install 'zoobench[watch]'" in reply.err


@pytest.mark.slow
def test_it_serves_until_ctrl_c(tmp_path: Path) -> None:
    """The whole command: its page is there, and it ends with exit code 0."""
    words = [sys.executable, "-m", "zoobench", "watch", "--port", "0", "--fidelity", "smoke"]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    # a job in the background of a shell ignores the signal, and so would its children
    heeding = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(words, cwd=tmp_path, text=True, preexec_fn=heeding, **pipes) as running:
        assert running.stderr is not None
        first = running.stderr.readline()
        assert first.startswith("Open http://127.0.0.1:"), first + running.stderr.read()
        with urllib.request.urlopen(first.split()[1]) as page:
            assert page.status == 200
        running.send_signal(signal.SIGINT)
        out, rest = running.communicate(timeout=60)
    assert (running.returncode, out) == (0, "")
    assert rest == "0 control frames, 0.0 s of the robot's time\n"
