"""Solutions of published leaderboards where a command takes a run: `best:ENV/TASK/DESIGN`."""

import json
from collections import defaultdict
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Command
from tests.conformance.cells import cell
from zoobench.cell.problem import Problem
from zoobench.cli import completion, solutions
from zoobench.db import published
from zoobench.db.rows import FinalRow, RunState
from zoobench.db.store import Store
from zoobench.harness.starts import words_of
from zoobench.report.leaderboard import Attempt, BoardRow, Leaderboard
from zoobench.report.leaderboard_export import to_text
from zoobench.spec import Ref, RunSpec

SPEC = cell(design="block", controller="sine-basis", frames=3)
NAME = "best:ground/movement-speed/block"
BOARD_NAME = "best:mine/ground/movement-speed/block"


@pytest.fixture(autouse=True)
def score(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> float:
    """The score of a published solution; the present folder has no database."""
    problem = Problem(SPEC)
    params = problem.initial(np.random.default_rng(0))
    found = problem.evaluate(params).score
    finals = {"score": FinalRow("score", found, "m/s")}
    attempts = (Attempt(0.0, 1.0, False, {}),)
    row = BoardRow(SPEC, RunState.DONE, finals=finals, attempts=attempts, solution=tuple(params.tolist()))
    boards = tmp_path / "boards"
    boards.mkdir()
    (boards / "mine.json").write_text(to_text(Leaderboard("mine", "mine", "a test", (row,))))
    monkeypatch.setattr(published, "folder", lambda: boards)
    return found


def test_it_is_evaluated_without_a_database(zoobench: Command, score: float) -> None:
    """At home its score comes out to the last bit; nothing is stored."""
    reply = zoobench("evaluate", NAME, "--env", "ground,ice", "--format", "json")
    assert reply.code == 0, reply.err
    rows = json.loads(reply.out)
    assert [(row["run"], row["env"].partition("-")[0]) for row in rows] == [(NAME, "ground"), (NAME, "ice")]
    assert rows[0]["score"] == score
    assert "not stored" in reply.err
    chosen = f"{NAME} is of the leaderboard mine: random, seed 0, score {score:.4g} m/s"
    assert chosen in reply.err
    assert zoobench("evaluate", BOARD_NAME, "--env", "ground", "--format", "json").code == 0
    assert [path.name for path in Path.cwd().iterdir()] == ["boards"]


def test_its_episode_is_filmed(zoobench: Command) -> None:
    """As arrays, which need no extra."""
    reply = zoobench("render", NAME, "-o", "film.npz")
    assert reply.code == 0, reply.err
    assert "The score of this simulation" not in reply.err
    assert Path("film.npz").stat().st_size > 0


def test_one_of_an_environment_that_is_gone_is_simulated_in_that_of_today(zoobench: Command) -> None:
    """With a word, as a score may differ; every solution that the package comes with is of use for that."""
    old = replace(SPEC, env=replace(SPEC.env, version=1))
    params = tuple(Problem(SPEC).initial(np.random.default_rng(0)).tolist())
    finals = {"score": FinalRow("score", 0.1, "m/s")}
    row = BoardRow(old, RunState.DONE, finals=finals, attempts=(Attempt(0.0, 1.0, False, {}),), solution=params)
    (Path("boards") / "old.json").write_text(to_text(Leaderboard("old", "old", "a test", (row,))))
    reply = zoobench("render", "best:old/ground/movement-speed/block", "-o", "film.npz")
    assert reply.code == 0, reply.err
    assert f"it was found in ground-v1; in ground-v{SPEC.env.version} its score may differ" in reply.err


def test_a_default_that_has_changed_does_not_change_where_it_is_simulated() -> None:
    """What was found in water on a grid, before water by forces was there, stays in that."""
    old = replace(cell(environment="ocean"), env=Ref.parse("ocean-v11[depth=0.15625,length=0.4375,width=0.1875]"))
    assert solutions._of_today(old).env.kwargs["water"] == "grid"


def test_earlier_bodies_are_not_published(zoobench: Command) -> None:
    """The refusal gives the command of the run."""
    reply = zoobench("render", NAME, "-o", "bodies.png", "--strip", "iterations")
    assert reply.code == 2
    assert "Only the best body of" in reply.err
    assert "zoobench run --env" in reply.err


@pytest.mark.slow
def test_a_run_starts_from_it(zoobench: Command) -> None:
    """In a database that is new; its settings name the run by its key."""
    words = ("--env", "ground", "--task", "movement-speed", "--design", "block", "--controller", "sine-basis")
    method = f"cmaes[start={NAME},population=4]"
    reply = zoobench("run", *words, "--method", method, "--smoke", "--frames", "3", "--seeds", "1")
    assert reply.code == 0, reply.err
    assert f"run-{SPEC.key()[:16]}, {BOARD_NAME}, is of the leaderboard mine: random, seed 0" in reply.err
    reply = zoobench("results", "--format", "json")
    (run,) = json.loads(reply.out)
    assert run["state"] == "done"
    assert run["spec"]["method"]["params"]["start"] == f"run-{SPEC.key()[:16]}"


def test_tab_offers_it_with_its_origin(monkeypatch: pytest.MonkeyPatch) -> None:
    """Under both of its names."""
    monkeypatch.setattr(completion, "runs", lambda context, incomplete: [])
    found = completion.solutions(None, "best:")  # type: ignore[arg-type]
    assert [name for name, _ in found] == [NAME, BOARD_NAME]
    assert found[0][1].startswith("of the leaderboard mine: random, seed 0")
    assert [name for name, _ in completion.solutions(None, "best:m")] == [BOARD_NAME]  # type: ignore[arg-type]


@pytest.mark.parametrize("words", [("evaluate", "best:moon/turning/block"), ("render", "best:x", "-o", "film.npz")])
def test_an_unknown_one_is_refused_with_how_to_find_those_that_exist(zoobench: Command, words: tuple[str, ...]) -> None:
    """Exit code 2; the list has each name with its run."""
    reply = zoobench(*words)
    assert reply.code == 2
    assert "`zoobench list solutions`" in reply.err
    (listed, *_) = json.loads(zoobench("list", "solutions", "--format", "json").out)
    assert listed["name"] == NAME
    assert listed["solution"].startswith("of the leaderboard mine: random, seed 0")


def test_the_start_of_its_key_names_it_where_no_database_has_that(zoobench: Command, database: Path) -> None:
    """With and without a database; a number is that of a run."""
    key = SPEC.key()
    for words in ((key[:14],), (f"run-{key[:16]}",), (key[:14], "--db", database)):
        reply = zoobench("evaluate", *words, "--env", "ground", "--format", "json")
        assert reply.code == 0, reply.err
        assert f"{words[0]} is of the leaderboard mine" in reply.err
    assert zoobench("evaluate", "12", "--env", "ground", "--db", database).code == 2


def test_settings_of_its_environment_are_told() -> None:
    """As they tell an obstacle from another."""
    best = published.named(NAME)
    slot = replace(best, spec=cell(environment="ground[obstacle=slot]"))
    assert words_of(slot).startswith("of the leaderboard mine: ground[obstacle=slot], random, seed 0")


def test_a_start_of_a_key_that_several_runs_share_is_refused(zoobench: Command, database: Path) -> None:
    """Though a published run has it, too: who means a run of the database must not get another one."""
    public, *stored = _three_of_one_start()
    row = BoardRow(public, RunState.DONE, finals={"score": FinalRow("score", 0.1, "m/s")}, solution=(0.0,))
    (Path("boards") / "mine.json").write_text(to_text(Leaderboard("mine", "mine", "a test", (row,))))
    with Store(database) as store:
        store.enqueue(stored)
    shared = public.key()[:4]
    reply = zoobench("evaluate", shared, "--env", "ground", "--db", database)
    assert reply.code == 2
    assert f"Several runs match '{shared}'" in reply.err


def _three_of_one_start() -> list[RunSpec]:
    """Specs of other seeds whose keys begin with the same four characters."""
    found = defaultdict[str, list[RunSpec]](list)
    for seed in count():
        spec = replace(SPEC, seed=seed)
        alike = found[spec.key()[:4]]
        alike.append(spec)
        if len(alike) == 3:
            break
    return alike
