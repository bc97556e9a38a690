"""Solutions of published leaderboards are found by name and by the key of their run, the best of those that compare."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.report.boards import unknown
from tests.report.content import add_ended, make_spec
from zoobench.db import published
from zoobench.db.rows import Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.errors import StorageError, UnknownNameError
from zoobench.inputs import Start, run_name
from zoobench.report.leaderboard import BoardRow, FinerScore, Leaderboard, gather
from zoobench.report.leaderboard_export import from_text, to_text
from zoobench.report.leaderboard_files import publish
from zoobench.spec import Ref, RunSpec, is_at_wall, standing

SCORES = {("diffphysics-v2[lr=0.1]", 0): 2.0, ("diffphysics-v2[lr=0.1]", 1): 3.0, ("random-v1", 0): 1.0}
SPECS = [make_spec(method=method, seed=seed) for method, seed in SCORES]
BEST = SPECS[1]
NAME = "best:desert/turning/caterpillar"
BOARD_NAME = "best:mine/desert/turning/caterpillar"
READ: dict[str, Any] = {"finals": {"wall_gap": {"value": 2.5, "unit": "cells"}}}
LENGTHENED: dict[str, Any] = {"finals": {}, "lasting": {"home_gap": 1.5}}
POLICY: dict[str, Any] = {"finals": {}, "lasting": {"home_gap": None}}


def _board(
    path: Path, scores: list[float], specs: list[RunSpec] = SPECS, name: str = "mine", gap: float = 9.0
) -> Leaderboard:
    """Runs with these scores and this gap to a wall; the parameters are the score and a third."""
    with Store(path) as store:
        for spec, score in zip(specs, scores, strict=True):
            finals = FinalRow("score", score, "m/s"), FinalRow("wall_gap", gap, "cells")
            add_ended(store, spec, Ending(RunState.DONE, finals=finals, params=(score, 1 / 3)))
        return gather(store, name, name, "a test", [(spec, None) for spec in specs])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of leaderboards, with one, that this process takes for that of the package."""
    found = tmp_path / "boards"
    publish(_board(tmp_path / "runs.db", list(SCORES.values())), found, unknown)
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
    assert published.names() == [NAME, BOARD_NAME]
    start = published.start(BEST.key()[:16])
    assert start is not None
    assert (start.spec, start.params) == (BEST, found.params)
    assert published.start(SPECS[0].key()) is None


COARSE = Ref("draft", 2, (("grid_spacing", 1 / 64),))
FINE = Ref("standard", 2, (("grid_spacing", 1 / 96),))
LEFT = replace(BEST, fidelity=COARSE, env=replace(BEST.env, version=6), frames=60)
"""A run of the board whose name comes first in the alphabet."""


@pytest.mark.parametrize(
    ("right", "chosen"),
    [
        (replace(LEFT, controller=Ref("fixed-sine", 1)), "a"),
        (replace(LEFT, design=LEFT.design.with_defaults(width=0.1)), "a"),
        (replace(LEFT, env=replace(LEFT.env, version=7)), "z"),
        (replace(LEFT, env=replace(LEFT.env, version=5)), "a"),
        (replace(LEFT, env=replace(LEFT.env, version=7, params=(*LEFT.env.params, ("object", "box")))), "a"),
        (replace(LEFT, fidelity=FINE), "z"),
        (replace(LEFT, frames=100), "z"),
    ],
    ids=["controller", "settings", "later version", "earlier version", "object", "finer", "longer"],
)
def test_the_best_of_several_boards_is_the_best_by_score_where_scores_compare(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, right: RunSpec, chosen: str
) -> None:
    """The board `a` has 3 m/s and `z` 1 m/s; what does not compare is chosen by versions, grid and length."""
    for board, spec, score in (("a", LEFT, 3.0), ("z", right, 1.0)):
        publish(_board(tmp_path / f"{board}.db", [score], [spec], board), tmp_path / "boards", unknown)
    monkeypatch.setattr(published, "folder", lambda: tmp_path / "boards")
    assert published.named(NAME).board == chosen
    for board in ("a", "z"):
        assert published.named(f"best:{board}/desert/turning/caterpillar").board == board


def test_what_tears_on_a_finer_grid_is_taken_only_if_there_is_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though its score is higher."""
    publish(_board(tmp_path / "a.db", [1.0], [LEFT], "a"), tmp_path / "boards", unknown)
    torn = _board(tmp_path / "z.db", [3.0], [replace(LEFT, seed=7)], "z")
    torn = replace(torn, rows=tuple(replace(row, finer=FinerScore(FINE, None)) for row in torn.rows))
    publish(torn, tmp_path / "boards", unknown)
    monkeypatch.setattr(published, "folder", lambda: tmp_path / "boards")
    assert published.named(NAME).board == "a"
    assert published.named("best:z/desert/turning/caterpillar").tears


def test_what_was_found_at_a_wall_is_taken_only_if_there_is_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though its score is higher."""
    publish(_board(tmp_path / "a.db", [1.0], [LEFT], "a"), tmp_path / "boards", unknown)
    publish(_board(tmp_path / "z.db", [3.0], [replace(LEFT, seed=7)], "z", gap=2.9), tmp_path / "boards", unknown)
    monkeypatch.setattr(published, "folder", lambda: tmp_path / "boards")
    assert published.named(NAME).board == "a"
    assert published.named("best:z/desert/turning/caterpillar").at_wall


def test_the_boards_of_this_package_give_their_best() -> None:
    """The best score of those that compare, without those that tear, or were found at a wall, if there are others."""
    for space in ("implicit", "particle", "voxel", "diff-cppn", "sdf-lerp", "barycenter"):
        found = published.named(f"best:ocean/movement-speed/{space}")
        every = [each for each in published._all(published.folder()) if each.spec.design.name == space]
        alike = [each for each in every if published._standing(each)[:4] == published._standing(found)[:4]]
        whole = [each for each in alike if not each.tears] or alike
        away = [each for each in whole if not each.at_wall] or whole
        assert found.score == max(each.score for each in away)


def test_settings_of_the_environment_choose_among_several(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some of them are enough; what a name without them does not mean is listed with those that tell it apart."""
    slot, tall = (
        replace(LEFT, env=replace(LEFT.env, params=(*LEFT.env.params, ("obstacle", "slot"), ("opening", opening))))
        for opening in (0.05, 0.06)
    )
    publish(_board(tmp_path / "a.db", [3.0, 2.0, 1.0], [LEFT, slot, tall], "a"), tmp_path / "boards", unknown)
    monkeypatch.setattr(published, "folder", lambda: tmp_path / "boards")
    assert published.named(NAME).score == 3.0
    assert published.named("best:desert[obstacle=slot]/turning/caterpillar").score == 2.0
    assert published.named("best:a/desert[obstacle=slot,opening=0.06]/turning/caterpillar").score == 1.0
    apart = [f"best:a/desert[obstacle=slot,opening={each}]/turning/caterpillar" for each in (0.05, 0.06)]
    assert published.names() == [NAME, "best:a/desert/turning/caterpillar", *apart]
    with pytest.raises(UnknownNameError, match=r"Did you mean 'best:a/desert\[obstacle=slot,opening=0\.0"):
        published.named("best:a/desert[obstacle=slot,opening=0.07]/turning/caterpillar")


def test_an_unknown_name_is_told_with_those_that_are_near(folder: Path) -> None:
    """And with the command that names all, of which there are hundreds."""
    for text, name in (("best:desert/turning/catapillar", NAME), ("best:mine/desert/turning/cat", BOARD_NAME)):
        told = rf"best:ENV/TASK/DESIGN.*Did you mean '{name}'\? `zoobench list solutions` names all\.$"
        with pytest.raises(UnknownNameError, match=told):
            published.named(text)


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


@pytest.mark.parametrize(
    ("record", "gap"),
    [(READ, 2.5), ({**LENGTHENED, **READ}, 2.5), (LENGTHENED, 1.5), (POLICY, None), ({"finals": {}}, None)],
)
def test_the_gap_is_read_or_known_from_a_longer_episode(record: dict[str, Any], gap: float | None) -> None:
    """That of the run itself comes first."""
    assert published.wall_gap_in(record) == gap


def test_a_result_at_a_wall_is_the_last_choice() -> None:
    """Below three cells, or where nobody looked; among these, and among the others, the score decides."""
    assert [is_at_wall(gap) for gap in (2.99, 3.0, None)] == [True, False, False]
    ordered = sorted([(0.3, 1.0), (0.2, None), (0.1, 9.0), (0.4, 2.0)], key=lambda pair: standing(*pair))
    assert [score for score, _ in ordered] == [0.2, 0.3, 0.4, 0.1]
