"""`zoobench watch`: which robot is shown, and where."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from tests.report.content import add_ended
from zoobench.cell.problem import Problem
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.gym import keyboard
from zoobench.spec import RunSpec

GAIT = cell(environment="ice", design="block", controller="sine-basis", task="turning", frames=3)
BODY = cell(design="voxel[edge=0.025]", frames=3)


@pytest.fixture
def shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[RunSpec]:
    """What was shown; run 1 of the database has a fixed body, run 2 one of a design space."""
    with Store(tmp_path / "zoobench.db") as store:
        for spec in (GAIT, BODY):
            params = tuple(Problem(spec).initial(np.random.default_rng(0)).tolist())
            add_ended(store, spec, Ending(RunState.DONE, finals=(FinalRow("score", 1.0, "m/s"),), params=params))
    found: list[RunSpec] = []

    def play(problem: Problem, every: int, tell: Callable[[str], None]) -> int:
        assert problem.robot.space is None
        found.append(problem.spec)
        return 250

    monkeypatch.setattr(keyboard, "play", play)
    return found


def _names(spec: RunSpec) -> tuple[str, ...]:
    return spec.env.name, spec.task.name, spec.design.name, spec.fidelity.name


def test_a_design_is_shown_anywhere(zoobench: Command, shown: list[RunSpec]) -> None:
    """By default the caterpillar, moving on the ground; the time that it lived is told."""
    reply = zoobench("watch")
    assert (reply.code, reply.err) == (0, "250 control frames, 2.0 s of the robot's time\n")
    assert zoobench("watch", "--env", "ice", "--design", "block", "--fidelity", "smoke").code == 0
    assert list(map(_names, shown)) == [
        ("ground", "movement-speed", "caterpillar", "draft"),
        ("ice", "movement-speed", "block", "smoke"),
    ]


def test_a_missing_extra_is_named_before_anything_is_built(zoobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Instead of a traceback."""
    monkeypatch.setitem(sys.modules, "pygame", None)
    monkeypatch.delitem(sys.modules, "zoobench.gym.keyboard")
    reply = zoobench("watch")
    assert reply.code == 2
    assert "pip install 'zoobench[watch]'" in reply.err


def test_the_body_of_a_run_is_shown_where_it_was_found(zoobench: Command, shown: list[RunSpec]) -> None:
    """Or elsewhere; that of a design space as it was found, at its fidelity, which its parameters depend on."""
    for words in (("1",), ("1", "--env", "ground"), ("2",)):
        reply = zoobench("watch", *words)
        assert reply.code == 0, reply.err
    assert list(map(_names, shown)) == [
        ("ice", "turning", "block", "draft"),
        ("ground", "turning", "block", "draft"),
        ("ground", "movement-speed", "stored", "smoke"),
    ]
