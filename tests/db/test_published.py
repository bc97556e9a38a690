"""Solutions of published leaderboards are found by name and by the key of their run."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.report.content import add_ended, make_spec
from zoobench.db import published
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError, UsageError
from zoobench.inputs import Start, run_name
from zoobench.report.leaderboard import BoardRow, Leaderboard, gather
from zoobench.report.leaderboard_export import from_text, to_text
from zoobench.report.leaderboard_files import publish
from zoobench.spec import Ref, RunSpec

SCORES = {("diffphysics-v2[lr=0.1]", 0): 2.0, ("diffphysics-v2[lr=0.1]", 1): 3.0, ("random-v1", 0): 1.0}
SPECS = [make_spec(method=method, seed=seed) for method, seed in SCORES]
BEST = SPECS[1]
NAME = "best:desert/turning/caterpillar"


def _board(path: Path, scores: list[float], specs: list[RunSpec] = SPECS) -> Leaderboard:
    """Runs with these scores; the parameters are the score and a third."""
    with Store(path) as store:
        for spec, score in zip(specs, scores, strict=True):
            finals = (FinalRow("score", score, "m/s"),)
            add_ended(store, spec, Ending(RunState.DONE, finals=finals, params=(score, 1 / 3)))
        return gather(store, "mine", "mine", "a test", [(spec, None) for spec in specs])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of leaderboards, with one, that this process takes for that of the package."""
    found = tmp_path / "boards"
    publish(_board(tmp_path / "runs.db", list(SCORES.values())), found)
    monkeypatch.setattr(published, "folder", lambda: found)
    return found


def test_the_export_holds_the_best_solution_of_each_cell(tmp_path: Path) -> None:
    """Over methods and seeds; bit for bit, read as it was written."""
    board = _board(tmp_path / "runs.db", list(SCORES.values()))
    text = to_text(board)
    assert [row.solution for row in from_text(text, "mine.json").rows] == [None, (3.0, 1 / 3), None]
    assert to_text(from_text(text, "mine.json")) == text


def test_a_better_run_of_another_database_takes_its_place(tmp_path: Path) -> None:
    """Of two publications that complete each other one solution stays, whichever comes later."""
    one, other = _board(tmp_path / "one.db", [2.0, 3.0], SPECS[:2]), _board(tmp_path / "other.db", [9.0], SPECS[2:])
    missing = [BoardRow(spec) for spec in SPECS]
    for later in (replace(one, rows=(*one.rows, missing[2])), replace(other, rows=(*missing[:2], *other.rows))):
        found = later.completed(one).completed(other)
        assert [row.solution for row in found.rows] == [None, None, (9.0, 1 / 3)]


def test_a_solution_is_found_by_its_name_and_key(folder: Path) -> None:
    """Settings, parameters and score of the best run; other keys find nothing."""
    found = published.named(NAME)
    assert (found.spec, found.params, found.score, found.unit) == (BEST, (3.0, 1 / 3), 3.0, "m/s")
    assert published.names() == [NAME]
    start = published.start(BEST.key()[:16])
    assert start is not None
    assert (start.spec, start.params) == (BEST, found.params)
    assert published.start(SPECS[0].key()) is None


def test_an_unknown_name_is_told_with_those_that_exist(folder: Path) -> None:
    """The message names what is published."""
    with pytest.raises(UsageError, match=rf"no solution|No leaderboard.*best:ENV/TASK/DESIGN.*{NAME}"):
        published.named("best:desert/turning/whale")


def test_a_broken_leaderboard_is_told(folder: Path) -> None:
    """Its file is named, instead of a traceback."""
    document = json.loads((folder / "mine.json").read_text())
    document["components"].clear()
    (folder / "mine.json").write_text(json.dumps(document))
    published._all.cache_clear()
    with pytest.raises(StorageError, match=r"mine\.json of this zoobench cannot be read"):
        published.named(NAME)


def test_a_run_may_start_from_a_published_one(folder: Path, tmp_path: Path) -> None:
    """The database gives it to the child like a run of its own, which comes before it."""
    method = Ref("diffphysics", 2, (("lr", 0.1), ("start", run_name(BEST.key()))))
    spec = replace(make_spec(), method=method)
    with Store(tmp_path / "new.db") as store:
        store.enqueue([spec])
        assert [start.params for start in _claimed(store)] == [(3.0, 1 / 3)]
    with Store(tmp_path / "own.db") as store:
        add_ended(store, BEST, Ending(RunState.DONE, finals=(FinalRow("score", 5.0, "m/s"),), params=(5.0,)))
        store.enqueue([spec])
        assert [start.params for start in _claimed(store)] == [(5.0,)]


def _claimed(store: Store) -> tuple[Start, ...]:
    from zoobench.db.owner import Owner

    claim = store.claim(Owner.current(), provenance={})
    assert claim is not None
    return claim.stored
